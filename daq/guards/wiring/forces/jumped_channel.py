"""Two force channels that agreed and no longer do: which of them has changed.

The specimen's force goes on without a break where its stroke does. So the one that jumps from one sample to
the next, or shows one value to the last digit while the other one changes, is the wrong one, whatever the
specimen is. Only where neither is seen its expected curve is asked, and only where that is decisive: right
specimens are 40 % off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.wiring.forces.track import GRID_S, ForceMeans, ForceTrack

Floats = NDArray[np.float64]

FROZEN_S, FROZEN_SAMPLES = 0.4, 8
"""So long, and so many samples, a force must show one value to be frozen while the other one changes."""
NEVER_KN = 12.0
"""… by this where it has shown one value from the beginning on."""
MARGIN_S = 0.1
"""The clocks of both differ by less [s]."""
CHANGED_KN, CHANGED_SAID_KN, CHANGED_STEPS = 3.0, 1.0, 3.0
"""… by this (less where something else says already that they part), and by so many counts of the one that
stands."""
BROKEN_KN, BROKEN_TIMES = 1.5, 1.5
"""Both part at once by this at least, and by so many times what they do elsewhere."""
NEAR_S = 0.12
"""A jump is looked for so near to where they part [s]."""
MET_KN, MET_S = 3.0, 0.2
"""… and not where one of both is nearer to nothing than this within so long: there the specimen is met or
left."""
STEPS = (1, 2, 4, 8)
"""… over so many samples: an amplifier's filter takes some."""
OF_SIZE, SIGMAS = 0.4, 6.0
"""A jump has its size within this share, and is so many times the scatter; the other force has no more than
this share of it there: what the specimen does both show."""
LASTS_S, NEWEST_S, STANDS_OUT = 0.25, 0.7, 3.0
"""A jump that nothing else has said lasts so long, is no older than this, and so many times what both part by
elsewhere."""
NO_WORSE, NO_WORSE_KN = 1.1, 0.1
"""A delay explains a jump only if both part elsewhere by no more with it than without."""
DECISIVE = 0.5
"""One is that much nearer to the expected force than the other, in the logarithm of the ratio: more than a
specimen that is 40 % off makes."""


@dataclass(frozen=True)
class ChannelJump:
    """A force that left the other one at once.

    Parameters
    ----------
    name : str
        Its channel.
    size_kN : float
        By so much.
    at_s : float
        When, on the host's clock.
    from_kN : float
        What both showed before.
    """

    name: str
    size_kN: float
    at_s: float
    from_kN: float


@dataclass(frozen=True)
class ChannelStandstill:
    """A force that shows one value while the other one changes [kN], for so long [s]."""

    name: str
    for_s: float
    other_kN: float


def standstill(
    one: ForceTrack, other: ForceTrack, names: tuple[str, str], *, sure: bool = True
) -> ChannelStandstill | None:
    """Return whether the first of two forces stands still while the second one changes, None if not.

    Holes of the one do not matter: it stands from one sample to the next, however far they are apart.

    Parameters
    ----------
    one, other : Track
    names : (str, str)
    sure : bool
        Whether nothing else has said yet that they part: then it takes :data:`FROZEN_S`.
    """
    since_s, count = one.stands
    for_s = one.newest_s - since_s
    least_s, least_kN = (FROZEN_S, CHANGED_KN) if sure else (2.0 * MARGIN_S, CHANGED_SAID_KN)
    if count < FROZEN_SAMPLES or for_s < least_s:
        return None
    if not np.isfinite(one.least_step_kN):  # it never showed how fine its counts are
        least_kN = NEVER_KN
    time_s, force_kN = other.samples()
    within = (time_s > since_s + 0.5 * MARGIN_S) & (time_s < one.newest_s - 0.5 * MARGIN_S)
    if np.count_nonzero(within) < 3:
        return None
    changed_kN = float(np.ptp(np.quantile(force_kN[within], (0.02, 0.98))))  # less its noise
    count_kN = one.least_step_kN if np.isfinite(one.least_step_kN) else 0.0
    if changed_kN < max(least_kN, CHANGED_STEPS * count_kN):
        return None
    return ChannelStandstill(names[0], for_s, changed_kN)


def jump(first: ForceTrack, second: ForceTrack, time: Floats, one: Floats, two: Floats) -> ChannelJump | None:
    """Return which of both left the other at once, None where neither did, or both.

    Parameters
    ----------
    first, second : Track
        Of ``force`` and ``force_2``.
    time, one, two : NDArray, shape (n,)
        Both on one grid of :data:`bufferstand.daq.guards.wiring.forces.track.GRID_S`.
    """
    apart = two - one
    if len(apart) < 20:
        return None
    steps = _steps(apart)
    at = int(np.argmax(np.abs(steps)))
    size_kN = float(steps[at])
    if abs(size_kN) < max(BROKEN_KN, BROKEN_TIMES * _elsewhere(steps, at)):
        return None
    return _of_one(first, second, at_s=float(time[at]), by_kN=size_kN, before=(one, two), at=at)


