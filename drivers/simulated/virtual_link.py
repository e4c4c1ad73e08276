"""The registers of a simulated controller behind a wire with a round trip, in virtual time.

The drivers of real controllers talk to it as over a network; each request takes its time on the way, during
which the stand goes on. What a round trip costs can so be told to the sample, without the computer's own
speed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Literal

from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.modbus_link import Check, ModbusLink, ModbusRefusal, Table
from bufferstand.drivers.modbus_wires import TcpWire
from bufferstand.drivers.packed_exchange import Exchange, PackedReply
from bufferstand.drivers.profile import Profile
from bufferstand.drivers.registers import pack
from bufferstand.drivers.ring_controller import RingController
from bufferstand.drivers.simulated.device import SimulatedDevice
from bufferstand.drivers.simulated.inprocess import InProcessStand
from bufferstand.drivers.simulated.modbus_pdu import (
    EXCHANGE,
    READ_HOLDING,
    READ_INPUT,
    WRITE_ONE,
    WRITE_SEVERAL,
    Responder,
)
from bufferstand.drivers.simulated.register_bank import RegisterBank
from bufferstand.drivers.simulated.virtual_clock import VirtualClock
from bufferstand.drivers.stand_file import StandFile

Lost = Literal["", "request", "reply"]
"""What of a round trip gets lost."""


class VirtualLink(ModbusLink):
    """A link of :mod:`bufferstand.drivers.modbus_link` without a wire.

    Parameters
    ----------
    device : SimulatedDevice
        Who answers; moved by ``clock``.
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
        super().__init__(TcpWire("virtual", 0), read_write=profile.read_write)
        self._clock = clock
        self._round_trip_s = round_trip_s
        self._lost = lost
        self._sent_s = 0.0
        bank = RegisterBank(device, profile, clock.now_s)
        self._responder = Responder(bank, lambda _: None, lambda: False, read_write=profile.read_write)

    def read(
        self, address: int, count: int, what: str, *, table: Table = "holding", check: Check = lambda _: ""
    ) -> list[int]:
        """Get registers; see :meth:`ModbusLink.read`."""
        function = READ_HOLDING if table == "holding" else READ_INPUT
        reply = self._answer(struct.pack(">BHH", function, address, count), what)
        registers = list(struct.unpack(f">{count}H", reply[2:]))
        if doubt := check(registers):
            raise self._fault(f"{what}: {doubt}", "a wire without faults")
        return registers

    def write(self, address: int, values: Sequence[int], what: str, *, hurry: bool = False) -> None:
        """Set registers; see :meth:`ModbusLink.write`."""
        if len(values) == 1:
            self._answer(struct.pack(">BHH", WRITE_ONE, address, values[0]), what, hurry=hurry)
            return
        head = struct.pack(">BHHB", WRITE_SEVERAL, address, len(values), 2 * len(values))
        self._answer(head + pack(values), what, hurry=hurry)

    def exchange_packed(self, exchange: Exchange) -> bytes:
        """Write, then read; see :meth:`ModbusLink.exchange_packed`."""
        self._await_ahead()
        kept, self._kept = self._kept, None
        if kept is not None and kept[0] == exchange:
            return kept[1].data[1:]
        values = struct.unpack(f">{len(exchange.written) // 2}H", exchange.written)
        return pack(
            self.exchange(
                read_address=exchange.read_address,
                read_count=exchange.read_count,
                write_address=exchange.write_address,
                values=values,
                what=exchange.what,
            )
        )

    def ask_ahead(self, exchange: Exchange) -> None:
        """Send what will be asked for next; see :meth:`ModbusLink.ask_ahead`."""
        if self.can_ask_ahead and not self.has_asked_ahead:
            self._ahead, self._sent_s = exchange, self._clock.now_s()

    def _await_ahead(self) -> None:
        """Let the reply to what was sent ahead come; its way began when it was sent."""
        ahead, self._ahead = self._ahead, None
        if ahead is None:
            return
        values = struct.unpack(f">{len(ahead.written) // 2}H", ahead.written)
        request = _exchange_request(ahead.read_address, ahead.read_count, ahead.write_address, values)
        reply = self._way(request, self._sent_s)
        self._kept = (ahead, PackedReply(reply[0], reply[1:]))

    def _exchange_at_once(
        self,
        read_address: int,
        read_count: int,
        write_address: int,
        values: Sequence[int],
        what: str,
        check: Check,
    ) -> list[int]:
        reply = self._answer(_exchange_request(read_address, read_count, write_address, values), what)
        registers = list(struct.unpack(f">{read_count}H", reply[2:]))
        if doubt := check(registers):
            raise self._fault(f"{what}: {doubt}", "a wire without faults")
        return registers

    def _answer(self, request: bytes, what: str, *, hurry: bool = False) -> bytes:
        """Return the reply to a request, which is sent twice at most as on a real wire; once in a hurry."""
        self._await_ahead()
        once = hurry or self.is_lost
        for _ in range(1 if once else 2):
            lost, sent_s = self._lost(request), self._clock.now_s()
            reply = None if lost == "request" else self._way(request, sent_s)
            if lost or reply is None:
                waited_s = self._patience_s(hurry=hurry)
                self._clock.sleep(max(sent_s + waited_s - self._clock.now_s(), 0.0))
                continue
            self._tries_lost = 0
            self._took.append(self._clock.now_s() - sent_s)
            if reply[0] & 0x80:
                raise ModbusRefusal(f"{what}: refused with Modbus exception {reply[1]}", reply[1])
            return reply
        self._tries_lost += not hurry or self.is_lost
        raise self._fault(f"{what}: no reply", "a wire in virtual time that has lost it")

    def _way(self, request: bytes, sent_s: float) -> bytes:
        """Return the reply to what was sent at a time [s]; half a round trip later it is answered."""
        clock, trip_s = self._clock, self._round_trip_s()
        clock.sleep(max(sent_s + 0.5 * trip_s - clock.now_s(), 0.0))
        reply = self._responder.answer(request) or b""
        clock.sleep(max(sent_s + trip_s - clock.now_s(), 0.0))
        return reply


def _exchange_request(read_address: int, read_count: int, write_address: int, values: Sequence[int]) -> bytes:
    """Return a request of function 23."""
    size = 2 * len(values)
    head = struct.pack(">BHHHHB", EXCHANGE, read_address, read_count, write_address, len(values), size)
    return head + pack(values)


def behind_a_wire(
    opened: InProcessStand,
    stand_file: StandFile,
    round_trip_s: Callable[[], float],
    profile: Profile | None = None,
    lost: Callable[[bytes], Lost] = lambda _: "",
) -> Stand:
    """Return a stand in virtual time whose controller is reached by its driver, over a wire that takes time.

    Parameters
    ----------
    opened : InProcessStand
        The stand; its sensors stay as they are.
    stand_file : StandFile
        For channels, timeout and register profile.
    round_trip_s : callable
        Duration of the next round trip [s].
    profile : Profile, optional
        Another register profile than the stand file's.
    lost : callable, optional
        Which requests or replies get lost; as for :class:`VirtualLink`.
    """
    chosen, settings = profile or stand_file.profile(), stand_file.controller
    link = VirtualLink(opened.device, chosen, opened.clock, round_trip_s, lost)
    controller = RingController(link, chosen, settings.channel, opened.clock, timeout_s=settings.timeout_s)
    return Stand(controller, opened.stand.sensors)
