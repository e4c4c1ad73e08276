"""Holds, residual strokes, settling and cumulated energy of a run, from its record and its cycles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import hypot

import numpy as np

from bufferstand.evaluation.catalogue import QUANTITIES, SETTLING
from bufferstand.evaluation.facts import (
    CumulatedEnergy,
    Cycle,
    CycleResult,
    HoldKind,
    PerDecade,
    RecordedHold,
    ResidualStroke,
    RunFacts,
    RunHistory,
    Settling,
    StepResult,
)
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty import COVERAGE, MeanOfDraws, Noise, turn_share
from bufferstand.foundation.channels import ChannelUncertainty

LEAST_HOLD_S = 1.0
"""A shorter dwell is no hold, a shorter rest no pause."""
_LEAST_SAMPLES = 40
_ENDS = 0.05
"""Share of a hold over which its start and its end are averaged."""
_FROM = 0.02
"""The line over log time begins at this share of the hold: the arrival itself is no relaxation."""
_RULES = 4.0
"""The stroke creeps, or the force relaxes, if it changes by so many times the other's share of itself."""
SETTLED = 0.02
_RAMP = (0.6, 0.9)
"""The speed at which a stroke arrives is that between these shares of the cycle's range …"""
_SLOWER = 0.25
"""… and it has arrived where it moves at less than this share of it …"""
_LAG = 0.01
"""… over this share of the samples before."""
_LEAST_CYCLES = 3
_LEAST_SCATTER = 4
_MOST_CORRELATED = 0.98
_CONFIDENCE = 0.9545
"""That of two standard deviations of a normal distribution."""


def history_of(
    record: Record,
    facts: RunFacts,
    results: Sequence[CycleResult],
    steps: Sequence[StepResult],
    tallies: Sequence[MeanOfDraws] = (),
    noise: Noise | None = None,
    *,
    asked: bool = True,
) -> RunHistory:
    """Return what a run holds besides the figures of its cycles.

    Parameters
    ----------
    record : Record
        As its cycles were evaluated.
    facts : RunFacts
    results : sequence of CycleResult
        In order of time.
    steps : sequence of StepResult
        Of a run with several: each settles by itself.
    tallies : sequence of MeanOfDraws
        The draws of the cycles of the run, or of each of its steps.
    noise : Noise, optional
        That of the record; without it, it is taken for white.
    asked : bool
        Whether expanded uncertainties of what settles are asked for.
    """
    complete = [r for r in results if r.cycle.complete]
    parts: list[tuple[int | None, list[CycleResult]]] = [(None, complete)]
    if steps:
        parts = [(s.index, _of_cycles(complete, s.cycles)) for s in steps]
    drawn = tallies if len(tallies) == len(parts) else [MeanOfDraws()] * len(parts)
    cycles = [r.cycle for r in complete]
    holds = [_hold(record, facts, cycle) for cycle in cycles if cycle.top.dwell_s >= LEAST_HOLD_S]
    return RunHistory(
        holds=tuple(found for found in holds if found is not None),
        residual_strokes=tuple(
            _residual(cycle, noise) for cycle in cycles if cycle.end.dwell_s >= LEAST_HOLD_S
        ),
        settling=tuple(
            change
            for (part, own), tally in zip(parts, drawn, strict=True)
            for change in _settling(part, own, tally, asked=asked)
        ),
        cumulated=_cumulated(results),
    )


def _of_cycles(results: Sequence[CycleResult], numbers: Sequence[int]) -> list[CycleResult]:
    wanted = set(numbers)
    return [r for r in results if r.cycle.index in wanted]


