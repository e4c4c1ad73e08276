"""Plausibility findings of the runs in a report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    significant,
    usable,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource, runs_text
from bufferstand.evaluation.wording import capital, channel_words, effect_words, finding_words, joined, said

_EXPLANATION = said(
    "Every channel is looked at as it was recorded, and the cycles as a set. Where a finding "
    "spoils a channel, what is read from it in these cycles has no uncertainty, is left out of "
    "means while other cycles remain, and nothing is concluded from it: the requirement is "
    "inconclusive. What is noted was left out or changes no figure by more than its uncertainty "
    "says."
)
_NO_SIZE = said("it has no size")
_MOST_CYCLES = 4


def plausibility_section(source: ReportSource) -> Section | None:
    """Return the findings run by run; None where there are none."""
    rows = [_row(run, finding) for run in source.runs for finding in _findings(run)]
    if not rows:
        return None
    table = Table(
        said("Findings"),
        (
            Column(said("Run")),
            Column(said("Channel")),
            Column(said("Finding")),
            Column(said("From"), "s"),
            Column(said("to"), "s"),
            Column(said("Cycles")),
            Column(said("Size")),
            Column(said("Unit")),
            Column(said("Effect")),
        ),
        tuple(rows),
        note=said("Each of them in words, and what to do about it: Warnings."),
    )
    return Section(
        "plausibility", said("Plausibility of the channels"), (Texts((_EXPLANATION,)), table), annex=True
    )


def spoiled_notice(source: ReportSource) -> tuple[str, ...]:
    """Return which runs have a channel that is not to be believed; nothing where none has."""
    spoiled = [run.number for run in source.runs if any(f["effect"] == "spoils" for f in _findings(run))]
    if not spoiled:
        return ()
    named = runs_text(spoiled)
    text = said("a channel is not to be believed; see Plausibility before using any result.")
    return (said("{named}: {text}", named=capital(named), text=text),)


def _findings(run: ReportRun) -> list[Mapping[str, Any]]:
    return list(run.evaluated.get("plausibility") or ())


def _row(run: ReportRun, finding: Mapping[str, Any]) -> tuple[Cell, ...]:
    size = usable(finding["size"])
    return (
        Cell(str(run.number), "number"),
        Cell(channel_words(finding["channel"])),
        Cell(finding_words(finding["kind"])),
        Cell(significant(finding["start_s"], 5), "number"),
        Cell(significant(finding["end_s"], 5), "number"),
        Cell(_cycles(run, finding["cycles"])),
        Cell(DASH, "missing", _NO_SIZE) if size is None else Cell(significant(size, 3), "number"),
        Cell(str(finding["unit"])),
        Cell(effect_words(finding["effect"]), "bad" if finding["effect"] == "spoils" else "open"),
    )


def _cycles(run: ReportRun, numbers: list[int]) -> str:
    if not numbers:
        return said("none")
    if len(numbers) == len(run.cycles):
        return said("all")
    if len(numbers) <= _MOST_CYCLES:
        return joined(", ", map(str, numbers))
    return said(
        "{count_of_numbers} of {numbers} to {numbers_2}",
        count_of_numbers=len(numbers),
        numbers=numbers[0],
        numbers_2=numbers[-1],
    )
