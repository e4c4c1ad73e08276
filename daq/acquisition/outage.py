"""Riding out an outage: for a moment the controller is not reached, and goes on by itself meanwhile.

Nobody can send it a stop then anyway. What counts is to be back before its watchdog runs out, to feed it
first, and to have the guards judge every sample that its ring kept. Where the ring lost some, the time is
over, or what is found does not fit what was left, the campaign stops as it would have at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bufferstand.daq.guards import Action, Trip
from bufferstand.drivers import ControllerStatus, MotionState
from bufferstand.drivers.controllers import IN_MOTION, RESERVE_S, OutageLimit

RETRY_S = 0.05
"""From one try to reach the controller to the next at least [s of the wall]."""
READ_S = 2.0
"""So long at most what waits in the ring is read in one go [s of the wall]; the rest comes pass by pass."""
CALM_RETRY_S = 1.0
"""The same where nothing moves and the watchdog's time is over [s of the wall]."""
VALVE_OFF_S = 900.0
"""So long an outage may last while a campaign waits with the valve off, and nothing moves [s of the wall]."""
SAID_EVERY_S = 60.0
"""An outage of minutes is said anew so often [s of the wall]."""
VALVE_OFF = (MotionState.OFF, MotionState.READY, MotionState.FAULT)


@dataclass(frozen=True)
class Outage:
    """An outage under way.

    Parameters
    ----------
    heard_s : float
        When the controller was heard last [s of the wall].
    at : str
        Time of day then.
    before : ControllerStatus or None
        What it was last seen to do.
    samples, lost : int
        Read, and lost, until then.
    commanding : bool
        Whether a command was under way: what was seen before says nothing of it.
    """

    heard_s: float
    at: str
    before: ControllerStatus | None
    samples: int
    lost: int
    commanding: bool = False


class ReachedController(Protocol):
    """What is done with the controller when an outage may be over
    (:class:`bufferstand.daq.acquisition.loop.Acquisition`)."""

    def feed_first(self) -> None:
        """Feed the watchdog now, if this program feeds it."""
        ...

    def read_backlog(self, limit_s: float) -> bool:
        """Read and judge what waits, feeding meanwhile; return False if a guard has tripped."""
        ...

    def look_anew(self) -> ControllerStatus:
        """Read the status and have it judged."""
        ...

    @property
    def overwritten(self) -> int:
        """Samples that the ring lost since the start; cycles that were never taken do not count."""
        ...

    @property
    def seen(self) -> int:
        """Samples read since the start."""
        ...


