"""Finding the cycles of a run from its stroke alone, wherever they are and however they begin.

Criteria (docs/evaluation.md): a cycle is *complete* when both its lower turning points are turns of the
motion, or rests of the specimen to which the stroke returns, and no break of the record lies inside. It is
*steady* when it closes and repeats a neighbour: turning points, frequency and distortion of the stroke.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from evaluation.motion import Cycle, TurningPoint
from evaluation.record import FloatArray, Record, describe
from evaluation.reversals import find_reversals, held_samples, noise_sigma
from evaluation.turn_sides import Reversal, TurnKind
from evaluation.turning import fit_turning_points

STEADY_STROKE = 0.02
"""Turning points of a steady cycle agree within this share of its range …"""
STEADY_FREQUENCY = 0.05
"""… its frequency within this share …"""
STEADY_DISTORTION = 0.02
"""… and its stroke distortion within this much (absolute)."""
REST_CLOSURE = 0.05
"""A cycle that begins or ends at rest returns within this share of its range."""
EDGE_CLOSURE = 0.02
"""A cycle that begins or ends with the record returns within this share of its range."""
_HARMONICS = 10
_LEAST_SAMPLES = 8
_MOST_SAMPLES = 400
"""Harmonics are fitted to group means of at most so many samples a cycle: 1e-5 less of the first one."""


def find_cycles(record: Record) -> tuple[Cycle, ...]:
    """Return every cycle of a run, in order of time, numbered from 1.

    Parameters
    ----------
    record : Record
        Only its time, stroke and breaks are used.

    Returns
    -------
    tuple of Cycle
        Also those that are not complete or not steady; ``why`` says what they lack. A ramp that leads to
        cycles, or away from them, appears as part of a cycle that is not complete.
    """
    sigma = noise_sigma(record.stroke_mm)
    index = find_reversals(record.stroke_mm, sigma)
    if index.size < 3:
        return ()
    turns = _fit_turns(record, [int(i) for i in index], sigma)
    cycles = [
        _judge_complete(record, number, turns[i : i + 3]) for number, i in enumerate(_starts(turns), start=1)
    ]
    return _judge_steady(cycles)


def _starts(turns: Sequence[TurningPoint]) -> range:
    """Return the positions of the lower turning points that a whole cycle follows."""
    first = 0 if turns[0].kind == "lower" else 1
    return range(first, len(turns) - 2, 2)


def _fit_turns(record: Record, index: list[int], sigma: float) -> list[TurningPoint]:
    """Fit each reversal between its neighbours, without looking across a break of the record."""
    stroke = record.stroke_mm
    reversals = []
    for position, at in enumerate(index):
        before = index[position - 1] if position > 0 else 0
        after = index[position + 1] if position + 1 < len(index) else stroke.size - 1
        other = after if position + 1 < len(index) else before
        breaks = record.breaks[bisect_right(record.breaks, before) : bisect_right(record.breaks, after)]
        left, right = [b for b in breaks if b <= at], [b for b in breaks if b > at]
        limits = (left[-1] if left else before, right[0] - 1 if right else after)
        at_end = (position <= 1 or bool(left), position >= len(index) - 2 or bool(right))
        kind: TurnKind = "upper" if stroke[at] > stroke[other] else "lower"
        reversals.append(Reversal(at, limits, kind, at_end))
    return fit_turning_points(record.time_s, stroke, reversals, sigma, held=held_samples(stroke))


def _judge_complete(record: Record, number: int, turns: Sequence[TurningPoint]) -> Cycle:
    start, top, end = turns
    span = top.stroke_mm - min(start.leave_mm, end.stroke_mm)
    open_mm = abs(end.stroke_mm - start.leave_mm)
    why = []
    for turn, side in ((start, "begins"), (end, "ends")):
        if turn.method == "cut":
            why.append(f"the record {side} within it")
        allowed = {"edge": EDGE_CLOSURE, "plateau": REST_CLOSURE}.get(turn.method)
        fitted_mm = 3.0 * (start.u_stroke_mm + end.u_stroke_mm)
        if allowed is not None and open_mm > allowed * span + fitted_mm:
            place = "with the record" if turn.method == "edge" else "at rest"
            why.append(f"it {side} {place} and does not close ({open_mm:.3g} mm between its lower ends)")
    if top.method in ("edge", "cut"):
        why.append("its upper turning point is not on record")
    first, last = _samples(record.time_s, start.leave_s, end.time_s)
    if record.has_break(first, last):
        inside = [d for d in record.defects if d.end_s > start.leave_s and d.start_s < end.time_s]
        why.append("the record is broken in it: " + (describe(inside) or "samples are missing"))
    if last - first + 1 < _LEAST_SAMPLES:
        why.append(f"it has fewer than {_LEAST_SAMPLES} samples")
    cycle = Cycle(number, start, top, end, complete=not why, steady=False, why=tuple(why))
    if why:
        return cycle
    return replace(cycle, stroke_distortion=stroke_distortion(record, cycle))


def _samples(time_s: FloatArray, start_s: float, end_s: float) -> tuple[int, int]:
    """Return the first and last sample that a span of time touches, the neighbours outside included."""
    first = max(0, int(np.searchsorted(time_s, start_s, side="right")) - 1)
    last = min(time_s.size - 1, int(np.searchsorted(time_s, end_s, side="left")))
    return first, last


def harmonics(
    time_s: FloatArray, value: FloatArray, start_s: float, period_s: float, count: int
) -> FloatArray:
    """Return cosine and sine amplitudes of signals over one period by least squares.

    Parameters
    ----------
    time_s : array, shape (N,)
        Samples inside the period, ends included, evenly spaced or not.
    value : array, shape (N,) or (M, N)
        One signal, or several.
    start_s, period_s : float
    count : int
        Harmonics asked for; fewer are fitted where there are too few samples.

    Returns
    -------
    array, shape (count + 1, 2) or (M, count + 1, 2)
        Row k: amplitudes of cos(k ω (t - start)) and sin(k ω (t - start)); row 0 holds the mean and 0.
    """
    if time_s.size > _MOST_SAMPLES:
        group = -(-time_s.size // _MOST_SAMPLES)
        whole = time_s.size // group * group
        time_s = time_s[:whole].reshape(-1, group).mean(axis=1)
        value = value[..., :whole].reshape(*value.shape[:-1], -1, group).mean(axis=-1)
    fitted = min(count, max(1, (time_s.size - 3) // 2))
    turn = np.exp(2.0j * np.pi * (time_s - start_s) / period_s)
    waves = np.cumprod(np.broadcast_to(turn, (fitted, turn.size)), axis=0)
    # Weights of the trapezoidal rule make the fit an integral over the period, however it was sampled.
    step = np.diff(time_s)
    weight = np.sqrt(0.5 * (np.concatenate((step[:1], step)) + np.concatenate((step, step[-1:]))))
    rows = np.concatenate((np.ones((1, turn.size)), waves.real, waves.imag)) * weight
    solution = np.linalg.solve(rows @ rows.T, rows @ (value * weight).T).T
    result = np.zeros((*value.shape[:-1], count + 1, 2))
    result[..., : fitted + 1, 0] = solution[..., : fitted + 1]
    result[..., 1 : fitted + 1, 1] = solution[..., fitted + 1 :]
    return result


def cycle_samples(record: Record, cycle: Cycle) -> slice:
    """Return the samples strictly inside a cycle."""
    first = int(np.searchsorted(record.time_s, cycle.start_s, side="right"))
    last = int(np.searchsorted(record.time_s, cycle.end_s, side="left"))
    return slice(first, last)


def stroke_distortion(record: Record, cycle: Cycle) -> float | None:
    """Return the root of the sum of squares of stroke harmonics 2 … 10 over the first harmonic."""
    inside = cycle_samples(record, cycle)
    time, stroke = record.time_s[inside], record.stroke_mm[inside]
    if time.size < _LEAST_SAMPLES:
        return None
    drift = (cycle.stroke_end_mm - cycle.stroke_min_mm) * (time - cycle.start_s) / cycle.duration_s
    amplitude = np.hypot(*harmonics(time, stroke - drift, cycle.start_s, cycle.duration_s, _HARMONICS).T)
    if amplitude[1] <= 0.0:
        return None
    return float(np.sqrt(np.sum(amplitude[2:] ** 2)) / amplitude[1])


def _judge_steady(cycles: list[Cycle]) -> tuple[Cycle, ...]:
    judged = []
    for position, cycle in enumerate(cycles):
        if not cycle.complete:
            judged.append(cycle)
            continue
        tolerance = STEADY_STROKE * cycle.range_mm + 2.0 * (cycle.start.u_stroke_mm + cycle.end.u_stroke_mm)
        why: list[str] = []
        open_mm = cycle.stroke_end_mm - cycle.stroke_min_mm
        if abs(open_mm) > tolerance:
            why.append(f"its lower turning points differ by {abs(open_mm):.3g} mm")
        neighbours = [cycles[i] for i in (position - 1, position + 1) if 0 <= i < len(cycles)]
        reasons = [_difference(cycle, other, tolerance) for other in neighbours]
        if not neighbours:
            why.append("there is no other cycle to compare it with")
        elif all(reasons):
            why.append("; ".join(dict.fromkeys(reason for reason in reasons if reason)))
        judged.append(replace(cycle, steady=not why, why=tuple(why)))
    return tuple(judged)


def _difference(cycle: Cycle, other: Cycle, tolerance_mm: float) -> str:
    """Return in what a cycle differs from its neighbour, or nothing."""
    apart_mm = abs(cycle.stroke_max_mm - other.stroke_max_mm)
    if apart_mm > tolerance_mm:
        return f"its upper turning point differs by {apart_mm:.3g} mm from that of cycle {other.index}"
    if not other.complete or abs(other.stroke_end_mm - other.stroke_min_mm) > tolerance_mm:
        return ""  # a neighbour that is itself cut or ramped says nothing on shape and frequency
    if abs(other.stroke_min_mm - cycle.stroke_min_mm) > tolerance_mm:
        return f"its lower turning point differs from that of cycle {other.index}"
    # A short dwell that is recognised at one turn and not at the next shifts the first, pauses of
    # different length the second: one of the two must agree.
    without_rest, with_rest = cycle.duration_s / other.duration_s, _period_s(cycle) / _period_s(other)
    if min(abs(without_rest - 1.0), abs(with_rest - 1.0)) > STEADY_FREQUENCY:
        return f"its frequency differs from that of cycle {other.index}"
    mine, its = cycle.stroke_distortion, other.stroke_distortion
    if mine is not None and its is not None and abs(mine - its) > STEADY_DISTORTION:
        return f"its stroke is distorted otherwise than that of cycle {other.index}"
    return ""


def _period_s(cycle: Cycle) -> float:
    """Return the time from the middle of the lower dwell at the start to the middle of that at the end."""
    begin = 0.5 * (cycle.start.time_s + cycle.start.leave_s)
    return 0.5 * (cycle.end.time_s + cycle.end.leave_s) - begin
