"""Means without spoiled cycles. If no other cycle remains, means without an uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from bufferstand.evaluation.facts import CycleResult
from bufferstand.evaluation.plausibility import SpoiledFigures, summary_without_claims
from bufferstand.evaluation.run.steps.division import Division, divide
from bufferstand.evaluation.run.steps.step_figures import StepFigures
from bufferstand.foundation import Kind


def division_without(
    kind: Kind,
    results: Sequence[CycleResult],
    numbered: Callable[[Sequence[int]], str],
    spoiled: SpoiledFigures,
) -> Division:
    """Return the steps of a run, whose means are of cycles that are not spoiled where there are any.

    A spoiled stroke makes no step. Cycles whose force alone is spoiled belong to their step, but not to its
    mean, unless they all are spoiled.

    Parameters
    ----------
    kind : Kind
    results : sequence of CycleResult
    numbered : callable
        Puts numbers of cycles in words.
    spoiled : Spoiled
    """
    out = spoiled.cycles
    if not out:
        return divide(kind, results, numbered)
    division = divide(kind, results, numbered, spoiled.cycles_of_stroke)
    if not division.parts:
        division = divide(kind, results, numbered)
    parts, why = [], list(division.why)
    for part in division.parts:
        used = tuple(number for number in part.used if number not in out)
        if used and len(used) < len(part.used):
            left = tuple(number for number in part.used if number in out)
            why.append(f"{numbered(left)}: not among the means: a channel is not to be believed there")
        parts.append(replace(part, used=used or part.used))
    return replace(division, parts=tuple(parts), why=tuple(why))


def summed_without_claims(
    whole: StepFigures, spoiled: SpoiledFigures, complete: Sequence[int]
) -> StepFigures:
    """Return what stands for a run without the uncertainties of means of spoiled cycles.

    What a channel shows that is not to be believed has an error that no certificate states: budget, shared
    errors and uncertainties of such means would be untrue, and are left out.

    Parameters
    ----------
    whole : SummedUp
    spoiled : Spoiled
    complete : sequence of int
        Numbers of the run's complete cycles. They stand for a run that has no means.

    Returns
    -------
    SummedUp
        Unfit is a run whose means are of spoiled cycles; one of several steps if all of them are; one
        without means if all its complete cycles are spoiled.
    """
    out = spoiled.cycles
    if not out:
        return whole
    steps = tuple(
        replace(
            step,
            summary=summary_without_claims(step.summary, spoiled),
            budget=(),
            shared_errors=None,
            unfit=True,
        )
        if out & set(step.summary.cycles_used)
        else step
        for step in whole.steps
    )
    used = set(whole.summary.cycles_used)
    if not used:
        unfit = all(step.unfit for step in steps) if steps else bool(complete) and out >= set(complete)
        return replace(whole, steps=steps, unfit=unfit)
    if not out & used:
        return replace(whole, steps=steps)
    return replace(
        whole,
        summary=summary_without_claims(whole.summary, spoiled),
        budget=(),
        shared_errors=None,
        steps=steps,
        unfit=True,
    )


def unfit_warnings(whole: StepFigures) -> list[str]:
    """Return that means are of spoiled cycles, and what follows of it."""
    text = "all its cycles are spoiled: its means stay, without uncertainties, and are left out of trends"
    if whole.steps:
        return [f"step {step.index}: {text}" for step in whole.steps if step.unfit]
    return [text] if whole.unfit and whole.summary.cycles_used else []
