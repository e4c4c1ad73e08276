"""Uncertainty of an extreme of a run: errors of its channel, and noise that makes it overreach."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import erfc, log, sqrt

import numpy as np

from bufferstand.evaluation.loops import overreach
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.run.extremes.speeds import SpeedPeak
from bufferstand.evaluation.uncertainty import (
    Draws,
    expanded,
    half_width_95,
    stroke_error_mm,
    stroke_term_slopes,
)
from bufferstand.foundation.channels import ChannelUncertainty

_SCATTER, _ROUNDS = 1.5, 2
"""A reading at the extreme is below its mean by so many standard deviations or less in 93 of 100; rounds."""
_FARTHEST = 8.0
"""Standard deviations beyond which no deviate of 10^14 lies."""
INERTIA = 5
"""Place of the moving mass among the force terms
(:func:`bufferstand.evaluation.uncertainty.error_model.force_terms`).
"""


@dataclass(frozen=True)
class ExtremeReadings:
    """An extreme reading of noisy ones.

    Attributes
    ----------
    value : float
    sigma : float
        Standard deviation of the noise of one reading.
    rivals : float
        How many readings might have been the extreme one by their noise, itself included.
    hum : float
        Amplitude of waves on the channel: an extreme reading is one at their crest.
    """

    value: float
    sigma: float
    rivals: float
    hum: float = 0.0


def rivals_of(values: FloatArray, extreme: float, sigma: float, averaged: int = 1) -> float:
    """Return how many samples, shape (N,), might have been the extreme one by their noise.

    They are as far from it as it overreaches, and :data:`_SCATTER` more: of a long rest, which overreaches by
    3 to 4 standard deviations, nearly all. How many these are says how far it overreaches.
    """
    if sigma <= 0.0:
        return float(averaged)
    apart = np.abs(values - extreme)  # an extreme has neighbours on one side only
    apart = apart[apart <= (_overreach(float(values.size * averaged)) + _SCATTER) * sigma]
    rivals = float(apart.size) * averaged
    for _ in range(_ROUNDS):
        near = int(np.count_nonzero(apart <= (_overreach(rivals) + _SCATTER) * sigma))
        rivals = float(max(1, near) * averaged)
    return rivals


def _overreach(rivals: float) -> float:
    return overreach(rivals) if rivals > 1.0 else 0.0


def force_errors(
    draws: Draws, reading: ExtremeReadings, falls_from_kN: float, inertia_kN: float
) -> FloatArray:
    """Return the error of an extreme force for every draw [kN], shape (N,).

    Parameters
    ----------
    draws : Draws
    reading : Reading
    falls_from_kN : float
        The force from which it fell, for the error of reversibility; 0: it is no falling force.
    inertia_kN : float
        What the correction for a moving mass added to it.
    """
    force, errors = reading.value, draws.force
    whole = force * errors[:, 1] + errors[:, 2] + draws.drift
    if falls_from_kN > 0.0:
        whole = whole + force * (1.0 - min(1.0, abs(force) / falls_from_kN)) * errors[:, 3]
    if errors.shape[1] > INERTIA:
        whole = whole + inertia_kN * errors[:, INERTIA]
    return np.asarray(whole + _noise(draws, reading, 0))


def stroke_errors(draws: Draws, reading: ExtremeReadings) -> FloatArray:
    """Return the error of an extreme stroke for every draw [mm], shape (N,)."""
    return stroke_error_mm(draws, reading.value) + _noise(draws, reading, 1)


def speed_errors(draws: Draws, peak: SpeedPeak, sigma_mm: float) -> FloatArray:
    """Return the error of a greatest slope of the stroke for every draw [mm/s], shape (N,).

    The deviations of the draw wires stretch the stroke where the slope was read; noise makes the largest of
    many slopes overreach.
    """
    stretch = np.einsum("ni,i->n", draws.stroke, stroke_term_slopes(peak.stroke_mm, draws.drums_mm))
    window = max(2.0, peak.window)
    u = sigma_mm * float(np.sqrt(12.0 / (window * (window**2 - 1.0)))) / peak.step_s
    noise = _noise(draws, ExtremeReadings(0.0, u, peak.rivals(u)), 2)
    return np.asarray(peak.speed_mm_per_s * (stretch + draws.time_base) + noise)


def channel_errors(draws: Draws, reading: ExtremeReadings, stated_by: ChannelUncertainty) -> FloatArray:
    """Return the error of an extreme reading of a channel of its own for every draw, shape (N,).

    Accuracy (in per cent of the value) and zero are limits, drawn from rectangular distributions.
    """
    count = draws.overreach.size
    scale, zero = np.random.default_rng((count, 3)).uniform(-1.0, 1.0, (2, count))
    share = 0.01 * (stated_by.accuracy_percent or 0.0)
    errors = reading.value * share * scale + (stated_by.zero or 0.0) * zero
    return np.asarray(errors + _noise(draws, reading, 2))


def temperature_errors(draws: Draws, accuracy_C: float) -> FloatArray:
    """Return the error of an extreme temperature for every draw [K], shape (N,)."""
    return np.asarray(accuracy_C * draws.thermometer)


def _noise(draws: Draws, reading: ExtremeReadings, stream: int) -> FloatArray:
    """Return what noise makes of an extreme: how far it overreaches, with either sign, and its scatter."""
    count = draws.overreach.size
    generator = np.random.default_rng((count, stream))  # its own: other figures' draws stay what they are
    too_far = reading.sigma * _largest_of(reading.rivals, generator.random(count)) + reading.hum
    return np.asarray(too_far * draws.overreach)


def _largest_of(number: float, random: FloatArray) -> FloatArray:
    """Return draws of the largest of so many standard normal deviates, by draws between 0 and 1.

    A share of r^(1/n) of the deviates lies below it, and so a share of -expm1(ln r / n) above it.
    """
    log_above, deviate = _above()
    beyond = np.log(np.maximum(-np.expm1(np.log(random) / number), np.finfo(np.float64).tiny))
    return np.interp(beyond, log_above, deviate)


@lru_cache(maxsize=1)
def _above() -> tuple[FloatArray, FloatArray]:
    """Return the logarithm of the share of standard normal deviates above others, rising, and these."""
    deviate = np.linspace(_FARTHEST, -_FARTHEST, 20 * int(_FARTHEST) + 1)
    return np.array([log(0.5 * erfc(z / sqrt(2.0))) for z in deviate.tolist()]), deviate


def stated(errors: FloatArray) -> tuple[float, float]:
    """Return U = 2 u and the half-width of the 95 % coverage interval of drawn errors."""
    return expanded(errors), half_width_95(errors)
