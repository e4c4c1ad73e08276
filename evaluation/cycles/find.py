"""Finding the cycles of a run from its stroke alone, wherever they are and however they begin.

Criteria (docs/evaluation/cycles.md): a cycle is *complete* when both its lower turning points are turns of
the motion, or rests of the specimen to which the stroke returns, and no break of the record lies inside
(those that are bridged, :mod:`bufferstand.evaluation.gaps`, are none). It is *steady* when it closes and
repeats a neighbour: turning points, frequency and distortion of the stroke.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles.harmonics import spectra_between
from bufferstand.evaluation.cycles.reversal_dwells import with_reversals
from bufferstand.evaluation.cycles.turn_neighbourhood import Reversals
from bufferstand.evaluation.cycles.turning_points import fit_turning_points
from bufferstand.evaluation.facts import Cycle, CycleColumns, TurnColumns, TurningPoint
from bufferstand.evaluation.numerics import FloatArray, Sampling, find_reversals
from bufferstand.evaluation.record import Record, describe

STEADY_STROKE = 0.02
"""Turning points of a steady cycle agree within this share of its range …"""
STEADY_FREQUENCY = 0.05
"""… its frequency within this share …"""
STEADY_DISTORTION = 0.02
"""… and its stroke distortion within this much (absolute)."""
REST_CLOSURE = 0.05
"""A cycle that begins or ends at rest returns within this share of its range."""
EDGE_SAME = 0.003
"""A record that ends in motion, but so near to its other lower turn (share of the range), ends there."""
EDGE_CLOSURE = 0.02
"""A cycle that begins or ends with the record returns within this share of its range."""
SLIPPED = 6
"""Two turning points that a jump of the stroke makes are no more samples apart: it takes up to four of them,
and noise moves both."""
_LEAST_SAMPLES = 8
_LEAST_BRANCH = 3
"""Samples strictly between two turning points: of fewer nobody knows the force along that branch."""


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
    return find_with_harmonics(record)[0]


def find_with_harmonics(
    record: Record, reversals: NDArray[np.intp] | None = None, slips_s: Sequence[float] = ()
) -> tuple[tuple[Cycle, ...], NDArray[np.complex128]]:
    """Return the cycles of a run, and K* of the complete ones by the force as it is [kN/mm], (C,).

    ``reversals`` are those of :func:`bufferstand.evaluation.numerics.reversals.find_reversals`, if they are
    known already. At ``slips_s`` the stroke jumps, against its motion or with it, which is no motion."""
    sampling = record.stroke_sampling
    index = find_reversals(record.stroke_mm, sampling) if reversals is None else reversals
    if slips_s:
        index = _without_slips(record.time_s, index, slips_s)
    if index.size < 3:
        return (), np.zeros(0, dtype=np.complex128)
    calm = replace(sampling, sigma=record.stroke_noise_mm)
    turns = _with_edges(record, _fit_turns(record, index, calm), sampling)
    turns = with_reversals(record, turns, sampling.sigma)
    first = 0 if turns[0].kind == "lower" else 1
    triples = list(zip(turns[first::2], turns[first + 1 :: 2], turns[first + 2 :: 2], strict=False))
    columns = _columns(turns, first, len(triples))
    start, end = columns.start, columns.end
    why, broken = _incomplete(record, triples, columns)
    whole = np.array([not reasons for reasons in why], dtype=bool)
    found = spectra_between(record, start.leave_s[whole], end.time_s[whole])
    open_mm = (end.stroke_mm - start.leave_mm)[whole]
    distortion = np.full(whole.size, np.nan)
    distortion[whole] = np.where(found.samples >= _LEAST_SAMPLES, found.distortion(open_mm), np.nan)
    known: list[float | None] = distortion.tolist()
    for row in np.flatnonzero(np.isnan(distortion)).tolist():
        known[row] = None
    repeated = whole & _repeats(columns, whole, distortion)
    cycles = [
        Cycle(number, *three, complete, steady, known[number - 1], reasons, not is_broken)
        for number, (three, complete, steady, reasons, is_broken) in enumerate(
            zip(triples, whole.tolist(), repeated.tolist(), why, broken.tolist(), strict=True), 1
        )
    ]
    return _judge_steady(cycles), found.first_harmonic()


def _without_slips(time_s: FloatArray, index: NDArray[np.intp], slips_s: Sequence[float]) -> NDArray[np.intp]:
    """Return reversals without the pairs that jumps of the stroke make."""
    for at in np.searchsorted(time_s, slips_s).tolist():
        apart = np.diff(index)[1:-1]  # the ends of the record are no turns
        beside = (index[1:-2] <= at + SLIPPED) & (index[2:-1] >= at - SLIPPED)
        near = np.flatnonzero((apart <= SLIPPED) & beside) + 1
        if near.size:
            first = int(near[0])
            index = np.delete(index, (first, first + 1))
    return index


def _columns(turns: Sequence[TurningPoint], first: int, cycles: int) -> CycleColumns:
    """Return the turning points of cycles as columns."""
    every = TurnColumns.of(turns)
    start, top, end = (every.rows(slice(first + k, first + k + 2 * cycles, 2)) for k in range(3))
    return CycleColumns(start, top, end)


def _with_edges(record: Record, turns: list[TurningPoint], sampling: Sampling) -> list[TurningPoint]:
    """Return the turns, an end of the record taken for one where the motion begins or ends with it.

    There a fit looks for a turn beyond the record, because the stroke is in motion or bends. If the record's
    end is at the stroke of the cycle's other lower turn within :data:`EDGE_SAME`, so much is missing at most.
    """
    turns = list(turns)
    for place, other, at in ((0, 2, 0), (-1, -3, record.time_s.size - 1)):
        if len(turns) < 3 or turns[place].method != "cut" or turns[place].kind != "lower":
            continue
        end_mm, lower, top = float(record.stroke_mm[at]), turns[other], turns[1 if place == 0 else -2]
        lower_mm = lower.stroke_mm if place == 0 else lower.leave_mm
        away_mm = abs(end_mm - lower_mm)
        noise_mm = 3.0 * (sampling.sigma + lower.u_stroke_mm)
        if lower.method == "cut" or away_mm > EDGE_SAME * (top.stroke_mm - lower_mm) + noise_mm:
            continue
        moment, step_s = float(record.time_s[at]), abs(float(np.diff(record.time_s)[place]))
        turns[place] = TurningPoint(
            moment, moment, end_mm, end_mm, "lower", at, "edge", sampling.sigma, step_s, step_s, away_mm
        )
    return turns


def _fit_turns(record: Record, index: NDArray[np.intp], sampling: Sampling) -> list[TurningPoint]:
    """Fit each reversal between its neighbours, without looking across a break of the record."""
    stroke = record.stroke_mm
    upper = np.append(np.diff(stroke[index]) < 0.0, False)  # of each, whether the next one is lower
    upper[-1] = not upper[-2]
    limits = np.stack((np.append(0, index[:-1]), np.append(index[1:], stroke.size - 1)), axis=1)
    at_end = np.zeros(limits.shape, dtype=bool)
    at_end[:2, 0] = at_end[-2:, 1] = True
    breaks = np.array(record.breaks, dtype=np.intp)
    own = [np.searchsorted(breaks, place, side="right") for place in (limits[:, 0], index, limits[:, 1])]
    left, right = own[1] > own[0], own[2] > own[1]
    limits[left, 0] = breaks[own[1][left] - 1]
    limits[right, 1] = breaks[own[1][right]] - 1
    at_end |= np.stack((left, right), axis=1)
    return fit_turning_points(
        record.time_s,
        stroke,
        Reversals(index, limits, upper, at_end),
        sampling.sigma,
        held=sampling.held,
        averaged=record.averaged,
        read=record.read if record.filled_s else None,
    )


Triple = tuple[TurningPoint, TurningPoint, TurningPoint]


def _incomplete(
    record: Record, triples: Sequence[Triple], columns: CycleColumns
) -> tuple[list[tuple[str, ...]], NDArray[np.bool_]]:
    """Return why each cycle is not complete, nothing where it is; and which of them a break goes through."""
    time_s = record.time_s
    starts, tops, ends = columns
    # The first and last sample that each touches, the neighbours outside included.
    first = np.maximum(0, np.searchsorted(time_s, starts.leave_s, side="right") - 1)
    last = np.minimum(time_s.size - 1, np.searchsorted(time_s, ends.time_s, side="left"))
    broken = _broken(record, columns, first, last)
    few = last - first + 1 < _LEAST_SAMPLES
    inner = _branch_samples(time_s, columns)
    bare = np.any(inner < _LEAST_BRANCH, axis=0)
    plain = ~(broken | few | bare)
    for turns in (starts, tops, ends):
        plain &= (turns.method == "polynomial") | (turns.method == "lines")
    reasons: list[tuple[str, ...]] = [()] * len(triples)
    for row in np.flatnonzero(~plain).tolist():
        start, top, end = triples[row]
        why = [] if broken[row] else _not_closed(start, top, end)
        if broken[row]:
            inside = [d for d in record.defects if d.end_s >= start.leave_s and d.start_s <= end.time_s]
            missing = describe(inside) or "samples are missing"
            why.append(f"what is not on record of it is too long to be bounded: {missing}")
        if few[row]:
            why.append(f"it has fewer than {_LEAST_SAMPLES} samples")
        elif bare[row]:
            why += _bare_branches(inner[:, row].tolist())
        reasons[row] = tuple(why)
    return reasons, broken


def _broken(
    record: Record, columns: CycleColumns, first: NDArray[np.intp], last: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Say which cycles a break goes through, from their first to their last sample, or cuts off at an end."""
    if not record.breaks:
        return np.zeros(first.size, dtype=bool)
    breaks = np.array(record.breaks, dtype=np.intp)
    begins, ends = ((turns.method == "cut").astype(np.intp) for turns in (columns.start, columns.end))
    return np.asarray(
        np.searchsorted(breaks, last + ends, side="right")
        > np.searchsorted(breaks, first - begins, side="right")
    )


