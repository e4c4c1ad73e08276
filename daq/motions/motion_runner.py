"""Driving one motion: start it, keep acquisition going until it has ended, and obey guards and operator."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import TypeVar

from bufferstand.daq.acquisition import Acquisition, catch_up
from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.motions.force_cycles import cycle_between_forces
from bufferstand.daq.motions.force_rows import ForceRow
from bufferstand.daq.motions.release_bound import ReleaseBound, contact_of
from bufferstand.daq.motions.steadiness import SteadinessWatch
from bufferstand.daq.operator import Part, StopLevel, StopRequest
from bufferstand.daq.strokes import StrokeCommands
from bufferstand.drivers import ControllerStatus, EndReason
from bufferstand.foundation import (
    Commandable,
    CommandRejected,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
    WireLost,
    counted,
)
from bufferstand.protocols.steps import (
    ForceCycles,
    Hold,
    Motion,
    PlannedStep,
    RampToForce,
    Steadiness,
    TouchOff,
    WaitUntilCool,
)

GOOD_ENDS = (EndReason.REACHED, EndReason.FORCE_LIMIT)
"""How a motion ends that did what it should; static cycles turn at a force."""

READER_S = 10.0
"""So long at most a motion waits for a reader that is behind [s of the wall]; a guard stops one for that."""
ResultT = TypeVar("ResultT")


class Halt(Exception):  # noqa: N818 - it names the fact
    """The campaign must stop: the trip that demands it."""

    def __init__(self, trip: Trip) -> None:
        super().__init__(trip.reason)
        self.trip = trip


@dataclass(frozen=True)
class MotionTimeLimit:
    """How long a motion may take: ``factor`` × what the plan expects + ``margin_s`` [s of device time]."""

    factor: float = 1.5
    margin_s: float = 10.0

    def limit_s(self, expected_s: float) -> float:
        """Return the longest time for a motion that should take ``expected_s``."""
        return self.factor * expected_s + self.margin_s


class MotionRunner:
    """Performs motions one after the other on an acquisition.

    Parameters
    ----------
    acquisition : Acquisition
        Owns the controller and the guards' panel.
    request : StopRequest
        The operator's wish.
    tick : callable
        One pass of the acquisition with everything that is shown of it.
    patience : Patience
        How long a motion may take.
    release_speed_mm_per_s : float, optional
        Where no stop goes in one request, a release at this speed is ready in the controller while a motion
        runs, for the safe stop.
    """

    def __init__(
        self,
        acquisition: Acquisition,
        request: StopRequest,
        tick: Callable[[], object],
        patience: MotionTimeLimit | None = None,
        *,
        release_speed_mm_per_s: float | None = None,
    ) -> None:
        self._release_speed_mm_per_s = release_speed_mm_per_s
        self._acquisition = acquisition
        self._request = request
        self._tick = tick
        self._patience = patience or MotionTimeLimit()
        self.commanding = StrokeCommands(acquisition.stand.controller)
        """Turns what the specimen is to do into the controller's commands."""
        self._cyclic: Harmonic | StaticCycles | None = None
        self._cyclic_since_s = 0.0
        self._by_turns = False
        self._last_cycle: int | None = None
        self._cycles_before = 0
        self._waits_since_s = 0.0
        self.cycles_done = 0
        """Full cycles of all cyclic motions of the step so far."""
        self.force_rows: list[ForceRow] = []
        """What the step's motions between two forces asked for and reached."""
        self.command_s = 0.0
        """How long the controller took to take the last motion: some round trips of the wire, without the
        samples that were read in between [s]."""
        self._between_s = 0.0
        self.stopping_s = 0.0
        """So long a hold of the motion that was started last may take to slow it down [s]: a sine's speed
        2π f A goes at its own greatest acceleration (2π f)² A in 1 / (2π f); other motions stop at once."""

    def begin_step(
        self,
        step: PlannedStep | None = None,
        motions: Sequence[Motion] = (),
        specimen_C: float | None = None,
    ) -> None:
        """Forget the cycles of the step before; take the motions (left) of this one, and how warm it is."""
        self.cycles_done = self._cycles_before = 0
        self.force_rows = []
        if step is not None:
            self.commanding.begin_step(step, motions, specimen_C)

    @property
    def part(self) -> Part:
        """Whether the sine under way is still growing, or fading already."""
        sine = self._cyclic
        if not isinstance(sine, Harmonic):
            return ""
        done = self.cycles_done - self._cycles_before
        if done >= sine.cycles:
            return "run-out"
        grows = done == 0 and self._device_s() - self._cyclic_since_s < 1.0 / sine.frequency_Hz
        return "lead-in" if grows else ""

    def pump(self) -> None:
        """Make one pass, wait for the next, and see whether to stop.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        self._tick()
        status = self._acquisition.latest.status
        if self._cyclic is not None and status is not None:
            # A controller that counts its way in and out as cycles is not believed beyond what was wanted.
            self.cycles_done = self._cycles_before + min(status.cycles_done, self._cyclic.cycles)
            # A stop has the wire to itself; in an outage nothing goes over it.
            if self._acquisition.panel.action < Action.STOP and not self._acquisition.continuity.is_cut_off:
                with self._looking_between():  # it may change a running sine
                    self.commanding.look(status.cycles_done)
        self.obey()
        self._acquisition.rest()

    def obey(self) -> None:
        """See whether to stop, after the cycle under way if that is enough.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        panel = self._acquisition.panel
        self._hear_operator()
        if panel.trip is None:
            return
        if panel.action is Action.STOP_AFTER_CYCLE and (self._cyclic is not None or self._by_turns):
            if self._last_cycle is None:
                self._last_cycle = self.cycles_done
            if self.cycles_done == self._last_cycle:
                return
        raise Halt(panel.trip)

    def perform(
        self,
        motion: Motion,
        expected_s: float,
        steady: Steadiness | None = None,
        enough: Callable[[], bool] | None = None,
    ) -> None:
        """Perform one motion to its end.

        Parameters
        ----------
        motion : Motion
            What to do.
        expected_s : float
            How long the plan expects it to take [s].
        steady : Steadiness, optional
            A harmonic motion ends when its cycles have settled by this.
        enough : callable, optional
            A cyclic motion ends with the cycle in which this says so.

        Raises
        ------
        Halt
            If a guard or the operator stops it, it ends otherwise than it should, or takes too long.
        DeviceFault
            If it cannot be started.
        """
        if isinstance(motion, Hold):
            self.wait(motion.wait_s)
            return
        if isinstance(motion, WaitUntilCool):
            self.cool(motion.temperature_C, motion.timeout_s)
            return
        if isinstance(motion, TouchOff):
            raise TypeError("a touch is made by daq.zero.zeroing, of motions of this driver")
        if isinstance(motion, RampToForce):
            self._ramp_to_force(motion, expected_s)
            return
        if isinstance(motion, ForceCycles):
            cycle_between_forces(motion, self, self._acquisition, self._patience.limit_s(expected_s))
            return
        if why := self.commanding.before_own_zero(motion):
            self.give_up("zero", why)
        self._last_cycle = None
        self._cycles_before = self.cycles_done
        limit_s = self._patience.limit_s(expected_s)
        status = self._acquisition.latest.status
        if way := self.commanding.approach(motion, None if status is None else status.command_mm):
            self._until_done(way, self._start(way), limit_s)
        self.commanding.begin_motion(motion, self._acquisition.listeners)
        try:
            sequence = self._start(motion)
            self._cyclic = motion if isinstance(motion, Harmonic | StaticCycles) else None
            self._cyclic_since_s = self._device_s()
            if steady is not None and isinstance(motion, Harmonic):
                self._until_settled(motion, sequence, limit_s, steady)
            elif enough is not None and self._cyclic is not None:
                self._until_enough(motion, sequence, limit_s, enough)
            else:
                self._until_done(motion, sequence, limit_s)
            if isinstance(motion, Harmonic | StaticCycles):
                self._judge_to_the_end()
        finally:
            self._cyclic = None
            self.commanding.end_motion(self._acquisition.listeners)

    def _judge_to_the_end(self) -> None:
        """Read and judge what a cyclic motion did until its end: the reader can be behind the stand.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """

        def passes() -> None:
            self._tick()
            self.commanding.judge_rest()

        panel = self._acquisition.panel
        catch_up(self._acquisition, passes, lambda: panel.trip is not None)
        while self.commanding.judge_rest() and panel.trip is None:
            self._tick()
        self.obey()

    def _until_settled(self, motion: Harmonic, sequence: int, limit_s: float, steady: Steadiness) -> None:
        """Let a harmonic motion go on until its cycles have settled, or to its own end."""
        acquisition, watch = self._acquisition, SteadinessWatch(steady, motion)
        began_s = self._device_s()
        acquisition.listeners.append(watch.take)
        try:
            while not self._ended(motion, sequence):
                self.pump()
                if watch.settled(self.cycles_done - self._cycles_before):
                    done = self.cycles_done - self._cycles_before
                    acquisition.log.say(
                        "step",
                        f"settled after {counted(done, 'cycle')}: damping "
                        f"{watch.damping[-1]:.4f}, stiffness {watch.stiffness[-1]:.4f} kN/mm",
                    )
                    self._cyclic = None  # the hold counts no cycles, and would begin at none
                    self._until_done(motion, self._hold(), limit_s)
                    return
                if self._device_s() - began_s > limit_s:
                    self._refuse("controller", f"the {motion.name} has not ended after {limit_s:.0f} s")
            most = counted(motion.cycles, "cycle")
            acquisition.log.say("step", f"not settled after {most}, the most that were planned")
            self.obey()
        finally:
            acquisition.listeners.remove(watch.take)
            watch.close()

    def _until_enough(
        self, motion: Motion, sequence: int, limit_s: float, enough: Callable[[], bool]
    ) -> None:
        """Let a cyclic motion go on to the end of the cycle in which it is enough, or to its own end."""
        last: int | None = None
        while not self._ended(motion, sequence):
            self.pump()
            if last is None and enough():
                last = self.cycles_done
            if last is not None and self.cycles_done > last:
                self._cyclic = None  # the hold counts no cycles, and would begin at none
                self._until_done(motion, self._hold(), limit_s)
                return
        self.obey()

    def begin_waiting(self) -> None:
        """Count the time of :meth:`demand_in_time` from now on."""
        self._waits_since_s = self._device_s()

    def demand_in_time(self, timeout_s: float, guard: str, why: str) -> None:
        """Give up once more than ``timeout_s`` have passed, or if nothing moves and the operator asks.

        Raises
        ------
        Halt
            Then.
        """
        if self._request.level is StopLevel.AFTER_STEP and self._cyclic is None:
            self.give_up("operator", f"stopped by the operator: {self._request.reason}")
        if self._device_s() - self._waits_since_s > timeout_s:
            self.give_up(guard, f"not done after {timeout_s:g} s: {why}")

    def give_up(self, guard: str, reason: str) -> None:
        """Stop for a reason that is no device's fault.

        Raises
        ------
        Halt
            Always.
        """
        self._refuse(guard, reason, device_fault=False)

    def _ramp_to_force(self, motion: RampToForce, expected_s: float) -> None:
        """Ramp towards the stroke limit and hold at the first sample that shows the force."""
        acquisition = self._acquisition
        way, limit_s = self.commanding.way_to_force(motion), self._patience.limit_s(expected_s)
        if self.ramp(way, limit_s, lambda: acquisition.latest.values.get("force", 0.0) >= motion.force_kN):
            return
        acquisition.log.say(
            "step",
            f"{motion.force_kN:g} kN were not reached at the stroke limit of {motion.stroke_limit_mm:g} mm",
        )

    def ramp(self, way: RampTo, limit_s: float, enough: Callable[[], bool]) -> bool:
        """Ramp the piston; hold as soon as it is enough.

        Parameters
        ----------
        way : RampTo
            Of the piston, from first contact.
        limit_s : float
            So long it may take [s].
        enough : callable
            Asked after every pass.

        Returns
        -------
        bool
            Whether it was held; False if it came to its own end.

        Raises
        ------
        Halt
            As :meth:`perform`.
        """
        began_s, sequence = self._device_s(), self._start(way)
        while not self._ended(way, sequence):
            self.pump()
            if enough():
                self._until_done(way, self._hold(), limit_s)
                return True
            if self._device_s() - began_s > limit_s:
                self._refuse("controller", f"the {way.name} has not ended after {limit_s:.0f} s")
        self.obey()
        return False

    @contextmanager
    def counting_turns(self) -> Iterator[None]:
        """Inside, cycles are counted by :meth:`count_cycle`, and a stop after the cycle waits for that."""
        self._last_cycle, self._by_turns = None, True
        try:
            yield
        finally:
            self._by_turns = False

    def count_cycle(self) -> None:
        """Count a full cycle that no controller counts; stop if that was waited for.

        Raises
        ------
        Halt
            Then.
        """
        self.cycles_done += 1
        self.obey()

    def meanwhile(self, work: Callable[[], ResultT]) -> ResultT:
        """Do something lengthy in a thread while the loop goes on: guards see, and the watchdog is fed.

        Raises
        ------
        Halt
            If a guard or the operator demands it; and whatever the work raises.
        """
        with ThreadPoolExecutor(1) as pool:
            doing = pool.submit(work)
            while not doing.done():
                self._tick()
                wait_for([doing], timeout=0.02)
        self.obey()
        return doing.result()

    def wait(self, duration_s: float) -> None:
        """Stand still for a time of the device.

        Raises
        ------
        Halt
            As :meth:`pump`.
        """
        began_s = self._device_s()
        while self._device_s() - began_s < duration_s:
            self.pump()

    def cool(self, temperature_C: float | None, timeout_s: float) -> None:
        """Wait until every specimen sensor is at or below a temperature; warm ones do not trip meanwhile.

        Parameters
        ----------
        temperature_C : float or None
            The temperature [°C]; None means each sensor's resume threshold.
        timeout_s : float
            Longest wait [s of device time].

        Raises
        ------
        Halt
            As :meth:`pump`, and if it takes longer than ``timeout_s``.
        """
        panel = self._acquisition.panel
        guards = panel.guards
        panel.change(guards.cooling())
        began_s = self._device_s()
        try:
            while why := panel.warmer_than(temperature_C):
                self.pump()
                if (
                    self._request.level is StopLevel.AFTER_STEP
                ):  # nothing is under way that must come to its end
                    reason = f"stopped by the operator: {self._request.reason}"
                    self._refuse("operator", reason, device_fault=False)
                unread = None in panel.specimen_temperatures().values()  # as behind a sleep of the computer
                if self._device_s() - began_s > timeout_s and not unread:
                    self._refuse("cool-down", f"not cool after {timeout_s:g} s: {why}", device_fault=False)
        finally:
            panel.change(guards)

    def _hold(self) -> int:
        self._acquisition.renew_status()
        with self._looking_between():
            return self.outlasting(lambda: self._acquisition.stand.controller.start(StandStill()))

    def outlasting(self, command: Callable[[], ResultT]) -> ResultT:
        """Give a command that does no harm twice; again where an outage in it was ridden out.

        Raises
        ------
        Halt
            If a guard or the operator demands a stop meanwhile.
        DeviceFault
            If the wire fails for good, or as the command does.
        """
        while True:
            try:
                result = command()
            except WireLost as lost:
                self._outlast(lost)
            else:
                self._acquisition.renew_status()
                return result

    def _outlast(self, lost: WireLost) -> None:
        """Make passes until an outage that began within a command is over.

        Raises
        ------
        Halt
            If a guard or the operator demands a stop meanwhile.
        WireLost
            If outages are not ridden out here.
        """
        acquisition = self._acquisition
        acquisition.renew_status()  # it is not known what of the command was done
        if not acquisition.continuity.lose(lost):
            raise lost
        while acquisition.continuity.is_cut_off:
            self._tick()
            self._halt_if_told()
        self._halt_if_told()

    def _halt_if_told(self) -> None:
        self._hear_operator()
        panel = self._acquisition.panel
        if panel.trip is not None and panel.action >= Action.STOP:
            raise Halt(panel.trip)

    def _looking_between(self) -> AbstractContextManager[None]:
        """Inside, samples are read and judged between the requests of a command; a stop ends it there.

        An outage in between is ridden out before the next request, or the same once more.
        """
        return self._acquisition.stand.controller.look_between(self._look_between, self._outlast)

    def _look_between(self) -> None:
        acquisition = self._acquisition
        began_s = acquisition.clock.now_s()
        acquisition.catch_up()
        while acquisition.continuity.is_cut_off:
            self._tick()
            self._halt_if_told()
        acquisition.samples_first()  # behind the request that follows
        self._between_s += acquisition.clock.now_s() - began_s
        self._hear_operator()
        panel = acquisition.panel
        if panel.trip is not None and panel.action >= Action.STOP:
            raise Halt(panel.trip)

    def _await_reader(self) -> None:
        """Begin no motion while samples wait: its guards would see it late.

        They do behind a pause, or behind what was tried when the actuator was switched on.
        """
        clock = self._acquisition.clock
        end_s = clock.wall_s() + READER_S
        while self._acquisition.is_behind and clock.wall_s() < end_s:
            self.pump()

    def _start(self, motion: Commandable) -> int:
        self._await_reader()
        self._acquisition.renew_status()  # what was seen of the motion before says nothing of this one
        self.stopping_s = 1.0 / (2.0 * math.pi * motion.frequency_Hz) if isinstance(motion, Harmonic) else 0.0
        began_s, self._between_s = self._acquisition.clock.now_s(), 0.0
        try:
            with self._looking_between():
                sequence = self.commanding.start(motion)
            self._acquisition.renew_status()
            self.command_s = self._acquisition.clock.now_s() - began_s - self._between_s
        except CommandRejected as rejected:
            self._refuse("controller", f"the controller refused a motion: {rejected}")
            raise
        wanted_mm_per_s = None if isinstance(motion, Release) else self._release_speed_mm_per_s
        if wanted_mm_per_s is not None and not self._acquisition.stand.controller.stops_at_once:
            self._have_release_ready(wanted_mm_per_s)
        return sequence

    def _have_release_ready(self, speed_mm_per_s: float) -> None:
        """Arm a release behind the motion, where a stop needs several requests: this one takes one."""
        try:
            with self._looking_between():
                self._acquisition.stand.controller.prepare(Release(speed_mm_per_s))
        except CommandRejected as rejected:  # it is armed when it is needed, as any other command
            self._acquisition.log.say("wire", f"no release could be made ready: {rejected}")

    def _until_done(self, motion: Motion, sequence: int, limit_s: float) -> None:
        began_s = self._device_s()
        bound = self._bound_of(motion)
        while not self._ended(motion, sequence):
            self.pump()
            if self._device_s() - began_s > limit_s:
                self._refuse("controller", f"the {motion.name} has not ended after {limit_s:.0f} s")
            status = self._acquisition.latest.status
            if bound is not None and status is not None:
                force_kN = self._acquisition.latest.values.get("force", status.force_kN)
                if why := bound.look(status.position_mm, force_kN, status.force_kN):
                    self._refuse("release", why)
        self.obey()

    def _bound_of(self, motion: Motion) -> ReleaseBound | None:
        """Return what says that a release has let go, though it goes on; None of another motion."""
        began_mm = self._acquisition.latest.values.get("position")
        if not isinstance(motion, Release) or began_mm is None:
            return None
        zero = self._acquisition.zero
        own_mm = began_mm + (0.0 if zero is None else zero.value("position"))
        return ReleaseBound(own_mm, contact_of(zero))

    def _ended(self, motion: Motion, sequence: int) -> bool:
        status: ControllerStatus | None = self._acquisition.latest.status
        if status is None or status.done_sequence != sequence:
            return False
        if status.end_reason not in GOOD_ENDS:
            how = status.end_reason.name.lower().replace("_", " ")
            self._refuse("controller", f"the {motion.name} was ended from outside ({how})")
        return True

    def _device_s(self) -> float:
        """Return the newest time stamp of the controller [s]: a slow simulation is no slow stand."""
        return self._acquisition.latest.device_s or 0.0

    def _refuse(self, guard: str, reason: str, *, device_fault: bool = True) -> None:
        at_s = self._acquisition.clock.now_s()
        self._acquisition.panel.latch(Trip(guard, Action.STOP, reason, at_s, device_fault=device_fault))
        self.obey()

    def _hear_operator(self) -> None:
        actions = {StopLevel.NOW: Action.STOP, StopLevel.AFTER_CYCLE: Action.STOP_AFTER_CYCLE}
        action = actions.get(self._request.level)
        if action is not None and self._acquisition.panel.action < action:
            reason = f"stopped by the operator: {self._request.reason}"
            self._acquisition.panel.latch(Trip("operator", action, reason, self._acquisition.clock.now_s()))
