"""The figures that stand for a run, or for each of its steps: summary, budget, mean loop, effect of skew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bufferstand.evaluation.facts import (
    Budget,
    CycleResult,
    MeanLoop,
    RunFacts,
    SharedErrors,
    SkewSensitivity,
    StepResult,
    Summary,
)
from bufferstand.evaluation.loops import CutLoops, InertiaForce, mean_loop
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.run.steps.division import Division
from bufferstand.evaluation.uncertainty import MeanOfDraws, Propagations, Regression, summarise
from bufferstand.evaluation.uncertainty.skew import skew_sensitivity


@dataclass(frozen=True, eq=False)
class StepFigures:
    """What stands for a run. Of a run with several steps only ``steps`` does, and the rest is empty."""

    summary: Summary
    budget: tuple[Budget, ...] = ()
    skew_sensitivity: SkewSensitivity | None = None
    mean_loop: MeanLoop | None = None
    shared_errors: SharedErrors | None = None
    steps: tuple[StepResult, ...] = ()
    unfit: bool = False
    """Whether its means are of spoiled cycles; where it has none, whether its complete cycles are."""


@dataclass(frozen=True, eq=False)
class EvaluatedCycles:
    """A run whose cycles are evaluated, and what its figures were propagated with.

    ``regression`` is on the errors that were drawn (None: none could be). ``tallies`` are what they make of
    the figures of each step of the division, in their order; where there is no step, of the complete cycles.
    ``budgets``: whether uncertainties were asked for.
    """

    record: Record
    facts: RunFacts
    results: Sequence[CycleResult]
    loops: CutLoops
    prepared: Propagations
    tallies: Sequence[MeanOfDraws]
    regression: Regression | None
    budgets: bool
    added: InertiaForce | None = None


def sum_up(run: EvaluatedCycles, division: Division) -> StepFigures:
    """Return what stands for a run, or for each of its steps.

    Parameters
    ----------
    run : Evaluated
    division : Division
    """
    if not division.several:
        whole = _summed(run, division.used, run.tallies[0] if run.tallies else MeanOfDraws())
        # Where no cycle is steady, the complete ones make the loop; cycles of a sweep are not alike.
        return replace(whole, mean_loop=None) if division.loose and not division.parts else whole
    by_number = {result.cycle.index: result.cycle for result in run.results}
    steps = []
    for number, (part, tally) in enumerate(zip(division.parts, run.tallies, strict=True), 1):
        own = _summed(run, part.used, tally)
        steps.append(
            StepResult(
                index=number,
                start_s=by_number[part.cycles[0]].start_s,
                end_s=by_number[part.cycles[-1]].end_s,
                cycles=part.cycles,
                summary=own.summary,
                budget=own.budget,
                skew_sensitivity=own.skew_sensitivity,
                mean_loop=own.mean_loop,
                shared_errors=own.shared_errors,
            )
        )
    return StepFigures(summarise((), (), MeanOfDraws()), steps=tuple(steps))


def _summed(run: EvaluatedCycles, used: tuple[int, ...], tally: MeanOfDraws) -> StepFigures:
    summary = summarise(run.results, used, tally)
    budget: tuple[Budget, ...] = ()
    if run.budgets:
        from bufferstand.evaluation.uncertainty import run_budget  # noqa: PLC0415 - GTC is slow to import

        stated = run.facts.force_uncertainty, run.facts.stroke_uncertainty
        budget = run_budget(*stated, run.prepared, summary, run.added, _gap_limits(run.results, used))
    shared = None
    if run.regression is not None and tally.drawn:
        found = {name: run.regression.contributions(values) for name, values in tally.means().items()}
        shared = run.regression.shared(found)
    return StepFigures(
        summary, budget, _skew(run, used), mean_loop(run.record, run.results, used, run.loops), shared
    )


def _gap_limits(results: Sequence[CycleResult], used: Sequence[int]) -> dict[str, float]:
    """Return the limits by which what is not on record may change the means over cycles.

    The bounds of single cycles have signs, and are one error for the whole run: so their mean has, too.
    """
    wanted = set(used)
    each = [result.gap_limits for result in results if result.cycle.index in wanted]
    names = dict.fromkeys(name for limits in each for name in limits)
    return {name: sum(limits.get(name, 0.0) for limits in each) / len(each) for name in names}


def _skew(run: EvaluatedCycles, used: Sequence[int]) -> SkewSensitivity:
    wanted = set(used)
    chosen = [result for result in run.results if result.cycle.index in wanted]
    return skew_sensitivity(
        run.record,
        [result.cycle for result in chosen],
        periodic=run.facts.kind in ("static", "harmonic"),
        storage_stiffness_kN_per_mm=[result.quantities.storage_stiffness_kN_per_mm for result in chosen],
    )