def _hold(record: Record, facts: RunFacts, cycle: Cycle) -> RecordedHold | None:
    start_s, off_s = _arrival_s(record, cycle)
    end_s = cycle.top.leave_s
    first, last = np.searchsorted(record.time_s, (start_s, end_s)).tolist()
    if last - first < _LEAST_SAMPLES or record.has_break(first, last - 1):
        return None
    time_s = record.time_s[first:last] - start_s
    force_kN, stroke_mm = record.force_kN[first:last], record.stroke_mm[first:last]
    forces, strokes = _ends_of(force_kN), _ends_of(stroke_mm)
    noise = _per_decade(time_s, stroke_mm, 0.0, off_s)
    moves = abs(noise.value) > (noise.expanded_uncertainty or 0.0)
    by_stroke = abs(strokes[1] - strokes[0]) / cycle.range_mm
    by_force = abs(forces[1] - forces[0]) / max(abs(forces[0]), abs(forces[1]), 1e-9)
    # Where the stroke does not move beyond its noise, it is the stroke that the stand held.
    kind: HoldKind = "mixed"
    if not moves or by_force > _RULES * by_stroke:
        kind = "relaxation"
    elif by_stroke > _RULES * by_force:
        kind = "creep"
    wire = facts.stroke_uncertainty[0] if facts.stroke_uncertainty else None
    return RecordedHold(
        cycle=cycle.index,
        kind=kind,
        start_s=start_s,
        duration_s=end_s - start_s,
        force_start_kN=forces[0],
        force_end_kN=forces[1],
        stroke_start_mm=strokes[0],
        stroke_end_mm=strokes[1],
        force_per_decade_kN=_per_decade(time_s, force_kN, _share(facts.force_uncertainty), off_s),
        stroke_per_decade_mm=_per_decade(time_s, stroke_mm, _share(wire), off_s),
    )


def _arrival_s(record: Record, cycle: Cycle) -> tuple[float, float]:
    """Return when the stroke arrived at the top, when it became four times slower than it came; and by how
    much that may be off [s].

    Of a stroke that creeps the turning point is later: there it has become as good as steady. But a hold
    begins where the motion ends, and decades of time are counted from there.
    """
    first, last = np.searchsorted(record.time_s, (cycle.start_s, cycle.top.time_s)).tolist()
    time_s, stroke_mm = record.time_s[first:last], record.stroke_mm[first:last]
    if time_s.size < _LEAST_SAMPLES:
        return cycle.top.time_s, cycle.top.u_time_s
    levels = cycle.stroke_min_mm + cycle.range_mm * np.array(_RAMP)
    one, two = (int(np.argmax(stroke_mm >= level)) for level in levels)
    lag = max(3, int(_LAG * two))
    if not 0 < one < two or two + lag >= time_s.size:
        return cycle.top.time_s, cycle.top.u_time_s
    speed = float((stroke_mm[two] - stroke_mm[one]) / (time_s[two] - time_s[one]))
    ahead = stroke_mm[two + lag :] - stroke_mm[two:-lag]
    slow = np.flatnonzero(ahead < _SLOWER * speed * (time_s[two + lag :] - time_s[two:-lag]))
    if not slow.size:
        return cycle.top.time_s, cycle.top.u_time_s
    row = two + int(slow[0])
    return float(time_s[row + round(_SLOWER * lag)]), 0.5 * float(time_s[row + lag] - time_s[row])


def _share(stated: ChannelUncertainty | None) -> float | None:
    """Return the limit of a channel's relative error; 0 where it states others, None where none at all."""
    return None if stated is None else 0.01 * (stated.accuracy_percent or 0.0)


def _ends_of(values: FloatArray) -> tuple[float, float]:
    some = max(3, int(_ENDS * values.size))
    return float(np.mean(values[:some])), float(np.mean(values[-some:]))


