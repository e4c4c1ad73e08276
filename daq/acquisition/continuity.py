"""Whether this program sees the controller without a break, and what it does behind one.

A break is a pause of this program, an outage of the wire, a controller that does not go on as it did, or
another program that has the stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from bufferstand.daq.acquisition.outage import OutageHandler, ReachedController
from bufferstand.daq.acquisition.suspend_check import ProgramSuspended, SuspendWatch
from bufferstand.daq.guards import Action, GuardPanel, Trip
from bufferstand.daq.guards.kinds import PAUSE_S
from bufferstand.drivers import Controller, ControllerStatus
from bufferstand.foundation import Clock, DeviceFault, NotInCharge, WireLost

ASK_AGAIN_S = 1.0
"""So often it is asked whether another program still has the controller [s of the wall]."""


class BreakHandler(ReachedController, Protocol):
    """What a break does to the one who reads (:class:`bufferstand.daq.acquisition.loop.Acquisition`)."""

    feeding: bool

    @property
    def waited_for(self) -> bool:
        """Whether the stand waits for its reader: it stands still while this program does."""
        ...

    @property
    def status(self) -> ControllerStatus | None:
        """The last snapshot."""
        ...

    @property
    def was_told(self) -> bool:
        """Whether the controller was told something since the last look at its status."""
        ...

    @property
    def fed_s(self) -> float:
        """When its watchdog was fed last [s of the wall]."""
        ...

    def fall_behind(self) -> None:
        """Hold that samples are unread."""
        ...


class Continuity:
    """Knows of breaks in what is seen of the controller, and decides what follows from them.

    Parameters
    ----------
    reads : Watched
        The acquisition.
    controller : Controller
        What it reads.
    clock : Clock
        Stand time.
    panel : GuardPanel
        Where reasons to stop are latched.
    """

    def __init__(self, reads: BreakHandler, controller: Controller, clock: Clock, panel: GuardPanel) -> None:
        self._reads = reads
        self._controller = controller
        self._clock = clock
        self._panel = panel
        self.awake = SuspendWatch(clock.wall_s())
        """Notices that this program stood still; knows what a wait with the valve off does then."""
        self.rides: OutageHandler | None = None
        """Decides how long an outage is ridden out; without it a lost wire is a reason to stop at once."""
        self.was_silent = False
        """Whether the controller gave no reply in this pass."""
        self.hands_off = False
        """Whether another program has the controller, whose samples are that one's then."""
        self._ask_again_s = -np.inf
        self._heard_s = self._seen_last_s = clock.wall_s()

    @property
    def seen_last_s(self) -> float:
        """Return when samples of the controller were asked for last with success [s of the wall]."""
        return self._seen_last_s

    def heard(self) -> None:
        """Take that samples were asked for with success."""
        self._heard_s = self._seen_last_s = self._clock.wall_s()

    def begin_anew(self) -> None:
        """Go on as at a start, once the stand is taken again."""
        self.hands_off = False
        self.heard()

    @contextmanager
    def answered_for(self) -> Iterator[None]:
        """Let what is done with the controller in here end in a reason to stop, not in an exception.

        A pause in a wait is followed by a new look at the stand, and an outage may be ridden out.
        """
        try:
            yield
        except ProgramSuspended as still:
            self._wake(still)
        except DeviceFault as fault:
            self._take_fault(fault)

    def _wake(self, still: ProgramSuspended) -> None:
        self._go_on_anew(str(still), still.for_s, short=still.short)

    def see_pause(self, most_s: float, *, look: bool = True) -> None:
        """See whether this program stood still: nothing that it does takes longer than ``most_s`` [s].

        Where the stand is switched on, what it does is seen before anything else is done to it, unless it is
        being looked at (``look``): a fault that is found then comes of the pause, and says so.

        Raises
        ------
        StoodStill
            If so, in a wait.
        DeviceFault
            If the wire fails, or the right to give commands was lost meanwhile.
        """
        wall_s = self._clock.wall_s()
        if not (still_s := self.awake.look(wall_s, most_s)):
            if not self.awake.explains(wall_s):
                self._panel.explained_by = ""
            return
        if self.awake.waits:
            raise ProgramSuspended(still_s)
        if self._reads.waited_for:  # it stood still as well
            return
        self._panel.explained_by = (
            f"this program stood still for {still_s:.1f} s (suspended computer, debugger, overloaded machine)"
        )
        if look and self._reads.feeding and self._controller.in_charge and not self.is_cut_off:
            self._reads.look_anew()
            self._controller.look_at_lock()

    def see_pause_in_call(self, *, look: bool = True) -> None:
        """See whether this program stood still within a call to the controller that succeeded.

        In a wait with the valve off a call that took long starts every silence anew, whether it was the
        wire's or a pause too short to tell: the controller has answered, and nothing moves.
        """
        long = self.awake.waits and self.awake.since_s(self._clock.wall_s()) > PAUSE_S
        self.see_pause(self.awake.longest_call_s, look=look)
        if long:
            self._panel.begin_anew(self._clock.wall_s())

    def _go_on_anew(self, why: str, slept_s: float = 0.0, *, short: str = "") -> None:
        """In a wait with the valve off: look at the stand as at a start, take it again, and say so.

        ``short`` is said for ``why`` where the reason that it cannot be taken follows.
        """
        rides, clock = self.rides, self._clock
        if self.awake.take_anew is None:
            raise RuntimeError("nobody can look at the stand anew")
        if slept_s:  # an outage is counted from now on, and so is every silence
            self._heard_s = clock.wall_s()
        self._panel.begin_anew(clock.wall_s())
        try:
            trouble = self.awake.take_anew()
        except WireLost as lost:
            self._panel.latch(Trip("anew", Action.NOTE, f"{why}; it is not reached yet", clock.now_s()))
            if self.lose(lost) and rides is not None:
                rides.doubt()
            return
        except DeviceFault as fault:
            trouble = str(fault)
        finally:
            self.awake.look(clock.wall_s(), 0.0)
        if trouble:
            self.hands_off = True
            self._latch_fault(f"{short or why}; the stand cannot be taken again: {trouble}")
            return
        self._panel.expect_valve(False)
        text = f"{why}: the stand was looked at as at a start, and taken again; the wait goes on"
        self._panel.latch(
            Trip("anew", Action.NOTE, text, clock.now_s(), value=slept_s or None, unit="s" if slept_s else "")
        )

    def _take_fault(self, fault: DeviceFault) -> None:
        """Let a fault of the controller or its wire be a reason to stop, unless an outage is ridden out."""
        try:
            self.see_pause(self.awake.longest_call_s, look=False)
        except ProgramSuspended as still:
            self._wake(still)
            return
        if isinstance(fault, WireLost) and self.lose(fault):
            return
        if not isinstance(fault, NotInCharge):
            if self._goes_on_behind(fault):
                return
            self._latch_fault(f"the controller or its wire failed: {fault}")
            return
        self.hands_off = self._another_has_it()
        if self.awake.lock_lost is None:
            self._latch_fault(f"the right to give commands was lost: {fault}")
        elif self.hands_off or not self._goes_on_behind(fault):
            self._panel.cut_off = self.hands_off
            self._panel.expect_valve(None)
            self.awake.lock_lost(fault)

    def _goes_on_behind(self, fault: DeviceFault) -> bool:
        """Return whether a controller that does not go on as it did is taken anew, as behind its restart."""
        if not self.awake.may_take_anew(self._clock.wall_s()):
            return False
        self._go_on_anew(f"the controller does not go on as it did ({fault})")
        return True

    def _another_has_it(self) -> bool:
        """Return whether another program has the controller, whose samples are that one's then."""
        try:
            return bool(self._controller.other_writer())
        except DeviceFault:
            return True

    def has_it_back(self) -> bool:
        """Return whether nobody else has the controller any more, asked now and then; then go on from now."""
        wall_s = self._clock.wall_s()
        if wall_s < self._ask_again_s:
            return False
        self._ask_again_s = wall_s + ASK_AGAIN_S
        another = self._another_has_it()
        self.see_pause(self.awake.longest_call_s, look=False)
        if another:
            return False
        if self.awake.waits:
            self._go_on_anew("nobody else gives the controller commands any more")
            return not self.hands_off
        self._controller.skip_backlog()
        self.hands_off = self._panel.cut_off = False
        self._panel.came_back(self._clock.wall_s())
        return True

    def _latch_fault(self, reason: str) -> None:
        now_s = self._clock.now_s()
        self._panel.latch(Trip("controller", Action.EMERGENCY, reason, now_s, device_fault=True))

    @property
    def is_cut_off(self) -> bool:
        """Return whether an outage is under way that is being ridden out; each pass tries to end it."""
        return self.rides is not None and self.rides.is_out

    def lose(self, lost: WireLost) -> bool:
        """Take a request that got no true reply; return whether the outage is ridden out.

        Where it cannot be (any longer) it is latched as a reason to stop.
        """
        rides, wall_s = self.rides, self._clock.wall_s()
        self.was_silent = True
        self._reads.fall_behind()
        if rides is None:
            return False
        told = self._reads.was_told and not self.awake.waits  # in a wait with the valve off nothing is told
        rides.begin(self._heard_s, wall_s, self._reads.status, self._reads, commanding=told)
        if remark := rides.remark(wall_s):
            self._panel.latch(Trip("outage", Action.NOTE, remark, self._clock.now_s()))
        why = rides.over(self._heard_s, self._reads.fed_s if self._reads.feeding else None, wall_s)
        if why:
            self._latch_fault(f"the controller or its wire failed: {lost}; {why}")
        self._panel.cut_off = rides.is_out
        return True

    def come_back(self) -> None:
        """Try to end an outage: feed, read and judge what waited, see that all fits."""
        rides, clock = self.rides, self._clock
        if rides is None or not rides.is_out:
            return
        rest_s = rides.rest_s(clock.wall_s())
        clock.sleep(rest_s)
        self.see_pause(PAUSE_S + rest_s)
        self.was_silent = True
        try:
            trip = rides.come_back(self._reads, clock.wall_s, clock.now_s())
        except WireLost:
            raise
        except DeviceFault:
            rides.abandon()
            self._panel.cut_off = False
            raise
        self.awake.look(clock.wall_s(), 0.0)  # it may have waited for a killed program's stand
        self._panel.came_back(clock.wall_s())
        self._panel.latch(trip)