def _branch_samples(time_s: FloatArray, columns: CycleColumns) -> NDArray[np.intp]:
    """Return the samples strictly inside the loading and the unloading branch of each cycle, shape (2, R)."""
    start, top, end = columns
    first = np.searchsorted(time_s, np.stack((start.leave_s, top.leave_s)), side="right")
    return np.asarray(np.searchsorted(time_s, np.stack((top.time_s, end.time_s)), side="left") - first)


def _bare_branches(samples: Sequence[int]) -> list[str]:
    """Return which branches have so few samples that nobody knows the force along them."""
    return [
        f"its {branch} branch has {max(0, count)} samples between the turning points, "
        f"{_LEAST_BRANCH} are needed: record faster"
        for branch, count in zip(("loading", "unloading"), samples, strict=True)
        if count < _LEAST_BRANCH
    ]


def _not_closed(start: TurningPoint, top: TurningPoint, end: TurningPoint) -> list[str]:
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
    return why


def is_lead(cycle: Cycle) -> bool:
    """Say whether a cycle is incomplete for one reason alone: it leads in from rest, or out to rest.

    Rest is on record, or the record begins or ends with the motion; it must not do so within a stroke.
    """
    methods = {cycle.start.method, cycle.top.method, cycle.end.method}
    why = _not_closed(cycle.start, cycle.top, cycle.end)
    return not cycle.complete and "cut" not in methods and len(why) == 1 and list(cycle.why) == why


