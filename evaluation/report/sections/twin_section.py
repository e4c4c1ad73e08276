"""What the twin said while the runs were made: cycles outside the band of the fitted model."""

from __future__ import annotations

from bufferstand.evaluation.report.content import DASH, Cell, Column, Section, Table, Texts, significant
from bufferstand.evaluation.report.sections.section_files import AddedSection
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import said

TWIN = "twin"
"""Kind of the events."""


def twin_section(source: ReportSource) -> Section | None:
    """Return every event of the twin, run by run; None where there is none."""
    rows = tuple(
        (
            Cell(str(run.number), "number"),
            _time(time_s),
            Cell(text, "open"),
        )
        for run in source.runs
        for time_s, kind, text in run.events
        if kind == TWIN
    )
    if not rows:
        return None
    explained = said(
        "While the runs were made, each finished cycle was compared with a model fitted before. These runs "
        "of cycles lay outside its band. What would explain them is told from force and stroke alone."
    )
    table = Table(
        said("Cycles outside the band"),
        (Column(said("Run")), Column(said("Time"), "s"), Column(said("Finding"))),
        rows,
    )
    return Section("twin", said("Runs against the fitted model"), (Texts((explained,)), table), annex=True)


def _time(time_s: float | None) -> Cell:
    if time_s is None:
        return Cell(DASH, "missing", said("not recorded"))
    return Cell(significant(time_s, 4), "number")


SECTION = AddedSection(twin_section, after="plausibility_section")
