"""What is true of a cycle, from the noise-free stroke and force of the stand, by plain sums.

The frequency of a periodic motion is one over the time between like points: the stroke crosses one level in
one direction. That knows nothing of turning points, nor of how long the piston stands at them.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from bufferstand.evaluation.facts.cycle import Cycle
from tests.evaluation.reversing.runs import Run
from tests.evaluation.signals import Floats

OFF_REST_MM = 0.03
"""So far from its rest the stroke has left it."""
BESIDE_S = 0.03
"""So far beyond its cycle a rest is rest."""
SPEED_SHARE, TANGENT_SHARE = 0.05, 0.15
"""Of a branch's samples and of the range: windows of speed and K_t (docs/evaluation/figures.md)."""


def crossings_s(time_s: Floats, stroke_mm: Floats, level_mm: float) -> tuple[Floats, Floats]:
    """Return the moments at which a noise-free stroke crosses a level on its way up, and down [s]."""
    found = []
    for sign in (1.0, -1.0):
        away = sign * (stroke_mm - level_mm)
        at = np.flatnonzero((away[:-1] < 0.0) & (away[1:] >= 0.0))
        found.append(time_s[at] - away[at] / (away[at + 1] - away[at]) * (time_s[at + 1] - time_s[at]))
    return found[0], found[1]


def frequency_Hz(run: Run, cycle: Cycle) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the true frequency of a cycle: one over the time between the middles of like crossings.

    The level is the middle of the stroke. That of a cycle which begins or ends at rest is next to the lower
    turn, and such a cycle lasts from leaving the rest to being back.
    """
    around_s = (cycle.start_s - BESIDE_S, cycle.end_s + BESIDE_S)
    inside = slice(*np.searchsorted(run.record.time_s, around_s).tolist())
    low, high = float(np.min(run.stroke_mm[inside])), float(np.max(run.stroke_mm[inside]))
    rests = cycle.start.dwell_s > 0.0 or cycle.end.dwell_s > 0.0
    level_mm = low + OFF_REST_MM if rests else 0.5 * (low + high)
    up_s, down_s = crossings_s(run.record.time_s, run.stroke_mm, level_mm)
    before_s = np.max(up_s[up_s < cycle.top.time_s]), np.min(down_s[down_s > cycle.top.time_s])
    beside_s = (
        np.max(down_s[down_s < before_s[0]], initial=-np.inf),
        np.min(up_s[up_s > before_s[1]], initial=np.inf),
    )
    start_s, end_s = (
        own if turn.dwell_s > 0.0 or not np.isfinite(other) else 0.5 * (own + other)
        for own, other, turn in zip(
            (before_s[0], before_s[1]), beside_s, (cycle.start, cycle.end), strict=True
        )
    )
    return float(1.0 / (end_s - start_s))


def figures(run: Run, cycle: Cycle) -> dict[str, float]:
    """Return the true figures of a cycle, by the names of the evaluation."""
    stroke, force = run.stroke_mm, run.force_kN
    top = _turn(run, cycle.top.time_s, np.argmax)
    begin, end = (_turn(run, at, np.argmin) for at in (cycle.start_s, cycle.end_s))
    up, down = slice(begin, top + 1), slice(top, end + 1)
    stored = float(np.trapezoid(force[up], stroke[up]))
    chord = 0.5 * (force[end] + force[begin]) * (stroke[begin] - stroke[end])
    absorbed = stored + float(np.trapezoid(force[down], stroke[down]) + chord)
    low, high = float(stroke[begin]), float(stroke[top])
    stiffness = _first_harmonic(run, begin, 1.0 / frequency_Hz(run, cycle))
    return {
        "frequency_Hz": frequency_Hz(run, cycle),
        "stroke_min_mm": low,
        "stroke_max_mm": high,
        "stored_energy_J": stored,
        "absorbed_energy_J": absorbed,
        "damping": absorbed / stored,
        "secant_stiffness_kN_per_mm": float(force[top] - force[begin]) / (high - low),
        "tangent_stiffness_kN_per_mm": _tangent(stroke[up], force[up]),
        "storage_stiffness_kN_per_mm": stiffness.real,
        "loss_stiffness_kN_per_mm": stiffness.imag,
        "force_max_kN": float(np.max(force[begin : end + 1])),
        "speed_loading_max_mm_per_s": _speed(run, cycle.start_s, cycle.top.time_s),
        "speed_unloading_max_mm_per_s": _speed(run, cycle.top.leave_s, cycle.end_s),
    }


def _turn(run: Run, near_s: float, which: object) -> int:
    """Return the sample of the true turn that is next to a moment: the middle of where it stands."""
    first, last = np.searchsorted(run.record.time_s, (near_s - 0.1, near_s + 0.1))
    part = run.stroke_mm[int(first) : int(last)]
    extreme = part[which(part)]  # type: ignore[operator]
    flat = np.flatnonzero(np.abs(part - extreme) < 1e-9)
    return int(first) + int(flat[flat.size // 2])


def _tangent(stroke_mm: Floats, force_kN: Floats) -> float:
    """Return the slope at the mean stroke by a cubic within ± 15 % of the range."""
    middle, span = 0.5 * (stroke_mm[0] + stroke_mm[-1]), float(np.ptp(stroke_mm))
    near = np.abs(stroke_mm - middle) <= TANGENT_SHARE * span
    return float(np.polynomial.polynomial.polyfit(stroke_mm[near] - middle, force_kN[near], 3)[1])


def _first_harmonic(run: Run, begin: int, period_s: float) -> complex:
    """Return K* by the Fourier integrals over one period (trapezoidal rule)."""
    count = round(period_s / float(run.record.time_s[1] - run.record.time_s[0]))
    moment = np.linspace(0.0, period_s, count + 1)
    turn = np.exp(-2j * np.pi * moment / period_s)
    at_s = run.record.time_s[begin] + moment
    force, stroke = (
        complex(np.trapezoid(np.interp(at_s, run.record.time_s, signal) * turn, moment))
        for signal in (run.force_kN, run.stroke_mm)
    )
    return force / stroke


def _speed(run: Run, begin_s: float, end_s: float) -> float:
    """Return the largest speed between two moments by a parabola over 5 % of the samples, ends included."""
    inside = slice(*np.searchsorted(run.record.time_s, (begin_s, end_s)).tolist())
    stroke_mm, step_s = run.stroke_mm[inside], float(run.record.time_s[1] - run.record.time_s[0])
    window = max(5, 2 * int(0.5 * SPEED_SHARE * stroke_mm.size) + 1)
    return float(np.max(np.abs(savgol_filter(stroke_mm, window, 2, deriv=1, delta=step_s))))
