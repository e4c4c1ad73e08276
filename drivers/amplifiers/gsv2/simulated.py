"""A simulated GSV-2: what it answers, and how it sends its values.

It keeps to the maker's manual (sources in ``amplifier.py``), not to what the driver sends.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bufferstand.drivers.instruments import Counts

SYNC, SHORT_SYNC = 0x2C, 0xA5
ZERO, SHORT_ZERO = 0x800000, 0x8000
FULL_SCALE, SHORT_FULL_SCALE = 0x7FFFFF, 0x7FFF

_PARAMETERS: Mapping[int, int] = {
    **dict.fromkeys((0x05, 0x06, 0x07, 0x10), 3),
    **dict.fromkeys((0x08, 0x12, 0x2C, 0x88), 2),
    **dict.fromkeys((0x09, 0x0A, 0x0F, 0x11, 0x13, 0x1D, 0x22, 0x26, 0x2E, 0x30, 0x32, 0x80), 1),
    0x20: 4,
}
"""Parameter bytes of a GSV-2's commands, where there are any."""


class Gsv2Device:
    """A GSV-2: sends unasked, obeys commands of one byte and their parameters.

    Parameters
    ----------
    rate_Hz : float
        Values a second that it says it is set to.
    frame : str
        ``binary5``, ``binary3`` or ``text``: what it is set to at first.
    decimals, unit
        Of its text format.
    rate_codes : dict
        Rate for each parameter of “set frequency” that it knows.
    """

    def __init__(
        self,
        rate_Hz: float,
        *,
        frame: str = "binary5",
        decimals: int = 4,
        unit: str = "",
        rate_codes: dict[int, float] | None = None,
    ) -> None:
        self.rate_Hz = rate_Hz
        self.streaming = True
        self.mode = 0x02 if frame == "text" else 0x00
        self.tx_mode = 0x00 if frame == "binary3" else 0x08
        self.locked = False
        self.serial_number = b"09183701"
        self.firmware = (1, 42)
        self._decimals = decimals
        self._unit = unit
        self._rate_codes = rate_codes or {}
        self._pending = bytearray()
        self._offset = 0
        self._last = 0

    def obey(self, data: bytes) -> bytes:
        """Take commands; return the bytes that answer them."""
        self._pending += data
        answers = b""
        while self._pending:
            command = self._pending[0]
            wanted = 1 + _PARAMETERS.get(command, 0)
            if len(self._pending) < wanted:
                break
            parameters = bytes(self._pending[1:wanted])
            del self._pending[:wanted]
            answers += self._do(command, parameters)
        return answers

    def send(self, counts: Counts, *, overload: bool = False) -> bytes:
        """Return frames of new values, while it streams; beyond full scale they are saturated."""
        if not counts.size:
            return b""
        self._last = int(counts[-1])
        if not self.streaming:
            return b""
        shown = np.full_like(counts, 2 * FULL_SCALE) if overload else counts - self._offset
        if self.mode & 0x02:
            return b"".join(self._line(int(count)) for count in shown)
        return encode_frames(shown) if self.tx_mode & 0x08 else encode_short_frames(shown)

    def _do(self, command: int, parameters: bytes) -> bytes:
        match command:
            case 0x23 | 0x24:
                self.streaming = command == 0x24
            case 0x0C:
                self._offset = self._last
            case 0x12:
                self.rate_Hz = self._rate_codes.get(int.from_bytes(parameters, "big"), self.rate_Hz)
            case 0x16:
                return ((1 << 24) - round(5e6 / self.rate_Hz)).to_bytes(3, "big")
            case 0x1F:
                return self.serial_number
            case 0x26 | 0x80 if not self.locked:
                if command == 0x26:
                    self.mode = parameters[0]
                else:
                    self.tx_mode = parameters[0]
            case 0x27:
                return bytes([self.mode])
            case 0x2B:
                return bytes(self.firmware)
            case 0x81:
                return bytes([self.tx_mode])
        return b""

    def _line(self, count: int) -> bytes:
        digits = f"{abs(count):0{self._decimals + 1}d}"
        split = len(digits) - self._decimals
        number = digits[:split] + ("." + digits[split:] if self._decimals else "")
        return f"{'-' if count < 0 else '+'}{number} {self._unit}".rstrip().encode() + b"\r\n"


def encode_frames(counts: Counts) -> bytes:
    """Return the frames of counts about zero, shape (n,); beyond full scale they are saturated."""
    raw = np.clip(counts, -FULL_SCALE, FULL_SCALE) + ZERO
    table = np.empty((raw.size, 5), dtype=np.uint8)
    table[:, 0] = SYNC
    table[:, 1] = 0
    table[:, 2] = raw >> 16
    table[:, 3] = raw >> 8 & 0xFF
    table[:, 4] = raw & 0xFF
    return table.tobytes()


def encode_short_frames(counts: Counts) -> bytes:
    """Return frames of three bytes; beyond full scale they are saturated."""
    raw = np.clip(counts, -SHORT_FULL_SCALE, SHORT_FULL_SCALE) + SHORT_ZERO
    table = np.empty((raw.size, 3), dtype=np.uint8)
    table[:, 0] = SHORT_SYNC
    table[:, 1] = raw >> 8
    table[:, 2] = raw & 0xFF
    return table.tobytes()
