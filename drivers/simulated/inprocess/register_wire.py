"""The registers of a simulated controller behind a wire with a round trip, in virtual time.

The drivers of real controllers talk to it as over a network; each request takes its time on the way, during
which the stand goes on. What a round trip costs can so be told to the sample, without the computer's own
speed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Literal

from pymodbus.client import ModbusTcpClient

from bufferstand.drivers.controllers import RingController
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.modbus import ModbusLink, TcpWire, with_quick_replies
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import SimulatedDevice
from bufferstand.drivers.simulated.wires import RegisterBank, Responder
from bufferstand.drivers.stand_file import StandFile

Lost = Literal["", "request", "reply"]
"""What of a round trip gets lost."""
_PREFIX = 7
"""Bytes of a frame before function code and data."""


class VirtualWire(TcpWire):
    """A network without sockets: what a client sends is answered in memory, after its time on the way.

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
        super().__init__("virtual", 0)
        bank = RegisterBank(device, profile, clock.now_s)
        self.responder = Responder(bank, lambda _: None, lambda: False, read_write=profile.read_write)
        self.clock, self.round_trip_s, self.lost = clock, round_trip_s, lost
        self.now_s = clock.now_s

    def open(self, timeout_s: float) -> ModbusTcpClient:
        """Return a client whose connection is this wire."""
        return with_quick_replies(_VirtualClient(self, timeout_s))


class _VirtualClient(ModbusTcpClient):
    """A client of pymodbus whose bytes go no further than a responder in this process."""

    def __init__(self, wire: VirtualWire, timeout_s: float) -> None:
        super().__init__("virtual", timeout=timeout_s, retries=0)
        self._wire, self._open = wire, True
        self._sent: tuple[bytes, float, Lost] = b"", 0.0, ""

    @property
    def connected(self) -> bool:
        """Whether it was not closed."""
        return self._open

    def connect(self) -> bool:
        """Return whether it was not closed."""
        return self._open

    def close(self) -> None:
        """Let go of the wire."""
        self._open = False

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:  # noqa: ARG002
        """Put a frame on its way."""
        self._sent = request, self._wire.clock.now_s(), self._wire.lost(request[_PREFIX:])
        return len(request)

    def recv(self, size: int | None) -> bytes:  # noqa: ARG002
        """Return the reply to what was sent, half a round trip after that arrived; empty if none comes."""
        wire, clock = self._wire, self._wire.clock
        (request, sent_s, lost), self._sent = self._sent, (b"", 0.0, "reply")
        reply = None
        if lost != "request" and request:
            trip_s = wire.round_trip_s()
            clock.sleep(sent_s + 0.5 * trip_s - clock.now_s())
            reply = wire.responder.answer(request[_PREFIX:])
            clock.sleep(sent_s + trip_s - clock.now_s())
        if lost or reply is None:
            clock.sleep(sent_s + self.comm_params.timeout_connect - clock.now_s())
            return b""
        return request[:4] + struct.pack(">H", len(reply) + 1) + request[6:_PREFIX] + reply


def virtual_link(
    device: SimulatedDevice,
    profile: Profile,
    clock: VirtualClock,
    round_trip_s: Callable[[], float],
    lost: Callable[[bytes], Lost] = lambda _: "",
) -> ModbusLink:
    """Return the link of a real controller's driver over a :class:`VirtualWire`; parameters are its own."""
    return ModbusLink(VirtualWire(device, profile, clock, round_trip_s, lost), read_write=profile.read_write)


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
        Which requests or replies get lost; as for :class:`VirtualWire`.
    """
    chosen, settings = profile or stand_file.profile(), stand_file.controller
    link = virtual_link(opened.device, chosen, opened.clock, round_trip_s, lost)
    controller = RingController(link, chosen, settings.channel, opened.clock, timeout_s=settings.timeout_s)
    return Stand(controller, opened.stand.sensors)
