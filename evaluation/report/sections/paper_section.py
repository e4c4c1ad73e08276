"""Measured values beside those that the paper prints, where the campaign file says that it is the paper's."""

from __future__ import annotations

from bufferstand.evaluation.catalogue import PUBLISHED_VALUES, QUANTITIES, PublishedValue
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    measured_cell,
    significant,
    usable,
)
from bufferstand.evaluation.report.sections.section_files import AddedSection
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.evaluation.wording import capital, label, numeral, said
from bufferstand.foundation import PAPER_CAMPAIGN

_SAME = {
    "prestress_mm": (2.0, 0.0),
    "amplitude_mm": (0.5, 0.05),
    "frequency_Hz": (0.0, 0.05),
    "stroke_max_mm": (1.0, 0.0),
    "temperature_start_C": (3.0, 0.0),
}
"""Within what a run is of the paper's step: absolute, or relative if larger."""
_NO_RUN = said("no run of this campaign is of this step")
_CORRECTED = said(
    "the paper required the stroke of the piston; here the specimen itself made the required stroke"
)
_NO_VALUE = said("the run has no such result")
_NO_U = said("the record of the run states no accuracy")
_EXPLANATION = said(
    "The campaign file says that this is the campaign of the paper “Stiffness characteristics of "
    "railway buffers: Requirements, testing and proposal of a new computational model”. These "
    "are the numbers that its text prints (§ 3.2); what it only draws, as the dynamic stiffness "
    "over the frequency (Fig. 8b), has none."
)
_SIMULATED = said(
    "The shipped specimens of the simulation were made to show the paper’s dampings: agreement "
    "of a simulated run says that the chain from the wire to this table works, and nothing of "
    "the paper’s buffers."
)
_NOTE = said(
    "Agrees: the difference is at most U of what was measured, and half a unit of the last digit "
    "that the paper prints. The paper states no uncertainty and tested specimens of its own; "
    "neither is in U. Step: required mean stroke ± amplitude and frequency; of the draw hook, "
    "stroke and temperature."
)


def paper_section(source: ReportSource) -> Section | None:
    """Return the comparison; None where no campaign file says that the campaign is the paper's."""
    runs = [run for run in source.runs if run.fact("campaign", "reproduces") == PAPER_CAMPAIGN]
    if not runs:
        return None
    kinds = {str(run.fact("specimen", "kind")) for run in runs}
    rows = [row for one in PUBLISHED_VALUES if one.specimen in kinds for row in _rows(one, runs)]
    if not rows:
        return None
    table = Table(
        said("Published and measured values"),
        (
            Column(said("Fig.")),
            Column(said("Quantity")),
            Column(said("Step")),
            Column(said("Paper")),
            Column(said("Run")),
            Column(said("Measured ± U")),
            Column(said("Difference ± U")),
            Column(said("Unit")),
            Column(said("Agrees")),
        ),
        tuple(rows),
        note=_NOTE,
        concludes=True,
    )
    texts = (_EXPLANATION, _SIMULATED) if any(run.simulated for run in runs) else (_EXPLANATION,)
    return Section("paper", said("Comparison with the paper’s figures"), (Texts(texts), table))


def _rows(one: PublishedValue, runs: list[ReportRun]) -> list[tuple[Cell, ...]]:
    of_step = [part for run in runs for part in run.parts if _is_of(one, part)]
    fitting = [run for run in of_step if not (one.of_piston and _corrected(run))]
    why = _CORRECTED if of_step else _NO_RUN
    return [_row(one, run, _NO_VALUE) for run in fitting] or [_row(one, None, why)]


def _corrected(run: ReportRun) -> bool:
    """Say whether the piston was corrected until the specimen made the required stroke."""
    return any(stroke.get("compensated") for stroke in run.strokes)


def _is_of(one: PublishedValue, run: ReportRun) -> bool:
    if run.kind != one.kind or str(run.fact("specimen", "kind")) != one.specimen:
        return False
    for name, wanted in one.step.items():
        made = run.nominal(name) if one.kind == "harmonic" else run.result(name)
        absolute, relative = _SAME[name]
        if made is None or abs(made - wanted) > max(absolute, relative * abs(wanted)):
            return False
    return True


def _row(one: PublishedValue, run: ReportRun | None, why: str) -> tuple[Cell, ...]:
    entry = QUANTITIES.named(one.quantity)
    value = None if run is None else run.result(one.quantity)
    stated = None if run is None else run.summary.get(one.quantity)
    expanded = usable(stated.get("expanded_uncertainty")) if isinstance(stated, dict) else None
    return (
        Cell(one.figure),
        Cell(label(entry.label, capital(entry.label))),
        Cell(_step(one)),
        Cell(numeral(one.printed), "number"),
        Cell(DASH, "missing", why) if run is None else Cell(run.label, "number"),
        measured_cell(value, expanded, why),
        measured_cell(None if value is None else value - one.value, expanded, why),
        Cell(entry.printed_unit),
        _agrees(one, value, expanded, why),
    )


def _agrees(one: PublishedValue, value: float | None, expanded: float | None, why: str) -> Cell:
    if value is None:
        return Cell(DASH, "missing", why)
    if expanded is None:
        return Cell(DASH, "missing", _NO_U)
    return (
        Cell(said("within U"))
        if abs(value - one.value) <= expanded + one.rounded_by
        else Cell(said("◆ beyond U"), "open")
    )


def _step(one: PublishedValue) -> str:
    numbers = [significant(value, 3) for value in one.step.values()]
    if one.kind == "harmonic":
        return said(
            "{mean} ± {half} mm, {frequency} Hz",
            mean=numbers[0],
            half=numbers[1],
            frequency=numbers[2],
        )
    return said("to {stroke} mm, {temperature} °C", stroke=numbers[0], temperature=numbers[1])


SECTION = AddedSection(paper_section, after="temperature_section")
