"""Compares the two force channels at rest, where the instants need not agree to 10 ms.

On a simulated stand that runs faster than the wall both clocks may differ by up to a second of its time (a
starved reader, times the speed). Where both have stood for two seconds they show the same force all the same.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from bufferstand.daq.guards.wiring.forces.jumped_channel import ChannelJump
from bufferstand.daq.guards.wiring.forces.track import ForceTrack, has_hole

REST_S, EVERY_S = 2.0, 0.5
"""Over so long both stand; so often it is looked [s of the stand]."""
MOVES_KN, MOVES_SHARE, MOST_KN = 0.6, 0.01, 4.0
"""From the first half to the second each goes on by less than this and this share, noise and hum within this:
a creeping force is, a second apart, still the same."""
BACK_S = 10.0
"""A rest is compared with those of so long before it [s]: an amplifier that warms up does not count."""
OTHER_SHARE = 0.4
"""Of two forces that part from rest to rest the one has moved by no more than this share of the other."""


@dataclass(frozen=True)
class ForceRest:
    """What both showed in the mean while they stood, until an instant of the host [s, kN]."""

    at_s: float
    first_kN: float
    second_kN: float


class Rests:
    """Remembers the rests of the last seconds."""

    def __init__(self) -> None:
        self._kept: deque[ForceRest] = deque()
        self._due_s = -np.inf

    def look(self, first: ForceTrack, second: ForceTrack, until_s: float) -> ForceRest | None:
        """Return the rest that both have come to; None where they move, or where it was looked just now.

        Parameters
        ----------
        first, second : Track
        until_s : float
            Newest instant that both have [s].
        """
        if self._due_s - 2.0 * BACK_S < until_s < self._due_s:
            return None
        self._due_s = until_s + EVERY_S
        means = [_stands_at_kN(track, until_s) for track in (first, second)]
        if means[0] is None or means[1] is None:
            return None
        rest = ForceRest(until_s, means[0], means[1])
        while self._kept and not 0.0 < until_s - self._kept[0].at_s < BACK_S:
            self._kept.popleft()
        self._kept.append(rest)
        return rest

    def parted(self, rest: ForceRest, least_kN: float, share: float) -> ChannelJump | None:
        """Return which force has left the other one since a rest before; None where neither has.

        Parameters
        ----------
        rest : Rest
            The newest one.
        least_kN, share : float
            They part by more than this and this share of what the force has changed by.
        """
        for before in self._kept:
            one, two = rest.first_kN - before.first_kN, rest.second_kN - before.second_kN
            small, large = sorted((abs(one), abs(two)))
            if abs(two - one) > least_kN + share * large and small < OTHER_SHARE * large:
                name, size_kN, from_kN = (
                    ("force", one, before.first_kN)
                    if abs(one) > abs(two)
                    else ("force_2", two, before.second_kN)
                )
                return ChannelJump(name, size_kN, rest.at_s, from_kN)
        return None


def _stands_at_kN(track: ForceTrack, until_s: float) -> float | None:  # noqa: N802 - the unit keeps its capital
    """Return the mean of a force over the last :data:`REST_S`; None where it moves or has a hole there."""
    samples, begin_s = track.samples(), until_s - REST_S
    if samples[0, 0] > begin_s or has_hole(samples, begin_s, until_s):
        return None
    time_s, value = samples[:, (samples[0] >= begin_s) & (samples[0] <= until_s)]
    late = time_s > until_s - 0.5 * REST_S
    if not late.any() or late.all() or float(np.ptp(value)) > MOST_KN:
        return None
    mean_kN = float(np.mean(value))
    moved_kN = abs(float(np.mean(value[late])) - float(np.mean(value[~late])))
    return mean_kN if moved_kN < MOVES_KN + MOVES_SHARE * abs(mean_kN) else None
