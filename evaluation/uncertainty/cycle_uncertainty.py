"""Uncertainties of every cycle of a run: drawn, taken from a similar cycle, or missing with a reason."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import CycleResult
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Temperature
from bufferstand.evaluation.uncertainty.cycle_propagations import Propagations
from bufferstand.evaluation.uncertainty.error_model import Draws
from bufferstand.evaluation.uncertainty.means import MeanOfDraws
from bufferstand.evaluation.uncertainty.monte_carlo import COVERAGE, expanded
from bufferstand.evaluation.uncertainty.other_draws import Known, cycle_draws, turn_draws

MOST_DRAWN = 24
"""Of a run's steady cycles, which repeat each other, at most so many are drawn, evenly spread; …"""
LEAST_DRAWN = 8
"""… of a run with several steps as many in all, but so many of each, where it has them."""
_JUDGED = {"stored_energy_J", "absorbed_energy_J"}


def with_uncertainty(
    results: Sequence[CycleResult],
    prepared: Propagations,
    draws: Draws,
    parts: Sequence[tuple[Sequence[int], MeanOfDraws]],
    temperatures: Sequence[Temperature],
    *,
    keep: bool,
) -> tuple[list[CycleResult], dict[int, Mapping[str, FloatArray]]]:
    """Return the results with U of every figure by name, and the draws of each cycle if ``keep`` is set.

    Parameters
    ----------
    results : sequence of CycleResult
    prepared : Propagations
        Of the complete cycles.
    draws : Draws
    parts : sequence of (sequence of int, MeanOfDraws)
        Cycles that stand for each step, of which its summary is the mean, and where their draws go.
    temperatures : sequence of Temperature
    keep : bool
        Draw every cycle, and return its draws.

    Notes
    -----
    Steady cycles beyond :data:`MOST_DRAWN` have the relative uncertainty of the nearest one that was drawn. A
    figure whose uncertainty cannot be had is None there, with a warning of the cycle. What is not on record
    of a cycle (``gap_limits``) is drawn with one rectangular error for the whole run: of holes at one place
    of all cycles nothing averages out.
    """
    tally = {index: mean for used, mean in parts for index in used}
    like = _alike([r.cycle.index for r in results if r.cycle.steady], [used for used, _ in parts], keep=keep)
    left_out = {index for index, drawn in like.items() if index not in drawn}
    kept: dict[int, Mapping[str, FloatArray]] = {}
    known: dict[int, CycleResult] = {}
    whole: dict[int, CycleResult] = {}  # as if all were on record
    prepared.prepare(r.cycle.index for r in results if r.cycle.index not in left_out)
    for result in results:
        index = result.cycle.index
        if index in left_out:
            continue
        if index in prepared:
            # Of a cycle whose turning points hardly differ some draws have no figures; these have no U.
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                drawn = _finite(cycle_draws(draws, prepared[index], Known(result.quantities, temperatures)))
            if result.gap_limits:
                whole[index] = _with_missing(result, {n: expanded(values) for n, values in drawn.items()})
                drawn = _finite(with_gaps(drawn, result.gap_limits, draws))
            if index in tally:
                tally[index].add(drawn)
            if keep and drawn.keys() >= _JUDGED:
                kept[index] = drawn
        else:
            with np.errstate(invalid="ignore"):  # a turn that was cut off may be anywhere
                drawn = _finite(turn_draws(draws, result.cycle, Known(result.quantities, temperatures)))
        known[index] = _with_missing(result, {name: expanded(values) for name, values in drawn.items()})
    sources = known | whole
    completed = [
        known[r.cycle.index]
        if r.cycle.index in known
        else _like(r, sources[_nearest(like[r.cycle.index], r)])
        for r in results
    ]
    return completed, kept


def _finite(drawn: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the figures of which every draw is a number."""
    return {name: values for name, values in drawn.items() if np.isfinite(values).all()}


def with_gaps(
    drawn: Mapping[str, FloatArray], limits: Mapping[str, float], draws: Draws
) -> dict[str, FloatArray]:
    """Return drawn figures with what is not on record: one error for all of them, by their limits."""
    return {name: values + limits.get(name, 0.0) * draws.unrecorded for name, values in drawn.items()}


def _alike(steady: Sequence[int], parts: Sequence[Sequence[int]], *, keep: bool) -> dict[int, frozenset[int]]:
    """Return, of each steady cycle, the cycles of its step that are drawn: it is one of these, or like one.

    Steady cycles of no step make a group of their own.
    """
    alike: dict[int, frozenset[int]] = {}
    wanted = set(steady)
    groups = [[index for index in part if index in wanted] for part in parts]
    groups.append(sorted(wanted.difference(*groups)))
    most = max(LEAST_DRAWN, MOST_DRAWN // max(1, len(parts)))
    for group in groups:
        drawn = frozenset(group if keep else _spread(group, most))
        alike.update(dict.fromkeys(group, drawn))
    return alike


def _spread(indices: Sequence[int], most: int) -> list[int]:
    if len(indices) <= most:
        return list(indices)
    return [indices[i] for i in np.unique(np.linspace(0, len(indices) - 1, most).round().astype(int))]


def _nearest(drawn: Collection[int], result: CycleResult) -> int:
    return min(sorted(drawn), key=lambda index: abs(index - result.cycle.index))


def _like(result: CycleResult, other: CycleResult) -> CycleResult:
    """Return a steady cycle with the relative uncertainties of another one."""
    known: dict[str, float | None] = {}
    for name, expanded_there in other.expanded_uncertainty.items():
        here, there = getattr(result.quantities, name), getattr(other.quantities, name)
        if expanded_there is not None and here is not None:
            # Of what may be close to 0 the uncertainty itself is the same, not its share.
            like = expanded_there * abs(here / there) if name in _SHARES else expanded_there
            by_gaps = COVERAGE * result.gap_limits.get(name, 0.0) / _SQRT3
            known[name] = float(np.hypot(like, by_gaps)) if by_gaps else like
    return _with_missing(result, known)


_SQRT3 = float(np.sqrt(3.0))
_SHARES = frozenset(entry.name for entry in QUANTITIES if entry.like == "share")


def _with_missing(result: CycleResult, known: Mapping[str, float | None]) -> CycleResult:
    """Return the result with U, None for each figure that has none, and a warning that says why."""
    missing: dict[str, list[str]] = {}
    uncertainty: dict[str, float | None] = dict(known)
    for entry, value in zip(QUANTITIES, result.quantities, strict=True):
        if entry.name not in uncertainty and value is not None:
            uncertainty[entry.name] = None
            missing.setdefault(entry.why_no_u, []).append(entry.name)
    texts = [f"no uncertainty of {', '.join(names)}: {why}" for why, names in missing.items()]
    reasons = {f"U({name})": why for why, names in missing.items() for name in names}
    return result._replace(
        expanded_uncertainty=uncertainty,
        warnings=(*result.warnings, *texts),
        missing={**result.missing, **reasons},
    )