def _per_decade(time_s: FloatArray, values: FloatArray, share: float | None, off_s: float) -> PerDecade:
    """Return the slope of values over log10 of time, by least squares, every decade with the same weight.

    A time that is off by ``off_s`` gives another slope: that is part of u. Neighbouring residuals that go
    together count as fewer (r: their correlation): u grows by √((1 + r) / (1 - r)). The channel's zero
    cancels, its scale does not.
    """
    late = time_s >= _FROM * time_s[-1]
    at_s, y = time_s[late], values[late]
    weight = 1.0 / at_s  # even samples are dense in log time towards the end
    weight /= np.sum(weight)
    slope, centred, spread = _weighted_slope(np.log10(at_s), y, weight)
    moved = _weighted_slope(np.log10(at_s + off_s), y, weight)[0] - slope
    rest = y - float(np.sum(weight * y)) - slope * centred
    variance = float(np.mean(rest**2))
    near = float(np.mean(rest[1:] * rest[:-1])) / variance if variance > 0.0 else 0.0
    r = min(max(near, 0.0), _MOST_CORRELATED)
    u = float(np.sqrt(variance * np.sum((weight * centred) ** 2) * (1.0 + r) / (1.0 - r))) / spread
    if share is None:
        return PerDecade(slope, None, float(np.sqrt(variance)))
    expanded = COVERAGE * float(np.linalg.norm((u, moved, share * slope / np.sqrt(3.0))))
    return PerDecade(slope, expanded, float(np.sqrt(variance)))


def _weighted_slope(x: FloatArray, y: FloatArray, weight: FloatArray) -> tuple[float, FloatArray, float]:
    """Return the slope of y over x, x less its mean, and the spread of x."""
    centred = x - float(np.sum(weight * x))
    spread = float(np.sum(weight * centred**2))
    return float(np.sum(weight * centred * y)) / spread, centred, spread


def _residual(cycle: Cycle, noise: Noise | None) -> ResidualStroke:
    turns = (cycle.start, cycle.end)
    shares = [1.0 if noise is None else turn_share(noise, turn) for turn in turns]
    u = hypot(*(share * turn.u_stroke_mm for share, turn in zip(shares, turns, strict=True)))
    return ResidualStroke(
        cycle=cycle.index,
        residual_mm=cycle.stroke_end_mm - cycle.stroke_min_mm,
        expanded_uncertainty=COVERAGE * u,
        pause_s=cycle.end.dwell_s,
        recovered_mm=cycle.end.stroke_mm - cycle.end.leave_mm,
    )


def _settling(
    part: int | None, results: Sequence[CycleResult], drawn: MeanOfDraws, *, asked: bool
) -> list[Settling]:
    number = np.array([r.cycle.index for r in results], dtype=np.float64)
    columns = dict(zip(QUANTITIES.names, zip(*(r.quantities for r in results), strict=True), strict=False))
    found = []
    for name in SETTLING.names if results else ():
        values = np.array(columns[name], dtype=np.float64)  # None becomes NaN
        known = ~np.isnan(values)
        if np.count_nonzero(known) >= _LEAST_CYCLES:
            noise = drawn.noise_variance(name) if drawn.known(name) else 0.0
            ends = [results[at] for at in np.flatnonzero(known)[[0, -1]]]
            U = _expanded(name, values[known], noise, ends) if asked else None
            found.append(_settled(name, part, number[known], values[known], U))
    return found


