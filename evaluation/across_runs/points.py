"""A run as points of a trend or a comparison: itself, or each of its steps."""

from __future__ import annotations

from dataclasses import replace

from bufferstand.evaluation.facts import RunEvaluation


def points_of(run: RunEvaluation) -> tuple[RunEvaluation, ...]:
    """Return the run; of one with several steps a result for each, whose id is ``run#step``.

    Such a result has the facts of its run, and the summary, budget and mean loop of its step; requirements
    and verdict stay with the run.
    """
    return tuple(
        replace(
            run,
            facts=replace(run.facts, id=f"{run.facts.id}#{step.index}"),
            summary=step.summary,
            budget=step.budget,
            skew_sensitivity=step.skew_sensitivity,
            mean_loop=step.mean_loop,
            shared_errors=step.shared_errors,
            unfit=step.unfit,
            requirements=(),
            preload=None,
            verdict=None,
            steps=(),
        )
        for step in run.steps
    ) or (run,)
