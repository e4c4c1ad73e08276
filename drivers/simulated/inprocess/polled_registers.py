"""A polled controller behind a wire with a round trip, in virtual time: its bus has no thread of its own.

While somebody waits, polls are made when they are due; what is asked of the bus is done in between, as the
thread of :mod:`bufferstand.drivers.controllers.bus_thread` does it. A wait ends late where a poll is still
under way: a thread would have let the next request wait for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bufferstand.drivers.controllers import PollingController
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.simulated.inprocess.register_wire import Lost, virtual_link
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import Clock

_Result = TypeVar("_Result")
_SOON_S = 1e-9


class PolledClock:
    """A virtual clock by which the acquisition waits, while polls go on.

    Parameters
    ----------
    clock : VirtualClock
        That moves the stand, and by which the wire takes its time.
    """

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._bus: VirtualBus | None = None

    def bus(self, poll: Callable[[int], None], period_s: float, _: Clock) -> VirtualBus:
        """Return the bus that polls while this clock is waited for."""
        self._bus = VirtualBus(poll, period_s, self._clock)
        return self._bus

    def now_s(self) -> float:
        """Get the present stand time [s]."""
        return self._clock.now_s()

    def wall_s(self) -> float:
        """Get the present stand time [s]: here it is the wall's."""
        return self._clock.wall_s()

    def sleep(self, duration_s: float) -> None:
        """Let ``duration_s`` of stand time pass; longer, if a poll is under way at its end."""
        end_s = self._clock.now_s() + max(0.0, duration_s)
        while (now_s := self._clock.now_s()) < end_s:
            due_s = end_s if self._bus is None else self._bus.due_s
            self._clock.sleep(min(end_s, max(due_s, now_s + _SOON_S)) - now_s)
            if self._bus is not None:
                self._bus.poll_if_due()


class VirtualBus:
    """Polls and jobs of one bus, all by whoever waits.

    Parameters
    ----------
    poll : callable
        Makes one poll for a slot, by its number.
    period_s : float
        Time between two slots [s].
    clock : VirtualClock
    """

    def __init__(self, poll: Callable[[int], None], period_s: float, clock: VirtualClock) -> None:
        self._poll, self._period_s, self._clock = poll, period_s, clock
        self._origin_s: float | None = None
        self._slot = 0

    @property
    def due_s(self) -> float:
        """When the next poll is due [s of stand time]."""
        return float("inf") if self._origin_s is None else self._origin_s + self._slot * self._period_s

    def call(self, job: Callable[[], _Result]) -> _Result:
        """Do a job, and the poll that has become due meanwhile."""
        result = job()
        self.poll_if_due()
        return result

    def begin(self) -> None:
        """Poll from now on: slot 0 is due at once."""
        if self._origin_s is None:
            self._origin_s = self._clock.now_s()

    def poll_if_due(self) -> None:
        """Make the newest poll that is due; those before it that nobody had time for are left out."""
        if self._origin_s is None:
            return
        due = int((self._clock.now_s() - self._origin_s) / self._period_s + _SOON_S)
        if due >= self._slot:
            self._slot = due + 1
            self._poll(due)

    def close(self) -> None:
        """Poll no longer."""
        self._origin_s = None


def polled_behind_a_wire(
    opened: InProcessStand,
    stand_file: StandFile,
    round_trip_s: Callable[[], float],
    profile: Profile,
    lost: Callable[[bytes], Lost] = lambda _: "",
) -> tuple[Stand, PolledClock]:
    """Return a stand whose controller is polled over a wire that takes time, and the clock to wait by.

    Parameters
    ----------
    opened : InProcessStand
        The stand; its sensors stay as they are.
    stand_file : StandFile
        For channels and timeout.
    round_trip_s : callable
        Duration of the next round trip [s].
    profile : Profile
        A register profile with a table ``[poll]``.
    lost : callable, optional
        Which requests or replies get lost; as for
        :class:`bufferstand.drivers.simulated.inprocess.register_wire.VirtualWire`.
    """
    clock, settings = PolledClock(opened.clock), stand_file.controller
    link = virtual_link(opened.device, profile, opened.clock, round_trip_s, lost)
    controller = PollingController(
        link, profile, settings.channel, clock, timeout_s=settings.timeout_s, bus=clock.bus
    )
    return Stand(controller, opened.stand.sensors), clock