def _settled(
    name: str, part: int | None, number: FloatArray, values: FloatArray, U: float | None
) -> Settling:
    first, last = float(values[0]), float(values[-1])
    half = slice(min(values.size // 2, values.size - 2), None)
    apart = number[half] - np.mean(number[half])
    late = float(np.mean(values[-max(1, values.size // 4) :]))
    away = np.flatnonzero(np.abs(values - late) > SETTLED * abs(late))
    settled = 0 if away.size == 0 else int(away[-1]) + 1
    return Settling(
        quantity=name,
        part=part,
        first_cycle=int(number[0]),
        last_cycle=int(number[-1]),
        first=first,
        last=last,
        relative_change=(last - first) / abs(first) if first else None,
        expanded_uncertainty=U,
        rate_per_cycle=float(np.sum(apart * values[half]) / np.sum(apart**2)),
        settled_at_cycle=int(number[settled]) if settled < number.size else None,
    )


def _expanded(name: str, values: FloatArray, noise: float, ends: Sequence[CycleResult]) -> float | None:
    """Return U of the difference of two values, by the variance of their noise where it is known.

    How blunt a turn is taken for hangs on where the samples lie about its tip, and differs from stroke to
    stroke. What is common to all cycles cancels but for its share of the change itself.
    """
    if not noise:
        return _of_difference(values)
    blunt = [_by_blunt_turns(name, end) for end in ends]
    scale = _scale_u(name, ends[0]) * float(values[-1] - values[0])
    return COVERAGE * float(np.linalg.norm((np.sqrt(2.0 * noise), *blunt, scale)))


def _by_blunt_turns(name: str, result: CycleResult) -> float:
    """Return the standard uncertainty of W_s [J] or D of one cycle by how blunt its turns are: F u(x)."""
    figures, cycle = result.quantities, result.cycle
    stored_J, forces = figures.stored_energy_J, (figures.force_min_kN, figures.force_max_kN)
    if name not in ("stored_energy_J", "damping") or not stored_J:
        return 0.0
    turns = zip(forces, (cycle.start, cycle.top), strict=True)
    u_J = hypot(*(0.5 * turn.blunt_mm * (force_kN or 0.0) for force_kN, turn in turns))
    return u_J if name == "stored_energy_J" else abs(figures.damping or 0.0) * u_J / stored_J


def _scale_u(name: str, result: CycleResult) -> float:
    """Return the relative standard uncertainty by errors in proportion to a figure; of W_s that of W_a,
    where the force's zero has no part, if that is less.
    """
    names = {"stored_energy_J": ("stored_energy_J", "absorbed_energy_J")}.get(name, (name,))
    shares = []
    for one in names:
        value, U = getattr(result.quantities, one), result.expanded_uncertainty.get(one)
        if value and U is not None:
            shares.append(U / COVERAGE / abs(value))
    return min(shares, default=0.0)


def _of_difference(values: FloatArray) -> float | None:
    """Return U of the difference of two values, by what second differences say of their scatter.

    Second differences of white noise have six times its variance, and a steady drift leaves them. So few of
    them are a poor estimate: the coverage factor is Student's (JCGM 100, G.6.4).
    """
    if values.size < _LEAST_SCATTER:
        return None
    variance = float(np.mean(np.diff(values, 2) ** 2)) / 6.0
    return _student(values.size - 2) * float(np.sqrt(2.0 * variance))


@lru_cache(maxsize=64)
def _student(differences: int) -> float:
    """Return the coverage factor for 95.45 % of a variance by so many second differences of white noise.

    Neighbouring ones are correlated by -2/3, the next but one by 1/6, so that they count as fewer.
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

    pairs = (differences - 1) * (2.0 / 3.0) ** 2 + (differences - 2) * (1.0 / 6.0) ** 2
    freedom = differences**2 / (differences + 2.0 * pairs)
    return float(stdtrit(freedom, 0.5 * (1.0 + _CONFIDENCE)))


def _cumulated(results: Sequence[CycleResult]) -> CumulatedEnergy | None:
    energies = [r.quantities.absorbed_energy_J for r in results]
    known = [(r, energy) for r, energy in zip(results, energies, strict=True) if energy is not None]
    if not known:
        return None
    each = [r.expanded_uncertainty.get("absorbed_energy_J") for r, _ in known]
    stated = [U for U in each if U is not None]
    left = tuple(r.cycle.index for r, energy in zip(results, energies, strict=True) if energy is None)
    return CumulatedEnergy(
        absorbed=float(sum(energy for _, energy in known)),
        expanded_uncertainty=sum(stated) if len(stated) == len(each) else None,
        cycles=len(known),
        not_evaluated=left,
    )
