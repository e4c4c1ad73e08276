"""How long a specimen must rest after cycles until its sensor shows the temperature of its spring."""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.protocols.prediction.predictor import Predictor, Temperatures
from bufferstand.protocols.steps import Heating, Warmth

LOOK_S = 15.0
"""So long a rest is looked at least: from fewer readings no slope is known [s]."""
EVEN_SHARE = 0.5
"""Spring and sensor are even when they differ by less than this share of the band …"""
EVEN_K = 0.1
"""… or by this, whichever is more [K]; or when …"""
EVEN_LAGS = 4.0
"""… so many lags have passed: a hot spring never stops cooling."""
UNKNOWN_LAG_S = 60.0
"""Lag that is assumed where nothing tells it [s]: more than a sensor glued on steel has, so that cycles end
too early and not too late."""
SEEN_LATE_S = 20.0
"""By so much the end of cycles may be seen late by the slope of the readings, beside the lag [s]."""


def even_within_K(warmth: Warmth) -> float:  # noqa: N802 - the unit keeps its capital
    """Return by how much spring and sensor may differ at the end [K]."""
    return max(EVEN_SHARE * warmth.band_K, EVEN_K)


def seen_too_late(rate_K_per_s: float, lag_s: float, warmth: Warmth) -> bool:
    """Return whether cycles heat so fast that their end is seen too late for the band.

    Parameters
    ----------
    rate_K_per_s : float
        By how much cycles heat the spring [K/s].
    lag_s : float
        Of the sensors, the most that it may be [s].
    warmth : Warmth
        With the band.
    """
    return rate_K_per_s * (SEEN_LATE_S + lag_s) > warmth.band_K


def comes_in_two_goes(heating: Heating, warmth: Warmth) -> bool:
    """Return whether a first go of cycles ends early on purpose, because its end would be seen too late."""
    if heating.rate_K_per_s is None:
        return True
    lag_s = UNKNOWN_LAG_S if heating.lag_s is None else heating.lag_s
    return seen_too_late(heating.rate_K_per_s, 2.0 * lag_s, warmth)


def rested_even(
    predictor: Predictor, now: Temperatures, ambient_C: float, warmth: Warmth
) -> tuple[float, Temperatures]:
    """Return how long it rests until spring and sensor are even [s], and their temperatures then.

    Parameters
    ----------
    predictor : Predictor
        The heat law.
    now : Temperatures
        As the rest begins.
    ambient_C : float
        Of the air [°C].
    warmth : Warmth
        With the band.
    """
    lag_s = predictor.sensor_lag_s or 0.0
    within_K = even_within_K(warmth)

    def after(rest_s: float) -> Temperatures:
        return predictor.temperatures_after(now, ambient_C, 0.0, rest_s)

    def even(rest_s: float) -> bool:
        then = after(rest_s)
        return abs(then.mass_C - then.sensor_C) <= within_K

    longest_s = EVEN_LAGS * lag_s + LOOK_S
    rest_s = _first(even, LOOK_S, longest_s)
    return rest_s, after(rest_s)


def _first(happened: Callable[[float], bool], low: float, high: float) -> float:
    if happened(low) or not happened(high):
        return low if happened(low) else high
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if happened(middle) else (middle, high)
    return high