def fresh_jump(
    first: ForceTrack, second: ForceTrack, time: Floats, one: Floats, two: Floats, *, least_kN: float
) -> ChannelJump | None:
    """Return which of both has left the other at once a moment ago, and stays away by ``least_kN`` [kN].

    The other parameters are those of :func:`jump`.
    """
    apart, lasts, newest = two - one, round(LASTS_S / GRID_S), round(NEWEST_S / GRID_S)
    if len(apart) < 2 * newest:
        return None
    steps = _steps(apart)
    at = len(apart) - newest + int(np.argmax(np.abs(steps[-newest:-lasts])))
    size_kN = float(steps[at])
    if abs(size_kN) < max(least_kN, STANDS_OUT * _elsewhere(steps, at)):
        return None
    stays_kN = float(np.median(apart[at + 3 :]) - np.median(apart[at - lasts : at - 2]))
    if abs(stays_kN - size_kN) > OF_SIZE * abs(size_kN):
        return None
    return _of_one(first, second, at_s=float(time[at]), by_kN=size_kN, before=(one, two), at=at)


def made_by_delay(broke: ChannelJump, means: ForceMeans, time: Floats, two: Floats, lags_s: Floats) -> bool:
    """Return whether a jump is a turn of the force that comes later in one of both, and no jump.

    Parameters
    ----------
    broke : Jump
    means : Means
        Of ``force``.
    time, two : NDArray, shape (n,)
        ``force_2`` on the grid.
    lags_s : NDArray
        Delays that are no doubt, of force_2 behind force [s].
    """
    at = int(np.argmin(np.abs(time - broke.at_s)))
    near = slice(max(0, at - 3), at + 4)  # a jump of ``force`` is moved with it
    most_kN = NO_WORSE * _elsewhere(_steps(two - means.at(time)), at) + NO_WORSE_KN
    for lag_s in lags_s:
        steps = _steps(two - means.at(time - lag_s))
        gone = float(np.max(np.abs(steps[near]))) < (1.0 - OF_SIZE) * abs(broke.size_kN)
        if gone and _elsewhere(steps, at) < most_kN:
            return True
    return False


def _steps(apart: Floats) -> Floats:
    """Return by how much two forces part from the two points before each one to the two behind it [kN]."""
    mean = 0.5 * (apart[:-1] + apart[1:])
    steps = np.zeros(len(apart))
    steps[2:-2] = mean[3:] - mean[:-3]
    return steps


def _elsewhere(steps: Floats, at: int) -> float:
    return float(
        np.quantile(np.abs(np.delete(steps, np.arange(max(0, at - 5), min(len(steps), at + 6)))), 0.9)
    )


def _of_one(
    first: ForceTrack,
    second: ForceTrack,
    *,
    at_s: float,
    by_kN: float,
    before: tuple[Floats, Floats],
    at: int,
) -> ChannelJump | None:
    """Return the jump by the samples of the one that has it, None where they do not show it in one alone.

    Where the specimen's preload is met or left the force jumps in truth: one that is late does not, there.
    """
    about = slice(max(0, at - round(MET_S / GRID_S)), at + round(MET_S / GRID_S))
    if min(float(np.min(np.abs(own[about]))) for own in before) < MET_KN:
        return None
    tracks = (("force", first, -by_kN, before[0]), ("force_2", second, by_kN, before[1]))
    breaks = [_break(track.samples(), at_s, kN) for _, track, kN, _ in tracks]
    found = [
        ChannelJump(name, kN, at_s, float(own[max(0, at - round(MARGIN_S / GRID_S))]))
        for (name, _, kN, own), here, there in zip(tracks, breaks, reversed(breaks), strict=True)
        if any(
            sharp and quiet < OF_SIZE * abs(kN) for (sharp, _), (_, quiet) in zip(here, there, strict=True)
        )
    ]
    return found[0] if len(found) == 1 else None


def _break(samples: Floats, at_s: float, by_kN: float) -> list[tuple[bool, float]]:
    """Return for each width of :data:`STEPS` whether samples break by so much near a time, and the most that
    they break there by [kN]; infinitely much where they do not show it."""
    time_s, value = samples
    recent = time_s > at_s - 1.5
    time_s, value = time_s[recent], value[recent]
    found = []
    even_s = 3.0 * float(np.median(np.diff(time_s))) if len(time_s) > 2 else 0.0
    sums = np.concatenate(([0.0], np.cumsum(value)))
    for m in STEPS:
        if len(value) < 12 * m + 20:
            found.append((False, np.inf))
            continue
        # The mean of m samples less that of the m before, less what it is two such ways before and behind.
        means = (sums[m:] - sums[:-m]) / m
        step, takes_s = means[m:] - means[:-m], time_s[2 * m - 1 :] - time_s[: 1 - 2 * m]
        own = step[2 * m : -2 * m] - 0.5 * (step[: -4 * m] + step[4 * m :])
        takes_s, middle = takes_s[2 * m : -2 * m], time_s[3 * m : 3 * m + len(own)]
        near = (takes_s < 2 * m * even_s) & (np.abs(middle - at_s) < NEAR_S)
        if not near.any():
            found.append((False, np.inf))
            continue
        scatter_kN = 1.4826 * float(np.median(np.abs(own)))
        most = float(own[near][int(np.argmax(np.abs(own[near])))])  # half of it is beside it, the other way
        sharp = abs(most - by_kN) < OF_SIZE * abs(by_kN) and abs(most) > SIGMAS * scatter_kN
        found.append((sharp, abs(most)))
    return found


def farther(first_kN: float, second_kN: float, right_kN: float | None) -> str:
    """Return which force is farther from what is expected; both where that is not decisive.

    Parameters
    ----------
    first_kN, second_kN : float
    right_kN : float or None
        What is expected; None where nothing is.
    """
    both = "force, force_2"
    if right_kN is None or right_kN < 1.0:
        return both
    one, two = (abs(float(np.log(max(kN, 1e-3) / right_kN))) for kN in (first_kN, second_kN))
    if abs(one - two) < DECISIVE:
        return both
    return "force" if one > two else "force_2"
