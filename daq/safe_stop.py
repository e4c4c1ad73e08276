"""The one safe stop: hold, ramp to zero force, valve off; idempotent, limited in time, on every way out.

This is no safety device: the stand's hard-wired emergency stop, valve and relief protect people and
machine. If the wire is lost, the controller's own watchdog ends in the same state, and the report says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from daq.signals import signals_held_back
from drivers.interfaces import Controller, ControllerStatus, MotionState
from foundation.clock import Clock
from foundation.errors import CommandRejected, DeviceFault

VALVE_OFF = (MotionState.OFF, MotionState.READY)
"""States in which the actuator's valve is off."""

ResultT = TypeVar("ResultT")


@dataclass(frozen=True)
class SafeStopReport:
    """What the safe stop reached.

    Parameters
    ----------
    safe : bool
        True if zero force and a closed valve were *seen*.
    by : str
        ``commands`` (ours), ``controller`` (it had fallen back by itself) or ``watchdog`` (the wire is
        lost: nothing was seen, the controller's watchdog has to do it).
    state : MotionState or None
        Last state seen.
    force_kN, stroke_mm : float or None
        Last values seen.
    duration_s : float
        How long it took [s of stand time].
    problems : tuple of str
        What did not go as it should.
    line : str
        All of it in one line for a person.
    """

    safe: bool
    by: Literal["commands", "controller", "watchdog"]
    state: MotionState | None
    force_kN: float | None
    stroke_mm: float | None
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
    """

    release_speed_mm_per_s: float
    watchdog_s: float
    zero_force_kN: float = 2.0
    hold_s: float = 1.0
    limit_s: float = 60.0


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
    """

    def __init__(
        self,
        controller: Controller,
        clock: Clock,
        settings: SafeStopSettings,
        pump: Callable[[], object] = lambda: None,
    ) -> None:
        self._controller = controller
        self._clock = clock
        self._settings = settings
        self._pump = pump
        self._report: SafeStopReport | None = None
        self._problems: list[str] = []
        self._status: ControllerStatus | None = None
        self._began_s = 0.0
        self._answered_s = 0.0

    @property
    def report(self) -> SafeStopReport | None:
        """Return what it reached, None if it has not run (since it was armed)."""
        return self._report

    def arm(self) -> None:
        """Make the next call stop again: called before the actuator is switched on."""
        self._report = None

    def run(self, *, emergency: bool = False) -> SafeStopReport:
        """Stop safely; a second call does nothing and returns the first report.

        Parameters
        ----------
        emergency : bool
            Leave out the hold and unload at once.
        """
        if self._report is None:
            with signals_held_back():
                self._report = self._stop(emergency)
        return self._report

    def _stop(self, emergency: bool) -> SafeStopReport:
        self._problems = []
        self._began_s = self._clock.now_s()
        self._answered_s = self._clock.wall_s()
        by: Literal["commands", "controller", "watchdog"] = "commands"
        status = self._ask("status", self._controller.status)
        if status is not None and status.state not in VALVE_OFF:
            self._status = status
            if not emergency and not self._faulted():
                self._move("hold", self._controller.start_hold, self._settings.hold_s)
            if not self._faulted():
                self._move("release", self._release, self._settings.limit_s)
            if self._faulted():  # it refuses commands and unloads by itself
                by = "controller"
                self._wait(self._at_rest, self._settings.limit_s)
            self._ask("valve off", self._controller.disable)
        last = self._ask("status", self._controller.status)
        self._status = last or self._status
        return self._describe("watchdog" if last is None else by, last)

    def _release(self) -> int:
        return self._controller.start_release(speed_mm_per_s=self._settings.release_speed_mm_per_s)

    def _move(self, what: str, start: Callable[[], int], limit_s: float) -> None:
        """Start a motion and wait for its end; a rejected one is noted, a faulted one is left alone."""
        sequence = self._ask(what, start)
        if sequence is None:
            return

        def ended() -> bool:
            status = self._status
            return self._faulted() or (
                status is not None and (status.done_sequence == sequence or status.state in VALVE_OFF)
            )

        if not self._wait(ended, limit_s):
            self._problems.append(f"the {what} did not end in time")

    def _wait(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Pump and look until the condition holds; False when its time, or all the time, is over."""
        deadline_s = min(self._clock.now_s() + limit_s, self._began_s + self._settings.limit_s)
        while not self._link_lost():
            self._pump_safely()
            status = self._ask("status", self._controller.status)
            self._status = status or self._status
            if status is not None and condition():
                return True
            if self._clock.now_s() >= deadline_s:
                return False
            self._clock.sleep(0.02)
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
            except Exception as fault:  # noqa: BLE001 - whatever a driver raises, the stop must go on
                self._note(f"{what}: {fault if isinstance(fault, DeviceFault) else repr(fault)}")
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
        status = self._status
        return status is not None and (status.state is MotionState.FAULT or status.fault_code != 0)

    def _at_rest(self) -> bool:
        """Return whether the controller's own fallback has ended: valve off, or no force left to release."""
        status = self._status
        if status is None:
            return False
        off = status.state in VALVE_OFF or status.state is MotionState.FAULT
        return off and abs(status.force_kN) <= self._settings.zero_force_kN

    def _note(self, problem: str) -> None:
        if problem not in self._problems:
            self._problems.append(problem)

    def _describe(
        self, by: Literal["commands", "controller", "watchdog"], last: ControllerStatus | None
    ) -> SafeStopReport:
        settings, status = self._settings, self._status
        duration_s = self._clock.now_s() - self._began_s
        if last is None:
            safe = False
            line = (
                f"safe stop: the controller does not answer; its own watchdog ({settings.watchdog_s:g} s) "
                "has to ramp to zero force and switch the valve off. NOT SEEN: look at the stand before "
                "anyone goes near it"
            )
        else:
            off = last.state in VALVE_OFF or last.state is MotionState.FAULT
            safe = off and abs(last.force_kN) <= settings.zero_force_kN
            valve = "valve off" if off else f"VALVE NOT OFF (state {last.state.name.lower()})"
            own = " by the controller itself" if by == "controller" else ""
            line = (
                f"safe stop{own}: force {last.force_kN:.1f} kN, stroke {last.stroke_mm:.1f} mm, "
                f"{valve}, after {duration_s:.1f} s"
            )
            if not safe:
                line += "; NOT SAFE: use the stand's emergency stop"
        if self._problems:
            line += f" ({'; '.join(self._problems)})"
        return SafeStopReport(
            safe,
            by,
            status.state if status else None,
            status.force_kN if status else None,
            status.stroke_mm if status else None,
            duration_s,
            tuple(self._problems),
            line,
        )
