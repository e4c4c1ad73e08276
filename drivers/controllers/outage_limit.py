"""How long an outage of a controller's wire may last: by its watchdog, its ring, and the waiting times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from bufferstand.drivers.delivery_rate import FEED_S
from bufferstand.drivers.modbus import HURRY_S, LONGER
from bufferstand.drivers.register_maps import Profile

RESERVE_S = 0.2
"""So much of the watchdog's time is kept for the way of the feed: no later try can be in time [s]."""
_TRIES = 3
"""Waits until a request is given up: for what was asked ahead (or a line to fall silent), and two tries."""


class WatchedSettings(Protocol):
    """What a stand file says of a controller's watchdog."""

    @property
    def watchdog_s(self) -> float:
        """After so long without a heartbeat it stops by itself [s]."""
        ...


@dataclass(frozen=True)
class OutageLimit:
    """How long an outage may last.

    Parameters
    ----------
    watchdog_s : float
        The controller's watchdog [s of the wall].
    silence_s : float
        ``controller_silence_s`` of the guards: without samples for longer is no test [s of the wall].
    ring : bool
        Whether samples wait in the controller: of one that is polled they are lost.
    """

    watchdog_s: float
    silence_s: float
    ring: bool

    @property
    def last_try_s(self) -> float:
        """From the last feed to the last try that can be in time [s of the wall]."""
        return min(self.watchdog_s, self.silence_s) - RESERVE_S

    def longest_s(self, timeout_s: float) -> float:
        """Return the longest outage that is ridden out for certain [s], at whatever moment it begins.

        Parameters
        ----------
        timeout_s : float
            Longest wait for a reply, of the stand file.
        """
        latest_s = min(self.watchdog_s - FEED_S, self.silence_s) - RESERVE_S
        if not self.ring or _TRIES * timeout_s > latest_s:
            return 0.0
        grown_s = HURRY_S + (LONGER - 1.0) * (latest_s - 2.0 * timeout_s)
        return latest_s - min(grown_s, timeout_s)

    def sentence(self, timeout_s: float) -> str:
        """Return what is said of outages before a campaign begins."""
        stops = "a shorter one is asked over, a longer one stops the campaign"
        if not self.ring:
            return (
                f"an outage of the wire is asked over for {timeout_s:g} s at most: this controller keeps no "
                "samples, so a longer one stops the campaign"
            )
        longest_s = self.longest_s(timeout_s)
        if longest_s <= 0.0:
            return (
                f"no outage of the wire longer than {timeout_s:g} s is ridden out: timeout_s = {timeout_s:g} "
                f"leaves no time for it within the watchdog's {self.watchdog_s:g} s; {stops}"
            )
        return (
            f"an outage of the wire of up to {longest_s:.1f} s is ridden out (watchdog "
            f"{self.watchdog_s:g} s): the motion goes on meanwhile within the controller's own limits, and "
            "the guards judge it up to so much later"
        )


def leeway_of(settings: WatchedSettings, profile: Profile, silence_s: float = math.inf) -> OutageLimit:
    """Return the leeway of a controller.

    Parameters
    ----------
    settings : WatchedSettings
        ``[controller]`` of the stand file.
    profile : Profile
        Its register map, which says whether it has a ring.
    silence_s : float
        ``controller_silence_s`` of a campaign [s]; without one the watchdog alone counts.
    """
    return OutageLimit(settings.watchdog_s, silence_s, profile.poll is None)