class OutageHandler:
    """Decides whether an outage is ridden out, and whether what is found behind it fits.

    Parameters
    ----------
    leeway : Leeway
        How long one may last.
    other_writer : callable
        Asks the controller which other program may give commands; 0 or None for none.
    ask_anew : callable
        Sees who answers and what it does, as at a start, and goes on from the newest sample; returns what is
        wrong. For a controller that was not reached for long, valve off.
    time_of_day : callable
        The civil time [s since 1970].
    """

    def __init__(
        self,
        leeway: OutageLimit,
        other_writer: Callable[[], int | None],
        ask_anew: Callable[[], str],
        time_of_day: Callable[[], float],
    ) -> None:
        self.leeway = leeway
        self._other_writer = other_writer
        self._ask_anew = ask_anew
        self._time_of_day = time_of_day
        self.outage: Outage | None = None
        """The one under way."""
        self._waits = self._stopping = self._is_doubted = False
        self._tried_s = self._said_s = 0.0

    def begin(
        self,
        heard_s: float,
        wall_s: float,
        status: ControllerStatus | None,
        reached: ReachedController,
        *,
        commanding: bool,
    ) -> None:
        """Take note of a fault of the wire; the first one begins an outage.

        Parameters
        ----------
        heard_s, wall_s : float
            When the controller was heard last, and now [s of the wall].
        status : ControllerStatus or None
            What it was last seen to do.
        reached : Reached
            What was read until then.
        commanding : bool
            Whether it was told something since that status.
        """
        if self.outage is None:
            began_s = self._time_of_day() - (wall_s - heard_s)
            at = f"{datetime.fromtimestamp(began_s):%H:%M:%S}"  # noqa: DTZ006 - the lab's time of day
            self.outage = Outage(
                heard_s, at, status, reached.seen, reached.overwritten, commanding or self._stopping
            )
            self._said_s = wall_s
        self._tried_s = wall_s

    @contextmanager
    def while_waiting(self) -> Iterator[None]:
        """Inside, the campaign waits and nothing is to move: with the valve off an outage may last long."""
        self._waits = True
        try:
            yield
        finally:
            self._waits = False

    @contextmanager
    def in_safe_stop(self) -> Iterator[None]:
        """Inside, the safe stop gives commands: what was seen before says nothing of what it does."""
        self._stopping = True
        try:
            yield
        finally:
            self._stopping = False

    @property
    def is_out(self) -> bool:
        """Whether an outage is under way that is being ridden out."""
        return self.outage is not None

    @property
    def is_calm(self) -> bool:
        """Whether nothing moves and nothing is to: the valve was off when the controller was heard last."""
        outage = self.outage
        return (
            self._waits
            and outage is not None
            and outage.before is not None
            and outage.before.state in VALVE_OFF
            and not outage.commanding
        )

    def rest_s(self, wall_s: float) -> float:
        """Return how long to wait before the next try [s of the wall]."""
        outage = self.outage
        long = outage is not None and self.is_calm and wall_s - outage.heard_s > self.leeway.last_try_s
        return max(0.0, self._tried_s + (CALM_RETRY_S if long else RETRY_S) - wall_s)

    def over(self, heard_s: float, fed_s: float | None, wall_s: float) -> str:
        """Return why an outage cannot be ridden out any longer, empty while it can.

        Parameters
        ----------
        heard_s : float
            When a sample was heard last [s of the wall].
        fed_s : float or None
            When the watchdog was fed last [s of the wall]; None where this program does not feed it.
        wall_s : float
            Now.
        """
        outage, leeway = self.outage, self.leeway
        if outage is None:
            return ""
        out_s = wall_s - outage.heard_s
        if self.is_calm:
            if out_s <= VALVE_OFF_S:
                return ""
            why = (
                f"not reached for {out_s:.0f} s, {VALVE_OFF_S:g} s at most are waited for with the valve off"
            )
        elif not leeway.ring:
            why = "this controller keeps no samples: those of the outage are lost"
        elif fed_s == -math.inf:
            why = "its watchdog had not been fed yet"
        elif fed_s is not None and wall_s > fed_s + leeway.watchdog_s - RESERVE_S:
            why = f"not fed for {wall_s - fed_s:.1f} s, its watchdog ({leeway.watchdog_s:g} s) acts by itself"
        elif wall_s > heard_s + leeway.silence_s - RESERVE_S:
            why = f"not heard for {wall_s - heard_s:.1f} s (controller_silence_s = {leeway.silence_s:g} s)"
        else:
            return ""
        self.abandon()
        return why

    def abandon(self) -> None:
        """Ride it out no longer."""
        self.outage, self._is_doubted = None, False

    def doubt(self) -> None:
        """Believe nothing that was seen before the outage under way: behind it it is asked as at a start."""
        self._is_doubted = True

    def remark(self, wall_s: float) -> str:
        """Return a line for an outage of minutes, now and then."""
        if self.outage is None or not self.is_calm or wall_s - self._said_s < SAID_EVERY_S:
            return ""
        self._said_s = wall_s
        return (
            f"the controller has not been reached for {wall_s - self.outage.heard_s:.0f} s; the valve was "
            "off and nothing moves: it is asked on"
        )

    def come_back(self, reached: ReachedController, wall_s: Callable[[], float], at_s: float) -> Trip:
        """Try to reach the controller; return what is to be said or done about an outage that is over.

        Raises
        ------
        WireLost
            If it is not over, or the next one begins.
        DeviceFault
            If what answers is not what it was.
        """
        outage = self.outage
        if outage is None:
            raise RuntimeError("no outage is under way")
        late = self._is_doubted or wall_s() - outage.heard_s > self.leeway.last_try_s
        if self.is_calm and late:
            return self._come_back_late(outage, wall_s, at_s)
        reached.feed_first()
        out_s = wall_s() - outage.heard_s
        judged = reached.read_backlog(READ_S)
        if not judged:  # a guard has tripped: the wire belongs to the safe stop
            return self._end(self._note(outage, out_s, reached, at_s))
        lost = reached.overwritten - outage.lost
        why = f"its ring lost {lost} samples in {out_s:.1f} s: the guards were blind" if lost else ""
        why = why or _misfit(outage, reached.look_anew())
        if not why and (writer := self._other_writer()):
            why = f"another program (number {writer}) gives it commands now"
        if not why:
            return self._end(self._note(outage, out_s, reached, at_s))
        return self._end(self._stop(outage, out_s, why, at_s))

    def _come_back_late(self, outage: Outage, wall_s: Callable[[], float], at_s: float) -> Trip:
        """Ask as at a start behind an outage in which the watchdog may have acted; nothing moved."""
        why = self._ask_anew()
        out_s = wall_s() - outage.heard_s
        if why:
            return self._end(self._stop(outage, out_s, why, at_s))
        text = (
            f"{out_s:.0f} s without the controller at {outage.at}, valve off: asked anew as at a start, what "
            "was sampled meanwhile was not read"
        )
        return self._end(Trip("outage", Action.NOTE, text, at_s, value=out_s, unit="s"))

    def _note(self, outage: Outage, out_s: float, reached: ReachedController, at_s: float) -> Trip:
        read, lost = reached.seen - outage.samples, reached.overwritten - outage.lost
        text = (
            f"{out_s:.1f} s without the controller at {outage.at}: {read} samples were read later, "
            f"{lost or 'none'} lost"
        )
        return Trip("outage", Action.NOTE, text, at_s, value=out_s, limit=self.leeway.last_try_s, unit="s")

    @staticmethod
    def _stop(outage: Outage, out_s: float, why: str, at_s: float) -> Trip:
        text = f"{out_s:.1f} s without the controller at {outage.at}, and this campaign cannot go on: {why}"
        return Trip("controller", Action.EMERGENCY, text, at_s, value=out_s, unit="s", device_fault=True)

    def _end(self, trip: Trip) -> Trip:
        self.abandon()
        return trip


def _misfit(outage: Outage, after: ControllerStatus) -> str:
    """Return how the controller does not do what it was left doing, empty if it does.

    Its faults, its watchdog and a limit that ended a motion are said by its own guard.
    """
    before = outage.before
    if before is None or outage.commanding:
        return ""
    if (before.state in VALVE_OFF) != (after.state in VALVE_OFF):
        on_off = "off" if after.state in VALVE_OFF else "on"
        return f"its valve is {on_off} (state {after.state.name.lower()}), and this program did not do that"
    began = before.state is MotionState.HOLDING and after.state in IN_MOTION
    return f"a motion began that this program has not commanded ({after.state.name.lower()})" if began else ""
