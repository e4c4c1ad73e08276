"""How far a guard is from its trip, as its own memory has it: what the monitor shows of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bufferstand.daq.guards.trips import Action

SHOWN_S = 10
"""Extremes of so long count [s of stand time]: a peak is to be read before it is gone."""


@dataclass(frozen=True)
class Margin:
    """One guard on the screen.

    Parameters
    ----------
    name, label : str
        The guard, and how a person calls it.
    text : str
        Value, limit and distance in words; what it watches for where there is no number.
    share : float or None
        How much of the way to the trip is used: 0 none, 1 tripped.
    action : Action
        What its trip leads to.
    """

    name: str
    label: str
    text: str
    share: float | None
    action: Action

    def as_dict(self) -> dict[str, object]:
        """Return it as data of a packet, which holds numbers only."""
        share = self.share if self.share is not None and math.isfinite(self.share) else None
        return vars(self) | {"share": share, "action": self.action.name.lower()}


@dataclass(frozen=True)
class Peaks:
    """Least and greatest value of a signal in each of the last ``SHOWN_S`` seconds that it had one in."""

    seconds: tuple[tuple[int, float, float], ...] = ()

    def seen(self, at_s: float, low: float, high: float) -> Peaks:
        """Return them with the extremes of a block [stand time in s; unit of the signal]."""
        second = math.floor(at_s)
        if self.seconds and self.seconds[-1][0] == second:
            _, least, greatest = self.seconds[-1]
            if least <= low and high <= greatest:  # nearly always
                return self
            return Peaks((*self.seconds[:-1], (second, min(least, low), max(greatest, high))))
        kept = (one for one in self.seconds if 0 <= second - one[0] < SHOWN_S)
        return Peaks((*kept, (second, low, high)))

    def span(self) -> tuple[float, float] | None:
        """Return the least and the greatest of all, None where nothing was seen."""
        if not self.seconds:
            return None
        return min(low for _, low, _ in self.seconds), max(high for _, _, high in self.seconds)
