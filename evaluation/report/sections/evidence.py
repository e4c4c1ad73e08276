"""Sections on skew of force and stroke, agreement of the draw wires, inertia, and temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.across_runs import FIGURES as COMPARED
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    fixed,
    measured_cell,
    quantity_cell,
    significant,
    to_digits,
    usable,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.evaluation.wording import label, numeral, said

_EXPLANATION = said(
    "A force that is recorded late or early against the stroke changes the area of the loop: the "
    "first columns say by how much 1 ms more delay of the force would change it. Draw wires: the "
    "largest difference between the two, the part of it that is not linear in the stroke (tilt), and the "
    "difference that their stated accuracy permits. Inertia: the force of the mass between load cell and "
    "specimen, which is added to the measured one."
)
_NO_SKEW = said("no cycle that could be shifted")
_NO_SHARE = said("the result itself is missing or less than the change")
_ONE_WIRE = said("the record has no two draw wires")
_NO_LIMIT = said("the channels state no accuracy")
_WIRE_OUT = said("a draw wire is out: the other one alone is the stroke")
FIGURES = (
    ("end_force_kN", said("End force"), "kN"),
    *((entry.name, label(entry.label), entry.printed_unit) for entry in map(QUANTITIES.named, COMPARED[1:])),
)
"""What is compared at equal stroke, as the evaluation document names it."""


def evidence_section(source: ReportSource) -> Section | None:
    """Return the table of skew, wires and inertia by run; None where no run has anything to say."""
    keys = ("skew_sensitivity", "draw_wires", "inertia_correction")
    runs = [run for run in source.runs if any(run.evaluated.get(key) for key in keys)]
    if not runs:
        return None
    table = Table(
        said("Skew, draw wires and inertia"),
        (
            Column(said("Run")),
            Column(said("Wₐ per ms"), "J"),
            Column(said("Wₐ per ms"), "%"),
            Column(said("Damping per ms"), "–"),
            Column(said("Damping per ms"), "%"),
            Column(said("Wires differ by"), "mm"),
            Column(said("of it tilt"), "mm"),
            Column(said("permitted"), "mm"),
            Column(said("Inertia")),
        ),
        tuple(_row(run) for run in runs),
    )
    return Section(
        "evidence", said("Skew, draw wires and inertia"), (Texts((_EXPLANATION,)), table), annex=True
    )


def _row(run: ReportRun) -> tuple[Cell, ...]:
    return (
        Cell(str(run.number), "number"),
        *_skew(run, "absorbed_energy_J"),
        *_skew(run, "damping"),
        *_wires(run.evaluated.get("draw_wires")),
        Cell(inertia_text(run.evaluated.get("inertia_correction"))),
    )


def _skew(run: ReportRun, name: str) -> tuple[Cell, Cell]:
    skew = run.evaluated.get("skew_sensitivity") or {}
    change, own = usable((skew.get(f"{name}_per_ms") or {}).get("by_shifting")), run.result(name)
    if change is None:
        return (Cell(DASH, "missing", _NO_SKEW),) * 2
    shown = Cell(signed(change, 3), "number")
    if not own or abs(change) > abs(own):
        return shown, Cell(DASH, "missing", _NO_SHARE)
    return shown, Cell(signed(100.0 * change / abs(own), 2), "number")


def signed(value: float, digits: int) -> str:
    """Return a change with its sign, with just so many significant digits."""
    return ("+" if value > 0.0 else "") + to_digits(value, digits)


def _wires(wires: Mapping[str, Any] | None) -> tuple[Cell, Cell, Cell]:
    if not wires:
        return (Cell(DASH, "missing", _ONE_WIRE),) * 3
    tilt, limit = usable(wires.get("remaining_mm")), usable(wires.get("limit_mm"))
    why_no_tilt = _WIRE_OUT if wires.get("out") else said("the stroke does not move")
    return (
        Cell(fixed(float(wires["largest_difference_mm"]), 2), "number"),
        Cell(DASH, "missing", why_no_tilt) if tilt is None else Cell(fixed(tilt, 2), "number"),
        Cell(DASH, "missing", _NO_LIMIT) if limit is None else Cell(fixed(limit, 2), "number"),
    )


def inertia_text(inertia: Mapping[str, Any] | None) -> str:
    """Return what was done about inertia, in words."""
    mass = usable((inertia or {}).get("moving_mass_kg"))
    if inertia is None or not mass:
        return said("not corrected")
    whose = said("stand file") if inertia.get("source") == "stand" else said("as given for this evaluation")
    largest = usable(inertia.get("largest_force_kN"))
    force = "" if largest is None else said(", up to {largest} kN", largest=significant(largest, 2))
    return said("{mass} kg ({whose}){force}", mass=significant(mass), whose=whose, force=force)


def temperature_section(source: ReportSource) -> Section | None:
    """Return the comparisons of runs at different temperature, or None where there is none."""
    blocks: list[Table | Texts] = []
    for comparison in source.document.get("temperature_comparisons") or []:
        blocks.append(_changes(source, comparison))
        if warnings := [str(text) for text in comparison.get("warnings") or []]:
            blocks.append(Texts(tuple(warnings), listed=True))
    return Section("temperature", said("Comparison of temperatures"), tuple(blocks)) if blocks else None


def number_of(source: ReportSource, identifier: object) -> str:
    """Return a run's number in the report, or its id where it is none of the report's."""
    return next((str(run.number) for run in source.runs if run.id == identifier), str(identifier))


def _changes(source: ReportSource, comparison: Mapping[str, Any]) -> Table:
    reference = comparison["reference"]
    rows = [
        _change_row(source, run, *figure, run["changes"][figure[0]])
        for run in comparison["runs"]
        for figure in FIGURES
        if figure[0] in run["changes"]
    ]
    named = said(
        "run {source} at {temperature_c} °C",
        source=number_of(source, reference["run"]),
        temperature_c=numeral(f"{reference['temperature_C']:.1f}"),
    )
    return Table(
        said("Comparison with {named} at equal stroke", named=named),
        (
            Column(said("Run")),
            Column(said("Temperature"), "°C"),
            Column(said("Stroke from"), "mm"),
            Column("to", "mm"),
            Column(said("Figure")),
            Column(said("Reference")),
            Column(said("This run")),
            Column(said("Unit")),
            Column(said("Change ± U"), "%"),
            Column(said("per kelvin ± U"), "%/K"),
        ),
        tuple(rows),
        note=said(
            "Temperature is that of the specimen at the start of the cycles. A loop that reaches further "
            "is cut at the stroke that both reach. Errors that both runs have in common cancel; U has "
            "what is left."
        ),
    )


def _change_row(
    source: ReportSource,
    run: Mapping[str, Any],
    name: str,
    words: str,
    unit: str,
    change: Mapping[str, Any],
) -> tuple[Cell, ...]:
    why = said("not to be had from one of the two runs")
    rounded_as = "force_max_kN" if name == "end_force_kN" else name
    return (
        Cell(number_of(source, run["run"]), "number"),
        quantity_cell("temperature_C", run["temperature_C"], why),
        quantity_cell("stroke_min_mm", run["from_mm"], why),
        quantity_cell("stroke_max_mm", run["to_mm"], why),
        Cell(words),
        *(quantity_cell(rounded_as, change.get(key), why) for key in ("reference", "value")),
        Cell(unit),
        _percent(change.get("relative_change"), change.get("expanded_uncertainty"), why),
        _percent(change.get("relative_change_per_K"), change.get("expanded_uncertainty_per_K"), why),
    )


def _percent(value: object, expanded: object, why: str) -> Cell:
    share, u = usable(value), usable(expanded)
    return measured_cell(None if share is None else 100.0 * share, None if u is None else 100.0 * u, why)


def as_recorded(source: ReportSource, comparison: Mapping[str, Any]) -> Table:
    """Return the runs of a comparison as recorded: end of stroke, end force and damping."""
    runs: Sequence[Mapping[str, Any]] = [comparison["reference"], *comparison["runs"]]
    why = said("not to be had from the run")
    return Table(
        said("The runs as recorded"),
        (
            Column(said("Run")),
            Column(said("Temperature"), "°C"),
            Column(said("End stroke"), "mm"),
            Column(said("End force"), "kN"),
            Column(said("Damping Wₐ/Wₛ"), "–"),
        ),
        tuple(
            (
                Cell(number_of(source, run["run"]), "number"),
                quantity_cell("temperature_C", run["temperature_C"], why),
                quantity_cell("stroke_max_mm", run["end_stroke_mm"], why),
                quantity_cell("force_max_kN", run["end_force_kN"], why),
                quantity_cell("damping", run["damping"], why),
            )
            for run in runs
        ),
    )
