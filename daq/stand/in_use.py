"""Whether another program uses the stand, what is to be waited for, and the wait.

A program that was killed leaves a motion behind that its controller ends by itself: the watchdog runs out,
the force is taken away, the valve goes off, and the writer's lock falls free. Nothing is written to it here.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from bufferstand.daq.guards.kinds import fault_text
from bufferstand.daq.motions import SafeStopReport
from bufferstand.drivers import Controller, ControllerStatus, MotionState, WriterSeen
from bufferstand.drivers.controllers import IN_MOTION, SWITCHED_ON
from bufferstand.foundation import Clock
from bufferstand.protocols.steps import PlannedStep

FREE_S = 10.0
"""The controller drops a writer so long after its last heartbeat [s of the wall] (docs/drivers.md)."""
RELEASE_MM_PER_S, RELEASE_MORE_S = 10.0, 2.0
"""A controller's own release is reckoned with so slowly, and with so much more until its valve is off."""
RESERVE_S = 15.0
"""So much longer than reckoned it may take until the wait is given up [s of the wall]."""
LIVES_S = 1.5
"""A program that lives feeds the watchdog within this: ours do every 0.25 s [s of the wall]."""
LOOK_S = 0.2
SAID_S = 5.0
"""The wait is said again after so long, for logs [s of the wall]."""
LONG_REST_S = 10.0
"""Nobody need stay with a valve that is off: a wait from so long on is made with it off [s]."""


@dataclass(frozen=True)
class StandUse:
    """A stand that is in use.

    Parameters
    ----------
    what : str
        What shows it.
    shown : str
        What the controller does.
    writer : WriterSeen
        Who may give commands.
    longest_s : float or None
        How long at most it takes until the stand is free, if nobody feeds its watchdog any more [s of the
        wall]; None where nothing would end it.
    """

    what: str
    shown: str
    writer: WriterSeen
    longest_s: float | None

    @property
    def at_most(self) -> str:
        """The same for a person."""
        return "" if self.longest_s is None else f", {max(self.longest_s, 1.0):.0f} s at most"


def look_at_use(controller: Controller, most_kN: float) -> StandUse | None:
    """Return what shows that a stand is in use, None if it is free; nothing is commanded or acknowledged.

    Parameters
    ----------
    controller : Controller
        Connected.
    most_kN : float
        A hold under more force than this is a motion that somebody has interrupted.

    Raises
    ------
    DeviceFault
        If the wire fails.
    """
    writer, status = controller.seen_writer(), controller.status()
    force_kN, stroke_mm = (round(value, 1) + 0.0 for value in (status.force_kN, status.stroke_mm))  # no -0.0
    shown = f"{status.state.name.lower()}, force {force_kN:.1f} kN, stroke {stroke_mm:.1f} mm"
    if writer.number:
        what = f"another program gives the controller commands: {writer.who}"
    elif status.fault_code and status.state is MotionState.RELEASING:
        what = f"the controller takes the force away by itself, {fault_text(status.fault_code)}"
    elif status.state is MotionState.HOLDING and not abs(status.force_kN) <= most_kN:  # true for NaN, too
        what = f"it holds under more than {most_kN:g} kN, which this start has not commanded"
    elif status.state in IN_MOTION:
        what = "a motion is under way that this start has not commanded"
    else:
        return None
    return StandUse(what, shown, writer, _longest_s(writer, status))


def _longest_s(writer: WriterSeen, status: ControllerStatus) -> float | None:
    """Return how long it takes at most until the controller is at rest and free, unfed [s of the wall]."""
    free_s = FREE_S if writer.number else 0.0
    if status.state not in SWITCHED_ON:
        return free_s
    release_s = abs(status.position_mm) / RELEASE_MM_PER_S + RELEASE_MORE_S
    if status.fault_code:
        return max(free_s, release_s)
    if not writer.watchdog_s:
        return None
    left_s = writer.watchdog_s if writer.left_s is None else writer.left_s
    # Both count from the last heartbeat: what has gone of the watchdog's time has gone of the lock's.
    return max(free_s - (writer.watchdog_s - left_s), left_s + release_s)


def use_trouble(controller: Controller, clock: Clock, most_kN: float) -> str:
    """Return why a stand is in use, by whom, and what to wait for how long; empty if it is free.

    Raises
    ------
    DeviceFault
        If the wire fails.
    """
    use = look_at_use(controller, most_kN)
    return "" if use is None else _refusal(use, lives=lives(controller, clock, use))


