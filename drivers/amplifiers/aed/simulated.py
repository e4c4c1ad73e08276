"""A simulated AED: what it answers, and how it sends its values.

It keeps to the maker's manual (sources in ``amplifier.py``), not to what the driver sends.
"""

from __future__ import annotations

import numpy as np

from bufferstand.drivers.instruments import Counts

FULL_SCALE = 0x7FFFFF


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
