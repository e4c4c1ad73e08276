"""Three Modbus TCP servers for one device: of pymodbus, of pyModbusTCP, and a raw one that can misbehave."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice
from pyModbusTCP.server import DataHandler, ModbusServer

from tests.drivers.ring_device import RingDevice

Reply = Callable[[socket.socket, bytes, bytes], None]
"""Sends (or not) a reply: connection, MBAP header of the request, true reply PDU."""


def framed(header: bytes, pdu: bytes) -> bytes:
    return header[:4] + struct.pack(">H", len(pdu) + 1) + header[6:7] + pdu


def truly(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(framed(header, pdu))


def silent(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    """The request was done, the reply is lost."""


def late(delay_s: float) -> Reply:
    def reply(wire: socket.socket, header: bytes, pdu: bytes) -> None:
        time.sleep(delay_s)
        wire.sendall(framed(header, pdu))

    return reply


def dropped(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.shutdown(socket.SHUT_RDWR)


def one_register_less(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(framed(header, bytes([pdu[0], pdu[1] - 2]) + pdu[2:-2]))


def half_a_frame(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    frame = framed(header, pdu)
    wire.sendall(frame[: len(frame) // 2])


def with_function(function: int) -> Reply:
    return lambda wire, header, pdu: wire.sendall(framed(header, bytes([function]) + pdu[1:]))


def with_exception(code: int) -> Reply:
    return lambda wire, header, pdu: wire.sendall(framed(header, bytes([pdu[0] | 0x80, code])))


def other_transaction(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    number = struct.unpack(">H", header[:2])[0]
    wire.sendall(framed(struct.pack(">H", number ^ 0x5555) + header[2:], pdu))


def other_echo(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(framed(header, pdu[:-1] + bytes([pdu[-1] ^ 1])))


def garbled(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(framed(header, bytes([pdu[0], 0xFF]) + pdu[2:]))


class RawServer:
    """Answers one connection after the other; ``replies`` are used up first, then it answers truly."""

    def __init__(self, device: RingDevice) -> None:
        self.device = device
        self.replies: list[Reply] = []
        self.requests: list[bytes] = []
        self.connections = 0
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._open: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._threads[0].join()
        for wire in self._open:
            with suppress(OSError):  # the other side may have closed it
                wire.shutdown(socket.SHUT_RDWR)
        for thread in self._threads[1:]:
            thread.join()

    def _accept(self) -> None:
        while True:
            try:
                wire, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            self._open.append(wire)
            thread = threading.Thread(target=self._serve, args=(wire,))
            self._threads.append(thread)
            thread.start()

    def _serve(self, wire: socket.socket) -> None:
        with wire:
            try:
                while header := self._receive(wire, 7):
                    pdu = self._receive(wire, struct.unpack(">H", header[4:6])[0] - 1)
                    self.requests.append(pdu)
                    answer = self._answer(pdu)
                    reply = self.replies.pop(0) if self.replies else truly
                    reply(wire, header, answer)
            except OSError:
                return

    @staticmethod
    def _receive(wire: socket.socket, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = wire.recv(size - len(data))
            if not part:
                return b""
            data += part
        return data

    def _answer(self, pdu: bytes) -> bytes:
        function = pdu[0]
        if function == 3:
            address, count = struct.unpack(">HH", pdu[1:5])
            return self._words(function, self.device.read(address, count))
        if function == 6:
            address, value = struct.unpack(">HH", pdu[1:5])
            self.device.write(address, [value])
            return pdu
        if function == 16:
            address, count = struct.unpack(">HH", pdu[1:5])
            self.device.write(address, list(struct.unpack(f">{count}H", pdu[6:])))
            return pdu[:5]
        assert function == 23
        read_address, read_count, address, count = struct.unpack(">HHHH", pdu[1:9])
        self.device.write(address, list(struct.unpack(f">{count}H", pdu[10:])))
        return self._words(function, self.device.read(read_address, read_count))

    @staticmethod
    def _words(function: int, words: list[int]) -> bytes:
        return struct.pack(f">BB{len(words)}H", function, 2 * len(words), *words)


@contextmanager
def raw_server(device: RingDevice) -> Iterator[RawServer]:
    server = RawServer(device)
    try:
        yield server
    finally:
        server.close()


@contextmanager
def pymodbus_server(device: RingDevice) -> Iterator[int]:
    async def access(
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        if values is not None:
            device.write(address, [int(value) for value in values])
        else:
            registers[address - start : address - start + count] = device.read(address, count)
        return None

    ready = threading.Event()
    facts: dict[str, Any] = {}

    async def serve() -> None:
        block = SimData(0, count=len(device.words), values=0, datatype=DataType.REGISTERS)
        server = ModbusTcpServer(SimDevice(1, [block], action=access), address=("127.0.0.1", 0))
        await server.serve_forever(background=True)
        facts["port"] = server.transport.sockets[0].getsockname()[1]  # type: ignore[attr-defined]
        facts["stop"] = asyncio.Event()
        facts["loop"] = asyncio.get_running_loop()
        ready.set()
        await facts["stop"].wait()
        await server.shutdown()  # type: ignore[no-untyped-call]

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    assert ready.wait(60.0)
    try:
        yield facts["port"]
    finally:
        facts["loop"].call_soon_threadsafe(facts["stop"].set)
        thread.join()


class _Handler(DataHandler):  # type: ignore[misc]
    def __init__(self, device: RingDevice) -> None:
        super().__init__()
        self.device = device

    def read_h_regs(self, address: int, count: int, _srv_info: Any) -> Any:
        return DataHandler.Return(exp_code=0, data=self.device.read(address, count))

    def write_h_regs(self, address: int, words_l: list[int], _srv_info: Any) -> Any:
        self.device.write(address, words_l)
        return DataHandler.Return(exp_code=0)


class _QuickServer(ModbusServer):  # type: ignore[misc]
    def _serve(self) -> None:
        """As the original, but a stop does not wait for half a second."""
        self._evt_running.set()
        try:
            self._service.serve_forever(poll_interval=0.01)
        finally:
            self._evt_running.clear()


@contextmanager
def pymodbustcp_server(device: RingDevice) -> Iterator[int]:
    server = _QuickServer(host="127.0.0.1", port=0, no_block=True, data_hdl=_Handler(device))
    server.start()
    try:
        yield server._service.socket.getsockname()[1]
    finally:
        server.stop()


@contextmanager
def loop_thread() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield loop
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()