def lives(controller: Controller, clock: Clock, use: StandUse) -> bool:
    """Return whether the program that has the stand lives: its process, or heartbeats that go on.

    Raises
    ------
    DeviceFault
        If the wire fails.
    """
    if use.writer.process_lives:
        return True
    end_s = clock.wall_s() + LIVES_S
    while use.writer.number and use.writer.feed is not None and clock.wall_s() < end_s:
        clock.sleep(LOOK_S)
        seen = controller.seen_writer()
        if seen.feed != use.writer.feed:
            return True
        if seen.number != use.writer.number:
            break
    return False


def _refusal(use: StandUse, *, lives: bool) -> str:
    if lives:
        return f"{use.what} ({use.shown}), and it lives: wait for its end, or end it, then start again"
    if use.writer.number:
        return (
            f"{use.what} ({use.shown}), and it gives no sign of life. If it was killed, wait{use.at_most}: "
            "the controller's watchdog takes the force away and switches the valve off, and 10 s after that "
            "program's last heartbeat the controller drops it; then start again (“bufferstand resume” waits "
            "by itself)"
        )
    return (
        f"{use.what} ({use.shown}): end the program that gives commands. If it was killed, wait"
        f"{use.at_most} until the controller has taken the force away and its valve is off; then start again"
    )


def await_free(
    controller: Controller,
    clock: Clock,
    most_kN: float,
    *,
    interrupted: Callable[[], bool],
    say: Callable[[str], object],
    show: Callable[[str, float], object],
) -> str:
    """Wait until a stand that a killed program has left is at rest and free; nothing is written to it.

    Parameters
    ----------
    controller : Controller
        Connected.
    clock : Clock
        The wall's time, by which watchdog and lock count.
    most_kN : float
        As for :func:`look_at_use`.
    interrupted : callable
        Whether the operator wants to wait no longer.
    say : callable
        Shows a line that stays.
    show : callable
        Shows what is waited for, and the seconds that are left.

    Returns
    -------
    str
        Why the stand is not to be had, with what to do; empty once it is free, or if interrupted.

    Raises
    ------
    DeviceFault
        If the wire fails.
    """
    use = first = look_at_use(controller, most_kN)
    if first is None:
        return ""
    if first.longest_s is None or lives(controller, clock, first):
        return _refusal(first, lives=first.longest_s is not None)
    began_s = said_s = clock.wall_s()
    say(
        f"waits for the controller to come to rest by itself{first.at_most}: {first.what} ({first.shown}); "
        "nothing is written to it meanwhile, Ctrl-C ends the wait"
    )
    left_s = first.longest_s
    end_s = began_s + left_s + RESERVE_S
    while not interrupted():
        now_s = clock.wall_s()
        if use is None:
            say(f"the controller is at rest, and nobody has it, after {now_s - began_s:.0f} s: going on")
            return ""
        if use.writer.feed != first.writer.feed or use.writer.process_lives:
            return _refusal(use, lives=True)
        if now_s > end_s:
            return (
                f"waited {now_s - began_s:.0f} s in vain: {use.what} ({use.shown}); look at the stand, and "
                "whether its controller has a watchdog that runs; if nobody works on it, switch its "
                "hydraulics off and its controller off and on, then start again"
            )
        # Reckoned anew it may be less than at first, never more: it is “at most”, and counts down.
        reckoned_s = max(0.0, end_s - RESERVE_S - now_s)
        left_s = min(left_s, reckoned_s if use.longest_s is None else min(reckoned_s, use.longest_s))
        show(f"waits for the stand ({use.shown})", left_s)
        if now_s - said_s >= SAID_S:
            said_s = now_s
            say(f"  {left_s:.0f} s at most: {use.shown}")
        clock.sleep(LOOK_S)
        use = look_at_use(controller, most_kN)
    return ""


def rests_long(step: PlannedStep) -> bool:
    """Return whether a step only waits at zero force, so long that the valve is switched off meanwhile."""
    return step.only_waits and step.expected_duration_s >= LONG_REST_S


def give_back(controller: Controller, report: SafeStopReport) -> None:
    """Give the right to commands back after a safe stop; one that answers no more drops it by itself."""
    if report.by != "watchdog" or not controller.in_charge:
        with suppress(Exception):  # it is off, and the lock frees itself in time
            controller.give_back()