def _repeats(columns: CycleColumns, whole: NDArray[np.bool_], distortion: FloatArray) -> NDArray[np.bool_]:
    """Say which cycles close and repeat a complete neighbour in all: the usual case, told for all at once."""
    start, top, last = columns
    low, high, end = start.leave_mm, top.stroke_mm, last.stroke_mm
    tolerance = STEADY_STROKE * (high - low) + 2.0 * (start.u_stroke_mm + last.u_stroke_mm)
    closes = np.abs(end - low) <= tolerance
    duration = last.time_s - start.leave_s
    period = 0.5 * (last.time_s + last.leave_s) - 0.5 * (start.time_s + start.leave_s)
    alike = whole[1:] & whole[:-1]
    alike &= np.abs(np.diff(distortion)) <= STEADY_DISTORTION
    near = np.zeros((2, alike.size), dtype=bool)
    for row, (own, other) in enumerate(
        ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1)))
    ):
        within = tolerance[own]
        near[row] = alike & (np.abs(high[own] - high[other]) <= within)
        near[row] &= np.abs(end[other] - low[other]) <= within
        near[row] &= np.abs(low[own] - low[other]) <= within
        with np.errstate(divide="ignore", invalid="ignore"):
            rest, with_rest = duration[own] / duration[other], period[own] / period[other]
        near[row] &= np.minimum(np.abs(rest - 1.0), np.abs(with_rest - 1.0)) <= STEADY_FREQUENCY
    repeats = np.zeros(whole.size, dtype=bool)
    repeats[:-1] |= near[0]
    repeats[1:] |= near[1]
    return np.asarray(closes & repeats)


def cycle_samples(record: Record, cycle: Cycle) -> slice:
    """Return the samples strictly inside a cycle."""
    first = int(np.searchsorted(record.time_s, cycle.start_s, side="right"))
    last = int(np.searchsorted(record.time_s, cycle.end_s, side="left"))
    return slice(first, last)


def _judge_steady(cycles: list[Cycle]) -> tuple[Cycle, ...]:
    """Judge those that are complete and not yet known to be steady."""
    judged = list(cycles)
    for position in [i for i, cycle in enumerate(cycles) if cycle.complete and not cycle.steady]:
        cycle = cycles[position]
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
        judged[position] = cycle._replace(steady=not why, why=tuple(why))
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
