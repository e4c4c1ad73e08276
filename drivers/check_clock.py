"""How a device's clock runs against the computer's: a straight line through pairs of readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.check_rows import CheckRow
from drivers.check_verdict import Verdict

LEAST_PAIRS = 10
"""Fewer pairs make no line."""
COVERAGE = 2.0
"""Coverage factor of the uncertainty that is shown."""
ORDINARY_PPM = 200.0
"""A crystal clock is within this, over temperature and age."""
WRONG_PPM = 5000.0
"""A clock this far off is no clock of this unit or rate."""
_WRAP = 1 << 32
_SLOW_TRIP = 1.5


@dataclass(frozen=True)
class Drift:
    """How much faster than the computer's clock the device's runs.

    Parameters
    ----------
    ppm : float
        (slope − 1)·10⁶ of the least-squares line of device time against host time.
    expanded_ppm : float
        Twice the standard uncertainty of that slope, from the scatter about the line.
    span_s : float
        Time that was looked at [s].
    pairs : int
        Readings used.
    """

    ppm: float
    expanded_ppm: float
    span_s: float
    pairs: int


def fit_drift(host_s: Sequence[float], trip_s: Sequence[float], tick_us: Sequence[int]) -> Drift | None:
    """Return the drift from readings of the device's clock; None where there are too few.

    A reading is true somewhere between request and reply; those whose round trip was long are left out.

    Parameters
    ----------
    host_s : sequence of float
        Middle of each round trip by the computer's clock [s], rising.
    trip_s : sequence of float
        Its duration [s].
    tick_us : sequence of int
        What the device's clock showed [µs, modulo 2³²].
    """
    trips = np.asarray(trip_s, dtype=np.float64)
    if trips.size < LEAST_PAIRS:
        return None
    steps = np.mod(np.diff(np.asarray(tick_us, dtype=np.int64)), _WRAP)
    device_s = np.concatenate(([0.0], np.cumsum(steps))) * 1e-6
    quick = trips <= _SLOW_TRIP * np.median(trips)
    x, y = np.asarray(host_s, dtype=np.float64)[quick], device_s[quick]
    if x.size < LEAST_PAIRS:
        return None
    x, y = x - x.mean(), y - y.mean()
    spread = float(x @ x)
    slope = float(x @ y) / spread
    rest = y - slope * x
    u_slope = float(np.sqrt(rest @ rest / (x.size - 2) / spread))
    return Drift((slope - 1.0) * 1e6, COVERAGE * u_slope * 1e6, float(np.ptp(x)), int(x.size))


def drift_row(drift: Drift | None) -> CheckRow:
    """Return the drift as a finding."""
    if drift is None:
        return CheckRow(
            "controller", "clock drift", "—", remark="it shows no clock, or too few readings were made"
        )
    text = f"{drift.ppm:+.1f} ± {drift.expanded_ppm:.1f} ppm ({drift.pairs} readings in {drift.span_s:.1f} s)"
    figures = {"drift_ppm": drift.ppm, "drift_expanded_uncertainty_ppm": drift.expanded_ppm}
    least = abs(drift.ppm) - drift.expanded_ppm
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
    return CheckRow("controller", "clock drift", text, figures=figures)
