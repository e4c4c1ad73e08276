"""Simulated amplifiers by their protocols: what each answers, and how it sends its values.

They keep to the makers' manuals (sources in drivers/amplifiers/gsv2/amplifier.py and
drivers/amplifiers/aed/amplifier.py), not to what the drivers send."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.stand_file import AmplifierSettings

SYNC, SHORT_SYNC = 0x2C, 0xA5
ZERO, SHORT_ZERO = 0x800000, 0x8000
FULL_SCALE, SHORT_FULL_SCALE = 0x7FFFFF, 0x7FFF

Counts = NDArray[np.int64]

_PARAMETERS: Mapping[int, int] = {
    **dict.fromkeys((0x05, 0x06, 0x07, 0x10), 3),
    **dict.fromkeys((0x08, 0x12, 0x2C, 0x88), 2),
    **dict.fromkeys((0x09, 0x0A, 0x0F, 0x11, 0x13, 0x1D, 0x22, 0x26, 0x2E, 0x30, 0x32, 0x80), 1),
    0x20: 4,
}
"""Parameter bytes of a GSV-2's commands, where there are any."""


class WireDevice(Protocol):
    """An amplifier at the far end of a serial line."""

    def obey(self, data: bytes) -> bytes:
        """Take bytes from the line; return the answers."""
        ...

    def send(self, counts: Counts, *, overload: bool = False) -> bytes:
        """Take new values, shape (n,) about zero; return what goes onto the line by itself."""
        ...


def amplifier_device(settings: AmplifierSettings) -> WireDevice:
    """Return the amplifier that a stand file describes.

    Raises
    ------
    ValueError
        If it is none on a serial line.
    """
    if settings.protocol == "gsv2":
        gsv2 = settings.gsv2
        codes = {} if gsv2.rate_code is None else {gsv2.rate_code: settings.rate_Hz}
        return Gsv2Device(
            settings.rate_Hz, frame=gsv2.frame, decimals=gsv2.decimals, unit="kN", rate_codes=codes
        )
    if settings.protocol == "aed":
        return AedDevice(baud=settings.baud, address=settings.aed.address or 31)
    raise ValueError(f"an amplifier of protocol “{settings.protocol}” is on no serial line of its own")


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


class AedDevice:
    """An AED: commands in text, ended by ``;`` or LF; answers ended by CR LF.

    Parameters
    ----------
    baud : int
        What it says its baud rate is.
    address : int
        Its address on a bus.
    """

    def __init__(self, *, baud: int = 9600, address: int = 31) -> None:
        self.streaming = False
        self.settings = {"COF": 9, "ICR": 2, "TAS": 1, "CSM": 0, "TAV": 0}
        self.refused: set[str] = set()
        self._baud = baud
        self._address = address
        self._talks = True
        self._listens = True
        self._pending = bytearray()
        self._last = 0
        self._status = 0x08

    def obey(self, data: bytes) -> bytes:
        """Take commands; return the answers."""
        self._pending += data.replace(b"\n", b";")
        answers = b""
        while (end := self._pending.find(b";")) >= 0:
            command = self._pending[:end].decode("ascii", errors="replace").strip().upper()
            del self._pending[: end + 1]
            answer = self._do(command) if command else None
            if answer is not None and self._talks:
                answers += answer
        return answers

    def send(self, counts: Counts, *, overload: bool = False) -> bytes:
        """Return new values while it streams (``MSV?0;``)."""
        if not counts.size:
            return b""
        tare = self.settings["TAV"] if self.settings["TAS"] == 0 else 0
        self._status = 0x04 if overload else 0x00
        shown = np.full_like(counts, 2 * FULL_SCALE) if overload else counts - tare
        self._last = int(np.clip(counts[-1], -FULL_SCALE, FULL_SCALE))
        if not self.streaming:
            return b""
        # In continuous binary output the end characters come behind the last value only.
        return b"".join(self._encode(int(count), continuous=True) for count in shown)

    def _do(self, command: str) -> bytes | None:
        if command[0] == "S" and command[1:].isdigit():
            chosen = int(command[1:])
            self._listens = chosen in {98, self._address}
            self._talks = chosen == self._address
            return None
        if not self._listens:
            return None
        if command == "STP":
            was, self.streaming = self.streaming, False
            return b"\r\n" if was and not self.settings["COF"] & 1 else None
        if self.streaming:
            return None  # “No other parameters can be changed during the continuous output”
        if command in self.refused or command[:3] in self.refused:
            return b"?\r\n"
        return self._measure(command) if command in {"MSV?", "MSV?0", "TAR"} else self._parameter(command)

    def _measure(self, command: str) -> bytes | None:
        if command == "MSV?0":
            self.streaming = True
            return None
        if command == "TAR":
            self.settings.update(TAV=self._last, TAS=0)
            return b"0\r\n"
        tare = self.settings["TAV"] if self.settings["TAS"] == 0 else 0
        return self._encode(self._last - tare, continuous=False)

    def _parameter(self, command: str) -> bytes:
        name, value = command[:3], command[3:]
        if command == "IDN?":
            return b'HBM, "AED104         ","1234   ", P20\r\n'
        if command == "BDR?":
            return f"{self._baud},1\r\n".encode()
        if name not in self.settings or not (value == "?" or value.lstrip("-").isdigit()):
            return b"?\r\n"
        if value == "?":
            return f"{self.settings[name]}\r\n".encode()
        self.settings[name] = int(value)
        return b"0\r\n"

    def _encode(self, count: int, *, continuous: bool) -> bytes:
        output = self.settings["COF"] % 32
        if output & 1:
            fields = [f"{int(np.clip(count, -9999999, 9999999)):8d}"]
            if output in {1, 9}:
                fields.append(f"{self._address:02d}")
            if output in {9, 11}:
                fields.append(f"{self._status:03d}")
            return ",".join(fields).encode() + b"\r\n"
        if output in {2, 6}:
            body = int(np.clip(count, -0x8000, 0x7FFF)).to_bytes(2, "big", signed=True)
        else:
            value = int(np.clip(count, -FULL_SCALE, FULL_SCALE)).to_bytes(3, "big", signed=True)
            last = self._status if output in {8, 12} else 0
            if self.settings["CSM"] and output in {8, 12}:
                last = value[0] ^ value[1] ^ value[2]
            body = value + bytes([last])
        if output in {4, 6, 12}:
            body = body[::-1]
        return body if continuous or self.settings["COF"] >= 32 else body + b"\r\n"
