"""The rate of a device's clock against the computer's, from pairs of readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.drivers.check.clock_bounds import ClockBounds
from bufferstand.drivers.check.rows import CheckRow
from bufferstand.drivers.check.verdict import Verdict

LEAST_PAIRS = 3
"""Fewer readings bound no rate that is worth telling."""
ORDINARY_PPM = 200.0
"""A crystal clock is within this, over temperature and age."""
WRONG_PPM = 5000.0
"""A clock this far off is no clock of this unit or rate."""
OLD_S = 1e-3
"""A reading that is older than this when it is asked for is told …"""
UNEVEN_S = 0.05
"""… and no control cycle is so long: beyond this the clock itself does not run evenly [s]."""
RESOLUTION_US = 1.0
"""The reading is a whole number of microseconds, rounded in whatever way."""
_WRAP = 1 << 32
_SLOW_TRIP = 1.5
_ROOM = 2.0
"""Where readings contradict each other, each may be off by so many times what they must be at least."""


@dataclass(frozen=True)
class ClockDrift:
    """How much faster than the computer's clock the device's runs.

    Parameters
    ----------
    ppm : float
        (rate − 1)·10⁶: that of the least-squares line through the middles of quick round trips, or the
        nearest one that all readings allow.
    expanded_ppm : float
        How far from it the rates reach that no reading contradicts: a bound, not a share of cases.
    span_s : float
        Time that was looked at [s].
    pairs : int
        Readings used.
    slack_s : float
        By how much readings contradict every even clock at least [s]: they are older than the request.
    """

    ppm: float
    expanded_ppm: float
    span_s: float
    pairs: int
    slack_s: float = 0.0


def fit_drift(host_s: Sequence[float], trip_s: Sequence[float], tick_us: Sequence[int]) -> ClockDrift | None:
    """Return the drift from readings of the device's clock; None where there are too few.

    A reading is true somewhere between request and reply, and nothing else is taken for sure
    (:mod:`bufferstand.drivers.check.clock_bounds`): so the uncertainty holds on a computer that is busy, too.

    Parameters
    ----------
    host_s : sequence of float
        Middle of each round trip by the computer's clock [s], rising.
    trip_s : sequence of float
        Its duration [s].
    tick_us : sequence of int
        What the device's clock showed [µs, modulo 2³²].
    """
    trips, middle_s = np.asarray(trip_s, dtype=np.float64), np.asarray(host_s, dtype=np.float64)
    if trips.size < LEAST_PAIRS:
        return None
    steps = np.mod(np.diff(np.asarray(tick_us, dtype=np.int64)), _WRAP)
    device_us = np.concatenate(([0.0], np.cumsum(steps)))
    since_s = middle_s - middle_s[0]
    bounds = ClockBounds(since_s - 0.5 * trips, since_s + 0.5 * trips, device_us, RESOLUTION_US)
    slack_us, allowed = 0.0, bounds.interval()
    if allowed is None:
        slack_us = bounds.least_slack_us()
        allowed = bounds.interval(_ROOM * slack_us + RESOLUTION_US)
    if allowed is None or not np.all(np.isfinite(allowed)):
        return None
    quick = trips <= _SLOW_TRIP * np.median(trips)
    x, y = since_s[quick], (device_us - since_s * 1e6)[quick]
    x = x - x.mean()
    likely = float(x @ y) / float(x @ x) if np.ptp(x) > 0.0 else sum(allowed) / 2.0
    ppm = float(np.clip(likely, *allowed))
    reach = max(ppm - allowed[0], allowed[1] - ppm)
    return ClockDrift(ppm, reach, float(np.ptp(since_s)), int(trips.size), slack_us * 1e-6)


def drift_row(drift: ClockDrift | None) -> CheckRow:
    """Return the drift as a finding."""
    if drift is None:
        return CheckRow(
            "controller", "clock drift", "—", remark="it shows no clock, or too few readings were made"
        )
    text = f"{drift.ppm:+.1f} ± {drift.expanded_ppm:.1f} ppm ({drift.pairs} readings in {drift.span_s:.1f} s)"
    figures = {"drift_ppm": drift.ppm, "drift_expanded_uncertainty_ppm": drift.expanded_ppm}
    least = abs(drift.ppm) - drift.expanded_ppm
    if drift.slack_s > UNEVEN_S:
        remark = (
            f"its readings differ by {drift.slack_s:.2g} s from every clock that runs evenly: look for a "
            "restart of the controller, or for what sets its clock"
        )
        return CheckRow("controller", "clock drift", text, Verdict.FAULT, remark, figures=figures)
    if least > WRONG_PPM:
        ratio = 1.0 + drift.ppm * 1e-6
        remark = (
            f"its clock runs {ratio:.4g} times as fast as this computer's: look at the unit of register tick "
            "and at its sample rate (a simulated stand with --speed shows its speed here)"
        )
        return CheckRow("controller", "clock drift", text, Verdict.FAULT, remark, figures=figures)
    if least > ORDINARY_PPM:
        remark = "more than a crystal's; runs are mapped by anchors, so figures hold, but look at both clocks"
        return CheckRow("controller", "clock drift", text, Verdict.NOTE, remark, figures=figures)
    old = f"register tick is up to {drift.slack_s * 2e3:.2g} ms old when it is read"
    return CheckRow(
        "controller", "clock drift", text, remark=old if drift.slack_s > OLD_S else "", figures=figures
    )
