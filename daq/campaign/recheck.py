"""Checks the stand as at a start, within a campaign that waits with the valve off.

Nothing that was seen before is believed.

So after a sleep of the computer, a start of the controller, or an outage of minutes.
"""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.daq.acquisition import VALVE_OFF_S, Acquisition
from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.guards.kinds import WATCHDOG_FAULT, fault_text
from bufferstand.drivers import ControllerStatus, Identity
from bufferstand.foundation import DeviceFault, NotInCharge, WireLost

_WRAP_S = 2**32 * 1e-6
"""A controller's clock of microseconds begins again after so long [s]."""
CLOCK_OFF_S = 1.0
CLOCK_SHARE = 1e-3
"""A controller's clock that is off by more than this, and this share of the time, was started anew."""


class StandRecheck:
    """Looks at the stand anew, and takes it again.

    Parameters
    ----------
    acquisition : Acquisition
        Whose controller it is.
    identity : Identity
        Who answered at the start.
    free_trouble : callable
        Waits for what a killed program has left; returns why the stand is not to be had.
    """

    def __init__(self, acquisition: Acquisition, identity: Identity, free_trouble: Callable[[], str]) -> None:
        self._acquisition = acquisition
        self._identity = identity
        self._free_trouble = free_trouble
        self.doubt_zero: Callable[[str], object] = lambda _: None
        """Told why the zero may be none any more."""
        self.leave: Callable[[str], object] = lambda _: None
        """Told why what answers is not this program's to stop."""

    def look(self) -> str:
        """See who answers, that nobody else has the stand, what it does; take the lock, go on from now.

        Only the number of this program is written. What changed meanwhile is said.

        Returns
        -------
        str
            Why the campaign cannot go on; empty where it can.

        Raises
        ------
        DeviceFault
            If the wire fails, or what answers is not what the profile describes.
        """
        acquisition, controller = self._acquisition, self._acquisition.stand.controller
        unseen_s = acquisition.clock.wall_s() - acquisition.continuity.seen_last_s
        now = controller.connect()
        if other := differs(self._identity, now):
            acquisition.feeding = False  # it is not this program's
            self.leave(
                f"another controller answers ({other}), and the one that this program moved is NOT SEEN: "
                "look at its stand before anyone goes near it"
            )
            return (
                f"another controller answers at {now.address} than before the wait; see which controller "
                "moves the stand"
            )
        if why := self._free_trouble():
            acquisition.feeding = False
            self.leave("it is not this program's to stop")
            return why
        status = controller.status()
        if status.fault_code not in (0, WATCHDOG_FAULT):
            return f"it reports {fault_text(status.fault_code)} since; look at its own messages"
        controller.take_charge()
        restarted = self._restarted(status) or self._goes_on_elsewhere()
        if restarted:
            controller.skip_backlog(anew=True)
            self._say("the controller was started anew meanwhile; by its serial number it is the same one")
        if changed := controller.changed_limits():
            self._say(f"its limits are no longer those that were set ({changed}); set again before it moves")
        acquisition.begin_anew()
        if restarted:
            self.doubt_zero("the controller was started anew")
        elif unseen_s > VALVE_OFF_S:
            self.doubt_zero(f"nobody looked at the stand for {unseen_s / 60.0:.0f} min")
        return ""

    def _goes_on_elsewhere(self) -> bool:
        """Go on from the newest sample; return whether the samples are not those that come next."""
        try:
            self._acquisition.stand.controller.skip_backlog()
        except (WireLost, NotInCharge):
            raise
        except DeviceFault:  # a controller without a clock that was started anew
            return True
        return False

    def _restarted(self, status: ControllerStatus) -> bool:
        """Return whether the controller does not count on from where it was."""
        acquisition, before = self._acquisition, self._acquisition.latest.status
        device_us, passed_s = acquisition.last_sample
        if status.tick_us is None or device_us is None or acquisition.waited_for:  # that one stood still, too
            return before is not None and status.done_sequence != before.done_sequence
        counted_s = (status.tick_us - device_us) * 1e-6
        off_s = (counted_s - passed_s + 0.5 * _WRAP_S) % _WRAP_S - 0.5 * _WRAP_S
        return abs(off_s) > CLOCK_OFF_S + CLOCK_SHARE * passed_s

    def _say(self, text: str) -> None:
        at_s = self._acquisition.clock.now_s()
        self._acquisition.panel.latch(Trip("anew", Action.NOTE, text, at_s))


def differs(before: Identity, now: Identity) -> str:
    """Return in what the controller that answers is not the one before; empty if it is the same."""
    told = {
        "serial number": (before.serial, now.serial),
        "device": (before.device, now.device),
        "register profile": (before.profile, now.profile),
        "sample rate": (f"{before.sample_rate_Hz:g} Hz", f"{now.sample_rate_Hz:g} Hz"),
    }
    return "; ".join(f"{what} {new}, before it was {old}" for what, (old, new) in told.items() if new != old)
