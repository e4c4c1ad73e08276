"""The one safe stop: hold, ramp to zero force, valve off; idempotent, limited in time, on every way out.

What stops the piston is the first request: a hold, or in an emergency the release. Whether it does is seen
afterwards: a hold that gets no answer, or leaves the piston moving toward more force, becomes an emergency
release; a release that does so, valve off.

This is no safety device: the stand's hard-wired emergency stop, valve and relief protect people and
machine. If the wire is lost, the controller's own watchdog ends in the same state, and the report says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from bufferstand.daq.motions.release_bound import ReleaseBound
from bufferstand.daq.motions.stop_observer import ControllerReadingOnly, StopObserver
from bufferstand.daq.operator import signals_held_back
from bufferstand.drivers import Controller, ControllerStatus, MotionState
from bufferstand.foundation import Clock, CommandRejected, DeviceFault, NotInCharge, Release, StandStill

VALVE_OFF = (MotionState.OFF, MotionState.READY)
"""States in which the actuator's valve is off."""

OWN_READING = "the controller's own reading"
"""Where the force comes from without samples: nothing is taken off it."""

STATUS_REST = 3.0
"""The controller's state is asked for again after so many times what that took."""
STATUS_WAIT_S = 0.1
"""It is asked for again after so long at the latest [s of the wall]."""
AGREE_S = 1.0
"""So long samples may take to show that no force is left: some come later [s of stand time]."""
LOOK_S = 0.02
"""From one look at the controller to the next, where looking takes less [s of stand time]."""

ResultT = TypeVar("ResultT")
By = Literal["commands", "controller", "watchdog", "nobody"]


@dataclass(frozen=True)
class SafeStopReport:
    """What the safe stop reached.

    Parameters
    ----------
    safe : bool
        True if zero force and a closed valve were *seen*.
    by : str
        ``commands`` (ours), ``controller`` (it had fallen back by itself), ``watchdog`` (the wire is lost:
        nothing was seen, the controller's watchdog has to do it) or ``nobody`` (another program has the
        right to give commands, or another controller answers: nothing was sent).
    state : MotionState or None
        Last state seen.
    force_kN, stroke_mm : float or None
        Last values seen: the force by the best channel, the stroke by the draw wires, each with its zero
        taken off; without fresh samples by the controller.
    force_source : str
        Where the force comes from.
    duration_s : float
        How long it took [s of stand time].
    problems : tuple of str
        What did not go as it should.
    line : str
        All of it in one line for a person.
    """

    safe: bool
    by: By
    state: MotionState | None
    force_kN: float | None
    stroke_mm: float | None
    force_source: str
    duration_s: float
    problems: tuple[str, ...]
    line: str


@dataclass(frozen=True)
class SafeStopSettings:
    """How the safe stop unloads.

    Parameters
    ----------
    release_speed_mm_per_s : float
        Speed of the ramp to zero force.
    watchdog_s : float
        Time of the controller's own watchdog [s of the wall].
    zero_force_kN : float
        Below this the specimen counts as unloaded.
    hold_s : float
        So long at most it waits for the hold.
    limit_s : float
        So long at most all of it takes; the valve is switched off then, whatever the force.
    stays_where_unloaded : bool
        Where no force is left it holds and switches off, and the piston stays: for motions by hand.
    """

    release_speed_mm_per_s: float
    watchdog_s: float
    zero_force_kN: float = 2.0
    hold_s: float = 1.0
    limit_s: float = 60.0
    stays_where_unloaded: bool = False


