"""The acquisition: one loop in one thread owns the controller, sees every sample and feeds the watchdog.

Sensors read in threads of their own; here they are only drained, so that no slow bus can stall a pass.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from bufferstand.daq.acquisition.blocks import join_blocks
from bufferstand.daq.acquisition.continuity import Continuity
from bufferstand.daq.acquisition.device_time import DeviceTime
from bufferstand.daq.acquisition.own_clocks import OwnClocks
from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.acquisition.run_log import BlockRecorder, RunLog
from bufferstand.daq.guards import CONTROLLER_STREAM, Action, Computer, GuardPanel, Trip
from bufferstand.daq.guards.kinds import PAUSE_S
from bufferstand.daq.scaling import ScaledBlock, scale, zeroed
from bufferstand.drivers import NO_REPLY, ControllerStatus, SampleBlock, SensorFault, Stand, StreamFacts
from bufferstand.drivers.delivery_rate import STATUS_LONGEST_S, status_rest_s
from bufferstand.foundation import Clock, steady_s
from bufferstand.foundation.channels import Branch, Zero

LONG_LOOK_S = 0.0005
"""After a look at the status that took longer, samples are read before anything else [s of the wall]."""
CATCH_UP_S = 0.2
"""So long at most is read between two requests of a command [s of the wall]."""
_WRAP, _HALF = 1 << 32, 1 << 31


@dataclass(frozen=True)
class Latest:
    """The newest values of everything, for progress and for waiting.

    Parameters
    ----------
    at_s : float
        Host stand time of the pass [s].
    device_s : float or None
        Newest time stamp of the controller [s of its clock].
    values : mapping of str to float
        Newest value of every channel and derived signal, in the unit of its name.
    status : ControllerStatus or None
        The last snapshot.
    samples, lost : int
        Samples of the controller seen and lost since the start.
    """

    at_s: float
    device_s: float | None
    values: Mapping[str, float]
    status: ControllerStatus | None
    samples: int
    lost: int


class Acquisition:
    """Reads everything a stand delivers, pass by pass, hands it to guards and recorder.

    Parameters
    ----------
    stand : Stand
        The opened stand; nobody else may talk to its controller meanwhile.
    clock : Clock
        Stand time.
    panel : GuardPanel
        Sees every block, fault, status and silence.
    pace : Pace
        How often.
    utc : callable
        Gives the civil time of an anchor (ISO 8601).
    civil_s : callable
        The civil time [s], to say when it was set.
    waited_for : bool
        Whether the stand waits for its reader (a simulated one): then samples are never late, only slow.
    """

    def __init__(
        self,
        stand: Stand,
        clock: Clock,
        panel: GuardPanel,
        *,
        pace: LoopPace | None = None,
        utc: Callable[[], str] = lambda: datetime.now(UTC).isoformat(),
        civil_s: Callable[[], float] = time.time,
        waited_for: bool = False,
    ) -> None:
        self.stand = stand
        self.clock = clock
        self.panel = panel
        self.pace = (pace or LoopPace()).suited_to(stand.controller.facts)
        self._utc = utc
        self._facts = {stand.controller.facts.name: stand.controller.facts} | {
            sensor.facts.name: sensor.facts for sensor in stand.sensors
        }
        self._branches = {
            channel.name: Branch() for facts in self._facts.values() for channel in facts.channels
        }
        self.log = RunLog(clock)
        """Where events go."""
        self.clocks = OwnClocks(stand.sensors, self.log, stand.controller.facts)
        """Of devices that have one of their own beside the controller."""
        self.continuity = Continuity(self, stand.controller, clock, panel)
        """Knows of pauses, outages, and who has the stand."""
        self._civil_s = civil_s
        self._waited_for = waited_for
        panel.read_clocks(civil_s(), steady_s(), clock.now_s())
        self._guarded = False
        self._values: dict[str, float] = {}
        self._status: ControllerStatus | None = None
        self._device_us: int | None = None
        self._samples = self._lost = 0
        self.zero: Zero | None = None
        """The zero that channels count from (:meth:`take_zero`)."""
        self._up_to_date = False
        self._age_s: float | None = None
        self._device_us_at_look = 0
        self._status_at_s = self._told_at_s = -np.inf
        self._status_read_s, self._status_took_s = clock.wall_s(), 0.0
        self._began = (clock.now_s(), clock.wall_s())
        self.feeding = True
        """Whether a pass feeds the controller's watchdog."""
        self._fed_s = -np.inf
        self._device_time = DeviceTime(clock.now_s())
        self._overwritten = 0
        self._looked_long = False
        self._anchor: tuple[int, float] | None = None
        self._anchor_due_s = -np.inf
        self._pass_began_s = clock.now_s()
        self.listeners: list[Callable[[ScaledBlock], object]] = []
        """Get every block of the controller, scaled; they must be quick."""
        self.observers: list[Callable[[ScaledBlock], object]] = []
        """Get every block of every stream, scaled, after it was judged; they must be quick."""

    @property
    def latest(self) -> Latest:
        """Return the newest values."""
        return Latest(
            self.clock.now_s(),
            self._device_time.now_s,
            dict(self._values),
            self._status,
            self._samples,
            self._lost,
        )

    @property
    def waited_for(self) -> bool:
        """Return whether the stand waits for its reader: it stands still while this program does."""
        return self._waited_for

    @property
    def last_sample(self) -> tuple[int | None, float]:
        """Return the newest stamp of the controller [µs], and how much stand time has passed since [s]."""
        return self._device_us, self.clock.now_s() - self._device_time.at_s

    def take_zero(self, zero: Zero | None) -> None:
        """Scale what comes from now on from this zero; from the calibrations alone with None."""
        self.zero = zero
        own = (self.stand.controller.facts, *(sensor.facts for sensor in self.stand.sensors))
        self._facts = {facts.name: zeroed(facts, zero) for facts in own}
        self.panel.rebase(counted=zero is not None)

    @property
    def facts(self) -> Mapping[str, StreamFacts]:
        """Return what every stream is made of, by its name, with the zero in force."""
        return self._facts

    def attach(self, recorder: BlockRecorder) -> None:
        """Record from now on, beginning with a clock anchor."""
        self.panel.begin_run()
        self._anchor, self._anchor_due_s = None, -np.inf
        self.log.attach(recorder)
        self.clocks.begin_run()

    def detach(self) -> BlockRecorder | None:
        """Record no longer, once the last readings of the clocks are in the run; return its recorder."""
        self.clocks.record(self.clock.now_s(), last=True)
        return self.log.detach()

    @property
    def status(self) -> ControllerStatus | None:
        """Return the last snapshot."""
        return self._status

    @property
    def was_told(self) -> bool:
        """Return whether the controller was told something since the last look at its status."""
        return self._status_at_s == -np.inf

    @property
    def fed_s(self) -> float:
        """Return when the controller's watchdog was fed last [s of the wall]."""
        return self._fed_s

    def fall_behind(self) -> None:
        """Hold that samples are unread."""
        self._up_to_date = False

    @property
    def up_to_date(self) -> bool:
        """Return whether the last pass read all that the device had sampled by then."""
        return self._up_to_date

    @property
    def is_behind(self) -> bool:
        """Return whether samples wait for this reader; at a stand that waits for it none do."""
        return not (self._up_to_date or self._waited_for)

    @property
    def age_s(self) -> float | None:
        """Return how old the newest sample was at the last look at the status [s of device time].

        By the device's own clock; None where it shows none, or nothing was sampled yet.
        """
        return self._age_s

    @property
    def device_now_us(self) -> int | None:
        """Return what the device's clock showed at the last look, as the samples are stamped [µs]."""
        if self._device_us is None or self._age_s is None:
            return None
        return self._device_us_at_look + round(self._age_s * 1e6)

    def has_read_to(self, device_us: int | None) -> bool:
        """Return whether nothing sampled before an instant of the device's clock [µs] is unread.

        Without that instant, or where the device had no more to give, being up to date counts.
        """
        reached = device_us is not None and self._device_us is not None and self._device_us >= device_us
        return self._up_to_date or reached

    def renew_status(self) -> None:
        """Read the status in the next pass in any case: the controller was told something new."""
        self._status_at_s = -np.inf

    def samples_first(self) -> None:
        """Let samples go before all else in the next passes: what waited behind a command is read first."""
        self._looked_long = True
        self._told_at_s = self.clock.wall_s()

    def tick(self) -> list[Trip]:
        """Make one pass: feed, read, drain, record, judge.

        Returns
        -------
        list of Trip
            What guards said in this pass; the latch is in ``panel``.

        Notes
        -----
        A fault of the controller or its wire does not come out as an exception: it is latched as a trip
        of the guard ``controller``, like every other reason to stop.
        """
        self._pass_began_s = self.clock.now_s()
        with self.continuity.answered_for():
            self.continuity.see_pause(PAUSE_S)
            self.continuity.come_back()
            if not self.continuity.is_cut_off:
                self._ask_controller()
        self._drain_sensors()
        if (recorder := self.log.recorder) is not None:
            self.panel.look_at_recorder(recorder, self.clock.now_s())
        with self.continuity.answered_for():
            self.continuity.see_pause(PAUSE_S, look=False)  # before silences are judged
        self.panel.listen(self.clock.now_s(), self.clock.wall_s(), self._computer())
        said = self.panel.said()
        for trip in said:
            self.log.say("note" if trip.action is Action.NOTE else "trip", trip.reason, **trip.facts())
        return said

    def begin_anew(self) -> None:
        """Go on as at a start, once the stand is taken again: nothing that was read before is believed.

        The time of the device goes on by the stand's own, so that what is waited for is not cut short.
        """
        wall_s, now_s = self.clock.wall_s(), self.clock.now_s()
        self.panel.begin_anew(wall_s)
        self.continuity.begin_anew()
        self._fed_s = -np.inf
        for sensor in self.stand.sensors:
            sensor.drain()  # read before
        self._device_time.begin_anew()
        self._age_s, self._up_to_date = None, False
        self.panel.read_clocks(self._civil_s(), steady_s(), now_s)
        self.renew_status()

    def _ask_controller(self) -> None:
        """Feed, read what the controller sampled, and look at its status."""
        demanded, looked, self._looked_long = self.panel.action, self._looked_long, False
        if not looked:
            self._feed()
        self._read_controller()
        if self.panel.action <= demanded:  # a trip is obeyed at once: whoever stops asks for the status
            if looked:  # on a slow wire no two requests in a row go without samples
                self._feed()
            self._judge_status()

    def catch_up(self) -> None:
        """Read and judge until nothing is unread, a guard trips, or ``CATCH_UP_S`` are over.

        The watchdog is fed if that is due, and the status read if it has not been for long.

        For the time between two requests of a command: so no two of them go without samples, and what waits
        behind them is judged before the next. A stand that waits for its reader is read once.
        """
        end_s = self.clock.wall_s() + CATCH_UP_S
        if self.continuity.is_cut_off:
            return
        with self.continuity.answered_for():
            self.continuity.see_pause_in_call()
            undisturbed = self._read_until(end_s)
            for request in (self._feed, self._look_if_overdue):
                if undisturbed and request():
                    undisturbed = self._read_until(end_s)

    def _read_until(self, end_s: float) -> bool:
        """Read until nothing is unread, or a time of the wall is reached; return False once a guard trips."""
        demanded = self.panel.action
        while True:
            self._read_controller()
            if self.panel.action > demanded:
                return False
            if self._up_to_date or self._waited_for or self.clock.wall_s() >= end_s:
                return True

    def feed_first(self) -> None:
        """Feed the watchdog now, if this program feeds it."""
        wall_s = self.clock.wall_s()  # the watchdog counts real seconds, however fast a simulated stand runs
        if self.feeding and self.stand.controller.in_charge:
            self.stand.controller.feed_watchdog()
            self._fed_s = wall_s
            self.continuity.see_pause_in_call()

    def read_backlog(self, limit_s: float) -> bool:
        """Read and judge what waits in the ring, feeding meanwhile; return False if a guard has tripped."""
        stopping = self.panel.action >= Action.STOP  # the wire belongs to the safe stop
        end_s = self.clock.wall_s() + (CATCH_UP_S if stopping else limit_s)
        while self._read_until(min(end_s, self.clock.wall_s() + CATCH_UP_S)):
            if self._up_to_date or self._waited_for or self.clock.wall_s() >= end_s:
                return True
            self._feed()
        return False

    def look_anew(self) -> ControllerStatus:
        """Read the status, have it judged, and return it."""
        return self._read_status()

    @property
    def overwritten(self) -> int:
        """Return how many samples the device took and did not keep until they were read."""
        return self._overwritten

    @property
    def seen(self) -> int:
        """Return how many samples of the controller were read."""
        return self._samples

    def rest(self) -> None:
        """Wait until the next pass is due: passes begin every ``tick_s``, however long they take.

        A tenth of it is waited in any case, for the threads that read sensors and write the journal; a reader
        that is behind does not wait.
        """
        passed_s = self.clock.now_s() - self._pass_began_s
        tick_s = self.pace.tick_s
        self.clock.sleep(max(0.1 * tick_s, tick_s - passed_s) if self._up_to_date else 0.0)

    def _feed(self) -> bool:
        """Feed the watchdog if that is due and this program's right; return whether it was."""
        controller = self.stand.controller
        due = self.clock.wall_s() - self._fed_s >= self.pace.feed_s
        if self.feeding and controller.in_charge and due:
            self.feed_first()
            return True
        return False

    def _read_controller(self) -> None:
        """Read until the device has no more, a guard trips, or the time of a look is over.

        Once another program has the controller nothing is read: to take samples is to acknowledge them.
        """
        if self.continuity.hands_off and not self.continuity.has_it_back():
            self._up_to_date = True
            return
        wall_s, pace = self.clock.wall_s, self.pace
        demanded, end_s = self.panel.action, wall_s() + pace.look_s
        self._up_to_date = False
        blocks: list[SampleBlock] = []
        since_s = wall_s()
        try:
            while not self._up_to_date:
                block = self.stand.controller.read_block()
                self.continuity.see_pause_in_call()
                self.continuity.heard()
                self._up_to_date = block is None or not block.more
                if block is not None:
                    blocks.append(block)
                now_s = wall_s()
                if now_s >= since_s + pace.judge_s:
                    self._take_all(blocks)
                    since_s = wall_s()
                if now_s >= end_s or self.panel.action > demanded:
                    break
        finally:
            self._take_all(blocks)  # what was read before a fault is kept, too
        self._record_anchor()
        for text in self.stand.controller.events():
            self.continuity.was_silent |= NO_REPLY in text
            self.log.say("wire", text)

    def _take_all(self, blocks: list[SampleBlock]) -> None:
        """Record and judge what has come; the list is empty afterwards."""
        come = blocks.copy()
        blocks.clear()
        for joined in join_blocks(come):
            self._take(joined)

    def _judge_status(self) -> None:
        """Look at the controller's status, where it is due: the wire belongs to the samples first."""
        asked_s = self.clock.wall_s()
        calm = self._up_to_date or self._waited_for
        rest_s = status_rest_s(self._status_took_s, up_to_date=calm)
        since_s = self._status_at_s if calm else max(self._status_at_s, self._told_at_s)
        if asked_s >= since_s + rest_s:
            self._read_status()

    def _look_if_overdue(self) -> bool:
        """Read the status if it has not been for so long that guards miss it; return whether it was."""
        overdue = self.clock.wall_s() >= self._status_read_s + STATUS_LONGEST_S
        if overdue:
            self._read_status()
        return overdue

    def _read_status(self) -> ControllerStatus:
        asked_s, asked_at_s = self.clock.wall_s(), self.clock.now_s()
        status = self.stand.controller.status()
        now_s, wall_s = self.clock.now_s(), self.clock.wall_s()
        self.continuity.see_pause_in_call(look=False)
        self._status = status
        self._status_at_s = self._status_read_s = wall_s
        self._status_took_s = wall_s - asked_s
        self._looked_long = self._status_took_s > LONG_LOOK_S
        self._age_s = _age_s(self._status.tick_us, self._device_us)
        self._device_us_at_look = self._device_us or 0
        self.clocks.take_controller(self.device_now_us, asked_at_s, now_s)
        try:
            if self.panel.has_limited(status):  # it has stopped already: what led to it says why
                self._read_controller()
        finally:
            self.panel.judge(
                status,
                now_s,
                wall_s,
                sampled_kN=self._sampled_kN(),
                age_s=None if self._age_s is None else self._age_s / self._speed(now_s, wall_s),
                up_to_date=self._up_to_date or self._waited_for,
            )
        return status

    def _sampled_kN(self) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Return the newest sample of the force, no zero taken off; None where none is fresh."""
        fresh = (self._up_to_date or self._waited_for) and not self.continuity.hands_off
        sampled_kN = self._values.get("force") if fresh else None
        if sampled_kN is not None and self.zero is not None:
            sampled_kN += self.zero.value("force")
        return sampled_kN

    def _speed(self, now_s: float, wall_s: float) -> float:
        """Return how many seconds of stand time pass in one of the wall."""
        began_s, wall_began_s = self._began
        passed_s = wall_s - wall_began_s
        return max((now_s - began_s) / passed_s, 1.0) if passed_s > 0.0 else 1.0

    def _drain_sensors(self) -> None:
        self.clocks.take_all()
        for sensor in self.stand.sensors:
            for item in sensor.drain():
                if isinstance(item, SensorFault):
                    self.panel.complain(item)
                    self.log.complain(item)
                else:
                    self._take(item)
        self.clocks.record(self.clock.now_s())

    def _take(self, block: SampleBlock) -> None:
        """Record first, judge second: the sample that trips is in the run."""
        if (recorder := self.log.recorder) is not None:
            recorder.append(block.stream, block.first_sequence, block.time_us, block.counts, block.lost)
        scaled = scale(block, self._facts[block.stream], self._branches)
        if self.clocks.owns(block.stream):
            scaled = self.clocks.on_host(scaled)
        if block.stream == CONTROLLER_STREAM:
            for listener in self.listeners:
                listener(scaled)
            self._samples += len(scaled)
            self._lost += block.lost
            self._overwritten += block.lost - block.missed
            self._keep_anchor(scaled)
        if len(scaled):
            self._values.update((name, float(value[-1])) for name, value in scaled.values.items())
        self.panel.observe(scaled, self.clock.wall_s(), block, self._facts[block.stream])
        for observer in self.observers:
            observer(scaled)

    def _keep_anchor(self, block: ScaledBlock) -> None:
        """Keep the pair with the least delay on the wire."""
        if not len(block):
            return
        self._device_us = int(block.time_us[-1])
        self._device_time.take(self._device_us, block.received_s)
        pair = (self._device_us, block.received_s)
        if self._anchor is None or _delay_s(pair) < _delay_s(self._anchor):
            self._anchor = pair

    def _record_anchor(self) -> None:
        """Record the best pair of the interval that ends."""
        now_s = self.clock.now_s()
        recorder = self.log.recorder
        if recorder is not None and self._anchor is not None and now_s >= self._anchor_due_s:
            recorder.anchor(*self._anchor, self._utc())
            self._anchor, self._anchor_due_s = None, now_s + self.pace.anchor_s

    def _computer(self) -> Computer:
        """Return this computer's clocks; a late pass counts from the first one after switching on.

        One in which the controller gave no reply is late for that, and it is said already.
        """
        guarded = self.feeding and self._guarded and not self.continuity.was_silent
        self._guarded, self.continuity.was_silent = self.feeding, False
        return Computer(self._civil_s(), steady_s(), guarded)


def _age_s(tick_us: int | None, stamp_us: int | None) -> float | None:
    """Return how much later a clock of 32 bits reads [µs] than a stamp of it without wraps [s]."""
    if tick_us is None or stamp_us is None:
        return None
    return ((tick_us - stamp_us + _HALF) % _WRAP - _HALF) * 1e-6


def _delay_s(pair: tuple[int, float]) -> float:
    """Return host minus device time of a pair [s]: smaller by less delay."""
    return pair[1] - pair[0] / 1e6
