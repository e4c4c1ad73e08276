"""The registers of a simulated controller behind a wire in memory, in virtual time.

The drivers of real controllers talk to it as over a network: each request takes its time on the way, during
which the stand goes on, and the simulated faults of the wire strike it. What a round trip costs can be told
to the sample, without the computer's own speed.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusIOException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    ReadWriteMultipleRegistersRequest,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterResponse,
)
from pymodbus.transport import CommParams

from bufferstand.drivers.controllers import PollingController, RingController
from bufferstand.drivers.modbus import ModbusLink, TcpWire
from bufferstand.drivers.register_maps import SIMULATED, Profile, ProfileRegister
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import SimulatedDevice
from bufferstand.drivers.simulated.wires import RegisterBank, Responder
from bufferstand.drivers.stand_file import StandFile

Lost = Literal["", "request", "reply"]
"""What of a round trip gets lost."""
BLOCK = 128
"""Samples of one window in memory, where no frame of 253 bytes bounds it."""
SOON_S = 0.001
"""A reply that takes no longer on its way back is had before the stand is looked at again [s]."""
_HEADER = struct.Struct(">HB")
"""What a frame begins with: number of the transaction, unit."""
_NUMBERS = 1 << 16
_WRITTEN: dict[int, type[ModbusPDU]] = {6: WriteSingleRegisterResponse, 16: WriteMultipleRegistersResponse}
_READ = (3, 4, 23)
_FC23 = struct.Struct(">BHHHHB")


class VirtualWire(TcpWire):
    """A network without sockets: what a client sends is answered in memory, after its time on the way.

    Parameters
    ----------
    device : SimulatedDevice
        Who answers; moved by ``clock``. Its faults of the wire strike.
    profile : Profile
        Its register map.
    clock : VirtualClock
        Passes by a round trip with each request.
    round_trip_s : callable
        Duration of the next round trip [s].
    lost : callable, optional
        Of a request (function code and data): whether ``request`` or ``reply`` is lost on the way, empty if
        neither is.
    """

    def __init__(
        self,
        device: SimulatedDevice,
        profile: Profile,
        clock: VirtualClock,
        round_trip_s: Callable[[], float],
        lost: Callable[[bytes], Lost] = lambda _: "",
    ) -> None:
        super().__init__("in process", 0)
        self.bank = RegisterBank(device, profile, clock.now_s)
        window = profile.window
        self.responder = Responder(
            self.bank,
            lambda _: None,
            lambda: device.faults.find("controller", "lost", clock.now_s()) is not None,
            FrameFaults(device.faults, "controller", clock.now_s),
            profile.read_write,
            most_read=0 if window is None else window.registers,
        )
        self.clock, self.round_trip_s, self.lost = clock, round_trip_s, lost
        self.now_s, self.sleep = clock.now_s, clock.advance
        self._number = 0

    @property
    def address(self) -> str:
        """Where it leads, for messages."""
        return "in process"

    def open(self, timeout_s: float) -> ModbusTcpClient:
        """Return a client whose connection is this wire."""
        return _VirtualClient(self, timeout_s)

    def next_number(self) -> int:
        """Return the number of the next transaction; a late reply to an earlier one is known by its own."""
        self._number = (self._number + 1) % _NUMBERS
        return self._number


class _VirtualClient(ModbusTcpClient):
    """A client of pymodbus whose requests go no further than a responder in this process."""

    def __init__(self, wire: VirtualWire, timeout_s: float) -> None:
        super().__init__("in process", timeout=timeout_s, retries=0)
        self.transaction = _Transactions(wire, self.comm_params)  # type: ignore[assignment]
        self._open = True

    @property
    def connected(self) -> bool:
        """Whether it was not closed."""
        return self._open

    def close(self) -> None:
        """Let go of the wire."""
        self._open = False

    def execute(self, no_response_expected: bool, request: ModbusPDU) -> ModbusPDU:  # noqa: ARG002
        """Send a request and wait for its reply."""
        request.transaction_id = self.transaction.getNextTID()
        self.transaction.pdu_send(request)
        return self.transaction.sync_get_response(request.dev_id, request.transaction_id)


class _Transactions:
    """Requests and replies of one connection, by the names that pymodbus gives these calls.

    Parameters
    ----------
    wire : VirtualWire
    comm_params : CommParams
        ``timeout_connect`` is how long a reply is waited for [s].
    """

    def __init__(self, wire: VirtualWire, comm_params: CommParams) -> None:
        self._wire = wire
        self.comm_params = comm_params
        self._sent: tuple[bytes, bytes, float] | None = None
        self._coming: deque[tuple[float, bytes]] = deque()

    def getNextTID(self) -> int:  # noqa: N802 - pymodbus' name
        """Return the number of the next transaction."""
        return self._wire.next_number()

    def pdu_send(self, request: ModbusPDU) -> None:
        """Put a request on its way."""
        head = _HEADER.pack(request.transaction_id, request.dev_id)
        self._sent = head, _encoded(request), self._wire.clock.now_s()

    def sync_get_response(self, dev_id: int, tid: int) -> ModbusPDU:
        """Wait for the reply to a request; those to others are passed over.

        Raises
        ------
        TimeoutError
            If none comes in time.
        ModbusIOException
            If it cannot be decoded.
        """
        clock, head = self._wire.clock, _HEADER.pack(tid, dev_id)
        sent, self._sent = self._sent, None
        until_s = self.comm_params.timeout_connect + (clock.now_s() if sent is None else sent[2])
        if sent is not None:
            self._carry(*sent)
        while self._coming and self._coming[0][0] <= until_s:
            at_s, frame = self._coming.popleft()
            (clock.pass_by if at_s - clock.now_s() < SOON_S else clock.advance)(at_s - clock.now_s())
            if frame.startswith(head):
                return _decoded(frame[_HEADER.size :])
        clock.advance(until_s - clock.now_s())
        raise TimeoutError

    def _carry(self, head: bytes, request: bytes, sent_s: float) -> None:
        """Let a request arrive, be answered, and its reply be on the way back."""
        wire, clock = self._wire, self._wire.clock
        responder, lost = wire.responder, wire.lost(request)
        if lost == "request":
            return
        trip_s = wire.round_trip_s()
        clock.advance(sent_s + 0.5 * trip_s - clock.now_s())
        heard = None if responder.cut() else responder.hear(request)
        reply = None if heard is None else responder.answer(heard)
        if reply is not None and not lost:
            back_s = max(clock.now_s(), sent_s + trip_s)
            self._coming.extend(
                (back_s + late_s, frame) for late_s, frame in responder.arrivals(head + reply)
            )


def _encoded(request: ModbusPDU) -> bytes:
    """Return function code and data of a request; pymodbus refuses to read more than a frame can carry."""
    if not isinstance(request, ReadWriteMultipleRegistersRequest):
        return bytes((request.function_code,)) + request.encode()
    values, written = request.write_registers, (request.write_address, request.write_count)
    head = _FC23.pack(23, request.read_address, request.read_count, *written, request.write_byte_count)
    return head + struct.pack(f">{len(values)}H", *values)


def _decoded(reply: bytes) -> ModbusPDU:
    """Return what a reply says; its byte count is modulo 256 where a window holds more than a frame."""
    function, data = reply[0], reply[1:]
    if function & 0x80:
        return ExceptionResponse(function & 0x7F, data[0])
    if function in _READ:
        count, rest = divmod(len(data) - 1, 2)
        if rest or data[0] != 2 * count & 0xFF:
            raise ModbusIOException(f"byte count {data[0]} of {len(data) - 1} bytes")
        pdu: ModbusPDU = ReadHoldingRegistersResponse(
            registers=list(struct.unpack_from(f">{count}H", data, 1))
        )
        pdu.function_code = function
        return pdu
    if function not in _WRITTEN:
        raise ModbusIOException(f"unknown function {function}")
    pdu = _WRITTEN[function]()
    pdu.decode(data)
    return pdu


def in_memory(profile: Profile) -> Profile:
    """Return a register map for a wire in memory: with a window of ``BLOCK`` samples, and saying “simulated”.

    What is put further lies behind all registers, so that every other address stays as it is.
    """
    free = max(r.address + r.words for r in profile.registers.values())
    window, registers = profile.window, dict(profile.registers)
    if not profile.has(SIMULATED):
        registers[SIMULATED] = ProfileRegister(name=SIMULATED, address=free, type="u16", access="r")
        free += 1
    if window is not None:
        free = max(free, window.address)
        words = window.header_words + BLOCK * window.sample_words
        if free + words <= _NUMBERS:
            window = window.model_copy(update={"address": free, "registers": words})
    return replace(profile, registers=registers, window=window)


def open_controller(
    wire: VirtualWire, stand_file: StandFile, profile: Profile
) -> RingController | PollingController:
    """Return the driver of a real controller over a wire in memory: with a ring or polled, by its profile.

    Parameters
    ----------
    wire : VirtualWire
        Its clock is what the driver is to be waited by: polls are made meanwhile.
    stand_file : StandFile
        For channels and timeout.
    profile : Profile
        The wire's register map.
    """
    settings, clock = stand_file.controller, wire.clock
    link = ModbusLink(wire, timeout_s=settings.timeout_s, read_write=profile.read_write)
    channels, timeout_s = settings.channel, settings.timeout_s
    if profile.window is None:
        return PollingController(link, profile, channels, clock, timeout_s=timeout_s, bus=clock.bus)
    return RingController(link, profile, channels, clock, timeout_s=timeout_s)
