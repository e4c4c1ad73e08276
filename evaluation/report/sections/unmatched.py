"""Why steps of a comparison have no counterpart: which condition differs from the nearest, by how much."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from bufferstand.evaluation.report.content import Cell, Column, Table
from bufferstand.evaluation.report.source import (
    ComparedSpecimen,
    ComparedSpecimens,
    Condition,
    ReportRun,
    alone,
    nearest_step,
    numbers_text,
    runs_text,
    step_differences,
    step_words,
)
from bufferstand.evaluation.wording import capital, joined, kind_words, said


def unmatched_table(sides: ComparedSpecimens, conditions: Sequence[Condition]) -> Table | None:
    """Return a row for each step that only one of the specimens has run; None where there is none.

    Parameters
    ----------
    sides : ComparedSpecimens
        What is compared.
    conditions : sequence of Condition
        The steps that two or more have run.
    """
    found: dict[tuple[str, str, str, str], list[int]] = {}
    for run in alone(sides, conditions):
        of = next(side for side in sides.sides if any(run.number == one.number for one in side.source.runs))
        for other in sides.sides:
            if other is not of:
                why = why_unmatched(run, other)
                found.setdefault((of.letter, step_words(run), other.letter, why), []).append(run.number)
    if not found:
        return None
    return Table(
        said("Steps without a counterpart"),
        (
            Column(said("Of")),
            Column(said("Run")),
            Column(said("Step")),
            Column(said("Not on")),
            Column(said("Because")),
        ),
        tuple(
            (
                Cell(of),
                Cell(_numbers(numbers)),
                Cell(step),
                Cell(other),
                Cell(capital(why)),
            )
            for (of, step, other, why), numbers in found.items()
        ),
        note=said("Compared is the run of the other specimen that is nearest to the step."),
    )


def why_unmatched(run: ReportRun, other: ComparedSpecimen) -> str:
    """Return in words why a run has no counterpart among the runs of another specimen."""
    candidates = [part for whole in other.source.runs for part in whole.parts]
    nearest = nearest_step(run, candidates)
    if nearest is None:
        return said("{letter} has no {kind} run", letter=other.letter, kind=kind_words(run.kind))
    apart = step_differences(run, nearest)
    if not apart:
        return said(
            "{letter} has run this step fewer times ({run})", letter=other.letter, run=_times(run, candidates)
        )
    one, two = said("run {label}", label=run.label), said("run {label}", label=nearest.label)
    return said("{two} is the nearest: ", two=two) + joined("; ", (each.sentence(one, two) for each in apart))


def _times(run: ReportRun, candidates: Collection[ReportRun]) -> str:
    like = {one.number for one in candidates if one.kind == run.kind and not step_differences(run, one)}
    return runs_text(like)


def _numbers(numbers: Sequence[int]) -> str:
    return numbers_text(set(numbers))
