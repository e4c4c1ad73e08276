"""The effect of noise on a largest speed: the largest of many noisy readings is too large.

By how much depends on how flat the speed is there and on the correlation of the noise. It is found by
simulation: noise of the record's own density is added to the smoothed branch, and the speed is read from it
as from the record (JCGM 101, 5.9).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Loop
from bufferstand.evaluation.numerics import FloatArray, moving_slopes
from bufferstand.evaluation.quantities import SPEED_WINDOW
from bufferstand.evaluation.uncertainty.noise import Spectrum

TRIALS = 32
_SEED = 15_551

_SMOOTH_SAMPLES = 9.0
_MOST_SMOOTH = 0.3
"""The noise of a speed is smoothed away over so many samples, and twice the window that it is read from, but
over no more of the branch than this share."""
_BY_NOISE, BY_NOISE_AT_ENDS = 4.0, 12.0
"""The largest of some hundred readings is so many standard deviations too large at most: a speed that is no
larger than the same one smoothed over all of that share is even, but for noise. At its end a parabola's slope
has four times the noise."""
LEAST_WINDOW = 5
_BENT_OVER = 0.1
"""How a speed bends at its peak is read over this share of the branch to both sides."""


class SpeedBias(NamedTuple):
    """By how much an extreme is too large on average, and how it scatters."""

    mean: float = 0.0
    scatter: float = 0.0


def _odd(points: float, most: int) -> int:
    return min(2 * int(0.5 * points) + 1, most - 1 + most % 2)


def _window(share: float, count: int) -> int:
    return max(LEAST_WINDOW, 2 * int(0.5 * share * count) + 1)


def _made(noise: Spectrum, loop: Loop, part: slice, generator: np.random.Generator) -> FloatArray:
    """Return made noise at the points of a branch, shape (T, M)."""
    time_s = loop.time_s[part]
    step_s = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    made = noise.series(generator, TRIALS, time_s.size + 1, step_s)
    # A speed is read on even moments, between which samples lie somewhere.
    share = generator.random((TRIALS, 1))
    return made[:, :-1] + share * np.diff(made, axis=1)


def speed_lean(loop: Loop, part: slice, samples: float, noise: Spectrum, number: int = 0) -> SpeedBias:
    """Return what noise and the window make of the largest speed of a branch [mm/s].

    Over h points to both sides a parabola reads v + v″ (3 h² + 3 h - 1) / 30, which is too little at a peak.

    Parameters
    ----------
    loop : Loop
    part : slice
        The branch.
    samples : float
        Samples of the cycle.
    noise : Spectrum
        Of the stroke.
    number : int
        Of the cycle: each is tried with noise of its own, lest the chance of a few trials be common to all.
    """
    time_s, stroke = loop.time_s[part], loop.stroke_mm[part]
    window = _window(SPEED_WINDOW, stroke.size)
    if stroke.size < window:
        return SpeedBias()
    step_s = float(time_s[-1] - time_s[0]) / (stroke.size - 1)
    count = np.array([stroke.size])
    sign = 1.0 if stroke[-1] > stroke[0] else -1.0
    points = max(2.0 * window, _SMOOTH_SAMPLES * loop.time_s.size / samples)
    wide = max(window, _odd(min(points, _MOST_SMOOTH * stroke.size), stroke.size))
    speed = sign * moving_slopes(stroke[None], count, wide)[0] / step_s
    generator = np.random.default_rng((_SEED, number))
    made = _made(noise, loop, part, generator)
    slopes = moving_slopes(made, np.full(TRIALS, stroke.size), window) / step_s
    widest = _odd(_MOST_SMOOTH * stroke.size, stroke.size)
    if widest > wide:
        even = sign * moving_slopes(stroke[None], count, widest)[0] / step_s
        # What noise is left in the speed has peaks of its own, beside which that of a trial leans too little.
        half = window // 2
        noise_left = float(np.std(slopes[:, half:-half])) * (window / wide) ** 1.5
        inner, whole = float(np.max(speed[wide // 2 : -(wide // 2)])), float(np.max(speed))
        if max(inner, whole - BY_NOISE_AT_ENDS * noise_left) - np.max(even) <= _BY_NOISE * noise_left:
            speed, wide = even, widest
    noisy = speed + slopes
    over = np.max(noisy, axis=1) - np.max(speed)
    blunted = _bend(speed, wide) * _spread(window, loop.averaged)
    return SpeedBias(float(np.mean(over)) - blunted, float(np.std(over)))


def _spread(window: int, averaged: int) -> float:
    """Return what a reading lacks of the peak of a speed, in its fall over one point to both sides, doubled.

    By the window, h points to both sides; by straight lines between the points, which lie anywhere to the
    even moments, 1/12 on average; and by points that are means.
    """
    half = 0.5 * (window - 1)
    return (3.0 * half**2 + 3.0 * half - 1.0) / 30.0 + 1.0 / 12.0 + (1.0 - 1.0 / averaged**2) / 24.0


def _bend(speed: FloatArray, wide: int) -> float:
    """Return how a speed bends at its peak, -v″ by point, seen over a wide window; 0 where it does not."""
    away = max(wide, int(_BENT_OVER * speed.size))
    at = int(np.clip(np.argmax(speed), away, speed.size - 1 - away))
    if not away <= at < speed.size - away:
        return 0.0
    falls = speed[at] - 0.5 * (speed[at - away] + speed[at + away])
    return max(0.0, float(falls)) * 2.0 / away**2