class SafeStop:
    """Brings the stand to zero force with the valve off, once.

    Parameters
    ----------
    controller : Controller
        Who has to do it.
    clock : Clock
        Stand time.
    settings : SafeStopSettings
        Speeds and times.
    pump : callable
        Called between two looks at the controller, so that acquisition and recording go on; what it
        raises is noted and cannot break the stop.
    eyes : Eyes, optional
        What it sees of the samples: does the piston go on, what force is left. Without them the
        controller's own reading counts.
    emergency : callable
        Whether a guard demands an emergency by now: a hold is not waited for then.
    """

    def __init__(
        self,
        controller: Controller,
        clock: Clock,
        settings: SafeStopSettings,
        pump: Callable[[], object] = lambda: None,
        *,
        eyes: StopObserver | None = None,
        emergency: Callable[[], bool] = lambda: False,
    ) -> None:
        self._controller = controller
        self._clock = clock
        self._settings = settings
        self._pump = pump
        self._eyes = eyes or ControllerReadingOnly()
        self._sees = eyes is not None
        self._emergency = emergency
        self._report: SafeStopReport | None = None
        self._problems: list[str] = []
        self._status: ControllerStatus | None = None
        self._bound: ReleaseBound | None = None
        self._began_s = 0.0
        self._answered_s = 0.0
        self._left = ""

    @property
    def report(self) -> SafeStopReport | None:
        """Return what it reached, None if it has not run (since it was armed)."""
        return self._report

    def leave(self, why: str) -> None:
        """Send nothing any more, and say why: what answers is not this program's to stop.

        What a stop before has reached says nothing of the stand as it is now, and is forgotten.
        """
        self._left, self._report = why, None

    def arm(self) -> None:
        """Make the next call stop again: called before the actuator is switched on."""
        self._report = None

    def run(
        self, *, emergency: bool = False, seen: ControllerStatus | None = None, stopping_s: float = 0.0
    ) -> SafeStopReport:
        """Stop safely; a second call does nothing and returns the first report.

        Parameters
        ----------
        emergency : bool
            Leave out the hold and unload at once.
        seen : ControllerStatus, optional
            What was seen last: an actuator that was on is told to stop before it is asked anything.
        stopping_s : float
            So long the controller may take to slow the motion under way down [s]: of a sine, which has mass.
        """
        if self._report is None:
            with signals_held_back():
                self._report = self._stop(emergency, seen, stopping_s)
        return self._report

    def _stop(self, emergency: bool, seen: ControllerStatus | None, stopping_s: float) -> SafeStopReport:
        self._problems = []
        self._began_s = self._clock.now_s()
        self._answered_s = self._clock.wall_s()
        if self._left:
            line = f"nothing was sent: {self._left}"
            return SafeStopReport(False, "nobody", None, None, None, "", 0.0, (), line)
        by: By = "commands"
        status = seen
        if status is None or status.state in VALVE_OFF or _is_fault(status):
            # A fault may be one from before: switching on has reset it, and the valve is on since.
            status = self._ask("status", self._controller.status)
        if not self._controller.in_charge:  # another program's stand: it is looked at only
            by = "nobody"
            status = self._ask("status", self._controller.status)
        elif status is not None and status.state not in VALVE_OFF:
            self._status = status
            # Where a hold takes several requests the release that is ready in the controller comes first.
            hurry = emergency or not self._controller.stops_at_once
            if not hurry and not self._faulted():
                hurry = not self._hold(stopping_s)
            if not (self._faulted() or self._may_stay()):
                self._release(hurry=hurry)
            if self._faulted():  # it refuses commands and unloads by itself
                by = "controller"
                self._judge_force_from_now()
                self._bound_release()
                self._wait(lambda: self._at_rest() or self._has_let_go(), self._settings.limit_s)
            self._ask("valve off", self._controller.disable)
        last = self._ask("status", self._controller.status)
        self._status = last or self._status
        if last is not None:
            self._look_at_force(self._shows_no_force)
        if not self._controller.in_charge:  # it may have been lost meanwhile
            by = "nobody"
        return self._describe("watchdog" if last is None else by, last)

    def _may_stay(self) -> bool:
        if self._status is None or not self._settings.stays_where_unloaded:
            return False
        self._look_at_force(lambda: self._shows_no_force() or self._shows_force())
        return not self._shows_force() and abs(self._force_kN(self._status)) <= self._zero_kN

    def _hold(self, stopping_s: float) -> bool:
        """Hold; return whether the piston stands, or at least does not go on toward more force."""
        self._eyes.told()
        try:
            sequence = self._controller.start(StandStill())
        except CommandRejected as rejected:
            self._note(f"hold rejected: {rejected}")
            self._status = self._ask("status", self._controller.status) or self._status
            return True
        except Exception as fault:  # noqa: BLE001 - whatever a driver raises, the stop must go on
            self._note(f"hold: {_said(fault)}; released at once")
            return False
        trouble = self._await_end("hold", sequence, self._settings.hold_s, stopping_s)
        if trouble:
            self._note(f"{trouble} after the hold: released at once")
        return not trouble

    def _release(self, *, hurry: bool) -> None:
        def start() -> int:
            return self._controller.start(Release(self._settings.release_speed_mm_per_s), hurry=hurry)

        self._eyes.told()
        self._bound_release()
        sequence = self._ask("release", start)
        if sequence is None:
            self._status = self._ask("status", self._controller.status) or self._status
        elif trouble := self._await_end("release", sequence, self._settings.limit_s):
            self._note(f"{trouble} after the release: valve off at once")

    def _bound_release(self) -> None:
        """Look from now on how far the piston goes back: a wrong force never ends a release."""
        status = self._status
        self._bound = None if status is None else ReleaseBound(status.position_mm, self._eyes.contact_mm())

    def _has_let_go(self) -> bool:
        """Return whether the piston has gone back so far that no force can be left; it is noted then."""
        status = self._status
        if self._bound is None or status is None or status.state in VALVE_OFF:
            return False
        why = self._bound.look(status.position_mm, self._force_kN(status), status.force_kN)
        if why:
            self._note(why)
        return bool(why)

    def _look_at_force(self, enough: Callable[[], bool]) -> None:
        """Take samples from after the last status until they are enough to judge the force that is left."""
        if not self._sees:
            return
        until_s = self._clock.now_s() + AGREE_S
        self._judge_force_from_now()
        self._pump_safely()
        while not enough() and self._clock.now_s() < until_s:
            self._clock.sleep(LOOK_S)
            self._pump_safely()

    def _judge_force_from_now(self) -> None:
        self._eyes.since(None if self._status is None else self._status.tick_us)

    def _shows_no_force(self) -> bool:
        """Return whether every way to the force shows none; the first one to answer does not decide."""
        seen = self._eyes.force()
        if seen is None or seen.silent or seen.other_kN:
            return False
        return abs(seen.force_kN) <= self._zero_kN

    def _shows_force(self) -> bool:
        """Return whether one way to the force shows some."""
        seen = self._eyes.force()
        return seen is not None and (abs(seen.force_kN) > self._zero_kN or bool(seen.other_kN))

    def _await_end(self, what: str, sequence: int, limit_s: float, stopping_s: float = 0.0) -> str:
        """Wait for a command's end; return how the piston goes on toward more force, empty if it does not."""
        trouble = ""
        self._answered_s = self._clock.wall_s()
        self._eyes.done(self._controller.taken_us)

        def over() -> bool:
            nonlocal trouble
            status = self._status
            ended = self._faulted() or (
                status is not None and (status.done_sequence == sequence or status.state in VALVE_OFF)
            )
            if not ended:
                trouble = self._eyes.goes_on(stopping_s)
                ended = what == "release" and self._has_let_go()
                if what == "hold" and self._emergency():
                    trouble = trouble or "a guard demanded an emergency"
            return ended or bool(trouble)

        if not self._wait(over, limit_s):
            self._note(f"the {what} did not end in time")
        return trouble

    def _wait(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Pump and look until the condition holds; False when its time, or all the time, is over."""
        deadline_s = min(self._clock.now_s() + limit_s, self._began_s + self._settings.limit_s)
        due_s = self._clock.wall_s()
        while self._controller.in_charge and not self._link_lost():
            looked_s = self._clock.now_s()
            self._pump_safely()
            asked_s = self._clock.wall_s()
            if asked_s >= due_s:
                status = self._ask("status", self._controller.status)
                self._status = status or self._status
                took_s = self._clock.wall_s() - asked_s  # on a slow wire the samples come first
                due_s = self._clock.wall_s() + min(STATUS_REST * took_s, STATUS_WAIT_S)
            if condition():
                return True
            if self._clock.now_s() >= deadline_s:
                return False
            self._clock.sleep(LOOK_S - min(LOOK_S, self._clock.now_s() - looked_s))
        return False

    def _ask(self, what: str, call: Callable[[], ResultT]) -> ResultT | None:
        """Call the controller, again and again while the wire fails, until the link counts as lost."""
        while True:
            try:
                result = call()
            except CommandRejected as rejected:
                self._note(f"{what} rejected: {rejected}")
                self._answered_s = self._clock.wall_s()
                return None
            except NotInCharge as lost:  # to ask again would be no use, and might be another's harm
                self._note(f"{what}: {lost}")
                return None
            except Exception as fault:  # noqa: BLE001 - whatever a driver raises, the stop must go on
                self._note(f"{what}: {_said(fault)}")
                if self._link_lost():
                    return None
                self._clock.sleep(0.1)
                continue
            self._answered_s = self._clock.wall_s()
            return result

    def _link_lost(self) -> bool:
        """Return True once nothing was answered for so long (of the wall) that the watchdog has acted."""
        return self._clock.wall_s() - self._answered_s > self._settings.watchdog_s + 1.0

    def _pump_safely(self) -> None:
        try:
            self._pump()
        except Exception as error:  # noqa: BLE001 - a failing loop must not keep the stand loaded
            self._note(f"acquisition failed during the stop: {error!r}")
            self._feed()

    def _feed(self) -> None:
        """Feed in the loop's place; without it the watchdog would end a long release."""
        try:
            self._controller.feed_watchdog()
        except Exception as error:  # noqa: BLE001 - the next look at the controller says it better
            self._note(f"watchdog not fed: {error}")

    def _faulted(self) -> bool:
        return self._status is not None and _is_fault(self._status)

    def _at_rest(self) -> bool:
        """Return whether the controller's own fallback has ended: valve off, or no force left to release."""
        status = self._status
        if status is None:
            return False
        off = status.state in VALVE_OFF or status.state is MotionState.FAULT
        return off and abs(self._force_kN(status)) <= self._zero_kN

    @property
    def _zero_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        return self._settings.zero_force_kN

    def _force_kN(self, status: ControllerStatus) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the force by the best channel; by the controller's own reading where none has samples."""
        seen = self._eyes.force()
        return status.force_kN if seen is None else seen.force_kN

    def _stroke_mm(self, status: ControllerStatus, *, told: bool) -> tuple[float, str]:
        """Return the stroke by the draw wires, zero taken off, or else by the controller, which is said.

        ``told`` is whether it is said already that the controller's own readings are shown.
        """
        seen_mm = self._eyes.stroke_mm()
        if seen_mm is not None:
            return seen_mm, ""
        return status.stroke_mm, "" if told else f" ({OWN_READING})"

    def _whose(self, *, off: bool) -> str:
        """Return in words whose the stand is; empty where it is nobody's, and off."""
        try:
            seen = self._controller.seen_writer()
        except Exception as fault:  # noqa: BLE001 - it is for the message only
            return f"another program may have the stand ({_said(fault)})"
        if seen.number:
            return f"another program has the stand: {seen.who}"
        return "" if off else "no program has the right to give it commands, this one neither"

    def _note(self, problem: str) -> None:
        if problem not in self._problems:
            self._problems.append(problem)

    def _describe(self, by: By, last: ControllerStatus | None) -> SafeStopReport:
        settings, status = self._settings, self._status
        duration_s = self._clock.now_s() - self._began_s
        seen = None if last is None else self._eyes.force()
        source = OWN_READING if seen is None else seen.source
        force_kN, stroke_mm = (None, None) if status is None else (status.force_kN, status.stroke_mm)
        if last is None:
            safe = False
            line = (
                f"safe stop: the controller does not answer; its own watchdog ({settings.watchdog_s:g} s) "
                "has to ramp to zero force and switch the valve off. NOT SEEN: look at the stand before "
                "anyone goes near it"
            )
        else:
            force_kN = self._force_kN(last)
            stroke_mm, reading = self._stroke_mm(last, told=seen is None)
            off = last.state in VALVE_OFF or last.state is MotionState.FAULT
            whose = self._whose(off=off) if by == "nobody" else ""
            safe = off and abs(force_kN) <= self._zero_kN and not (seen and seen.other_kN) and not whose
            valve = "valve off" if off else f"VALVE NOT OFF (state {last.state.name.lower()})"
            own = " by the controller itself" if by == "controller" else ""
            line = (
                f"safe stop{own}: force {round(force_kN, 1) + 0.0:.1f} kN ({source}), "
                f"stroke {round(stroke_mm, 1) + 0.0:.1f} mm{reading}, {valve}, after {duration_s:.1f} s"
            )
            if whose:
                line = f"nothing was sent: {whose}; last seen: {line.removeprefix('safe stop: ')}"
                line += "; NOT SAFE: it is not this program's to stop; look at the stand, which has its "
                line += "emergency stop"
            elif not safe:
                line += "; NOT SAFE: use the stand's emergency stop"
            if seen is not None and seen.beside:
                line += f"; {seen.beside}"
        if self._problems:
            line += f" ({'; '.join(self._problems)})"
        return SafeStopReport(
            safe,
            by,
            status.state if status else None,
            force_kN,
            stroke_mm,
            source if force_kN is not None else "",
            duration_s,
            tuple(self._problems),
            line,
        )


def _is_fault(status: ControllerStatus) -> bool:
    return status.state is MotionState.FAULT or status.fault_code != 0


def _said(fault: Exception) -> str:
    return str(fault) if isinstance(fault, DeviceFault) else repr(fault)
