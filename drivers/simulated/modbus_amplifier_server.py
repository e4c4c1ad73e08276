"""A simulated amplifier behind Modbus TCP: the registers of a map, answered to one client after the other.

Of Modbus only what reading needs (FC3, FC4; application protocol 1.1b3, 6.3 and 6.4), with its exceptions.
"""

from __future__ import annotations

import socket
import struct
import threading
from contextlib import suppress

from drivers.amplifier_map import AmplifierMap, Register
from drivers.registers import encode_value

_ILLEGAL_FUNCTION, _ILLEGAL_ADDRESS, _ILLEGAL_VALUE = 1, 2, 3
_MOST = 125
_HEADER = struct.Struct(">HHHB")


class ModbusAmplifierServer:
    """Serves an amplifier's registers on a free port of this machine.

    Parameters
    ----------
    registers : AmplifierMap
        What lies where.
    rate_Hz : float
        Measurements a second that it says it makes.
    device_id : int
        Unit that it answers for.
    """

    def __init__(self, registers: AmplifierMap, rate_Hz: float, *, device_id: int = 1) -> None:
        self._map = registers
        self._device_id = device_id
        self._words: dict[int, int] = {}
        self._counter = 0
        self._guard = threading.Lock()
        self._end = threading.Event()
        self.silent = False
        """Whether it hears requests and answers none: a cut cable."""
        self.stuck = False
        """Whether its counter stands still: it measures no more."""
        self.requests = 0
        if registers.rate is not None:
            self._write(registers.rate, rate_Hz)
        if registers.identity is not None:
            self._write(registers.identity, registers.identity.expect)
        self.measure(0.0)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(0.05)
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def measure(self, value: float, status: int = 0) -> None:
        """Make a measurement: value in raw counts, and the bits of the status word."""
        with self._guard:
            self._write(self._map.value, value)
            if self._map.status is not None:
                self._write(self._map.status, status)
            if self._map.counter is not None:
                self._counter = (self._counter + (0 if self.stuck else 1)) & 0xFFFF
                self._write(self._map.counter, self._counter)

    def put(self, register: Register, value: float) -> None:
        """Set one register, whatever it is for."""
        with self._guard:
            self._write(register, value)

    def close(self) -> None:
        """Take the server away."""
        self._end.set()
        self._thread.join()
        self._listener.close()

    def _write(self, register: Register, value: float) -> None:
        words = encode_value(value, register.type, self._map.word_order)
        self._words.update(zip(range(register.address, register.address + len(words)), words, strict=True))

    def _accept(self) -> None:
        while not self._end.is_set():
            with suppress(TimeoutError):
                wire, _ = self._listener.accept()
                with wire, suppress(OSError):
                    self._serve(wire)

    def _serve(self, wire: socket.socket) -> None:
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        wire.settimeout(0.05)
        buffer = b""
        while not self._end.is_set():
            try:
                piece = wire.recv(4096)
            except TimeoutError:
                continue
            if not piece:
                return
            buffer += piece
            while len(buffer) >= _HEADER.size:
                transaction, protocol, length, unit = _HEADER.unpack(buffer[: _HEADER.size])
                if protocol or not 2 <= length <= 254:
                    return  # this is no Modbus TCP
                if len(buffer) < 6 + length:
                    break
                request, buffer = buffer[_HEADER.size : 6 + length], buffer[6 + length :]
                self.requests += 1
                if unit == self._device_id and not self.silent:
                    reply = self._answer(request)
                    wire.sendall(_HEADER.pack(transaction, 0, len(reply) + 1, unit) + reply)

    def _answer(self, request: bytes) -> bytes:
        function = request[0]
        if function != (4 if self._map.table == "input" else 3):
            return bytes((function | 0x80, _ILLEGAL_FUNCTION))
        if len(request) != 5:
            return bytes((function | 0x80, _ILLEGAL_VALUE))
        first, count = struct.unpack(">HH", request[1:])
        if not 1 <= count <= _MOST:
            return bytes((function | 0x80, _ILLEGAL_VALUE))
        with self._guard:
            words = [self._words.get(address) for address in range(first, first + count)]
        if None in words:
            return bytes((function | 0x80, _ILLEGAL_ADDRESS))
        return struct.pack(f">BB{count}H", function, 2 * count, *[word or 0 for word in words])
