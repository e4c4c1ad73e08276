"""A Modbus server of our own, on TCP and on a pseudo-terminal, that can be told to misbehave.

Frames by the Modbus application protocol 1.1b3 (PDU), the messaging guide 1.0b (MBAP header) and the serial
line guide 1.02 (RTU: address, PDU, CRC-16 with the low byte first).
"""

from __future__ import annotations

import os
import select
import socket
import struct
import threading
import time
import tty
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Protocol

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
_TICK_S = 0.02


class Refused(Exception):  # noqa: N818 - what the device answers is an exception of Modbus
    """The device refuses a request with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


class Device(Protocol):
    """What answers."""

    unit: int
    """Its unit identifier; 0 answers to any."""

    def registers(self, function: int, address: int, count: int) -> list[int]:
        """Return registers for function 3 or 4; raises :class:`Refused`."""
        ...

    def bits(self, function: int, address: int, count: int) -> list[bool]:
        """Return bits for function 1 or 2; raises :class:`Refused`."""
        ...


def crc16(data: bytes) -> int:
    """Return the CRC of a frame: polynomial 0xA001 (reflected), start 0xFFFF (serial line guide, 6.2.2)."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


class Trouble:
    """What goes wrong with the next replies, one entry each.

    ``lose``; ``late:0.4`` (seconds); ``crc``; ``unit``; ``hang-up``; ``short``; ``exception:6``; ``garble``.
    """

    def __init__(self) -> None:
        self._next: deque[str] = deque()

    def plan(self, *what: str) -> None:
        """Let these befall the next requests, in this order; ``ok`` is a good one."""
        self._next.extend(what)

    def take(self) -> str:
        """Return what befalls the present request."""
        return self._next.popleft() if self._next else "ok"

    @property
    def left(self) -> int:
        """How many are still to come."""
        return len(self._next)


class Server:
    """A device on TCP (``folder`` None) or on a pseudo-terminal that a link in a folder names.

    Parameters
    ----------
    device : Device
    line : Path or None
        Name of the link to the pseudo-terminal: Modbus RTU; None for Modbus TCP on a free loopback port.
    delay_s : float
        Time that each reply takes [s].
    """

    def __init__(self, device: Device, line: Path | None = None, *, delay_s: float = 0.0) -> None:
        self.device, self.trouble = device, Trouble()
        self.delay_s = delay_s
        self.requests: list[tuple[int, int, int, int]] = []
        """Unit, function, address and count of every request."""
        self.port = 0
        self._line = line
        self._end = threading.Event()
        self._threads: list[threading.Thread] = []
        if line is None:
            self._listening = socket.create_server(("127.0.0.1", 0))
            self._listening.settimeout(_TICK_S)
            self.port = self._listening.getsockname()[1]
            self._start(self._accept)
        else:
            self._master, slave = os.openpty()
            tty.setraw(slave)
            self._slave = slave  # held open: the line is there before and after anybody uses it
            line.unlink(missing_ok=True)
            line.symlink_to(os.ttyname(slave))
            self._start(self._serve_line)

    def __enter__(self) -> Server:
        """Return it."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self.close()

    def close(self) -> None:
        """End every thread."""
        self._end.set()
        for thread in self._threads:
            thread.join(timeout=5.0)
        if self._line is None:
            self._listening.close()
        else:
            os.close(self._master)
            os.close(self._slave)

    def _start(self, what: object, *args: object) -> None:
        thread = threading.Thread(target=what, args=args, daemon=True)  # type: ignore[arg-type]
        self._threads.append(thread)
        thread.start()

    # --- what every request goes through -------------------------------------------------------------

    def _reply(self, unit: int, pdu: bytes, what: str) -> bytes | None:
        if self.device.unit not in {0, unit}:
            return None
        function = pdu[0]
        if what.startswith("exception:"):
            return bytes([function | 0x80, int(what.partition(":")[2])])
        try:
            return self._answer(unit, pdu)
        except Refused as refused:
            return bytes([function | 0x80, refused.code])

    def _answer(self, unit: int, pdu: bytes) -> bytes:
        function = pdu[0]
        if function not in {1, 2, 3, 4}:
            self.requests.append((unit, function, -1, -1))
            raise Refused(ILLEGAL_FUNCTION)
        address, count = struct.unpack(">HH", pdu[1:5])
        self.requests.append((unit, function, address, count))
        if function <= 2:
            bits = self.device.bits(function, address, count)
            packed = bytearray((count + 7) // 8)
            for place, bit in enumerate(bits):
                packed[place // 8] |= int(bit) << (place % 8)
            return bytes([function, len(packed)]) + bytes(packed)
        words = self.device.registers(function, address, count)
        return bytes([function, 2 * count]) + struct.pack(f">{count}H", *words)

    def _wait(self, what: str) -> None:
        if self.delay_s:
            time.sleep(self.delay_s)
        if what.startswith("late:"):
            time.sleep(float(what.partition(":")[2]))

    # --- TCP -----------------------------------------------------------------------------------------

    def _accept(self) -> None:
        while not self._end.is_set():
            with suppress(TimeoutError):
                wire, _ = self._listening.accept()
                self._start(self._serve_connection, wire)

    def _serve_connection(self, wire: socket.socket) -> None:
        wire.settimeout(_TICK_S)
        data = b""
        with wire:
            while not self._end.is_set():
                try:
                    more = wire.recv(1024)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not more:
                    return
                data += more
                while len(data) >= 8 and len(data) >= 6 + int.from_bytes(data[4:6], "big"):
                    size = 6 + int.from_bytes(data[4:6], "big")
                    frame, data = data[:size], data[size:]
                    with suppress(OSError):
                        if not self._serve_frame(wire, frame):
                            return

    def _serve_frame(self, wire: socket.socket, frame: bytes) -> bool:
        transaction, unit = frame[:2], frame[6]
        what = self.trouble.take()
        pdu = self._reply(unit, frame[7:], what)
        if what == "hang-up":
            return False
        if pdu is None or what == "lose":
            return True
        self._wait(what)
        if what == "unit":
            unit = (unit + 1) % 248
        if what == "short":
            pdu = bytes([pdu[0], pdu[1] - 2]) + pdu[2:-2]
        wire.sendall(transaction + b"\0\0" + struct.pack(">HB", len(pdu) + 1, unit) + pdu)
        return True

    # --- RTU -----------------------------------------------------------------------------------------

    def _serve_line(self) -> None:
        data = b""
        while not self._end.is_set():
            ready, _, _ = select.select([self._master], [], [], _TICK_S)
            if not ready:
                data = b""  # a pause between bytes ends a frame
                continue
            with suppress(OSError):
                data += os.read(self._master, 256)
            # A request for reading has eight bytes; nothing else is asked of these devices.
            while len(data) >= 8:
                frame, data = data[:8], data[8:]
                if crc16(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
                    self._serve_request(frame)

    def _serve_request(self, frame: bytes) -> None:
        what = self.trouble.take()
        unit = frame[0]
        pdu = self._reply(unit, frame[1:-2], what)
        if pdu is None or what in {"lose", "hang-up"}:
            return
        self._wait(what)
        if what == "short":
            pdu = bytes([pdu[0], pdu[1] - 2]) + pdu[2:-2]
        body = bytes([(unit + 1) % 248 if what == "unit" else unit]) + pdu
        crc = crc16(body) ^ (0x0101 if what == "crc" else 0)
        if what == "garble":
            body = bytes([body[0]]) + bytes(byte ^ 0x10 for byte in body[1:])
        os.write(self._master, body + crc.to_bytes(2, "little"))
