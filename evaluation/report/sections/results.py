"""The tables of results: a row a run; in the annex how it was run, its extremes, and a row a cycle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.catalogue import QUANTITIES, Catalogue, Quantity
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    fixed,
    measured_cell,
    moment_text,
    quantity_cell,
    usable,
)
from bufferstand.evaluation.report.sections.verdicts import run_verdict_cell
from bufferstand.evaluation.report.source import NOT_RECORDED, ReportRun, ReportSource
from bufferstand.evaluation.wording import joined, kind_words, label, said, status_words
from bufferstand.foundation import duration_text

MOST_HARMONIC_CYCLES = 10
"""Cycles of a harmonic run that are printed; the evaluation document holds them all."""


def _of_cycles(table: str) -> Catalogue:
    """Return what is in one of the two tables of cycles, in its order."""
    placed = [
        (entry.shown.cycles.place, entry)
        for entry in QUANTITIES
        if entry.shown.cycles is not None and entry.shown.cycles.table == table
    ]
    return Catalogue(entry for _, entry in sorted(placed, key=lambda one: one[0]))


_MOTION, _ENERGY = _of_cycles("motion"), _of_cycles("energy")
_OF_RUN = QUANTITIES.that(lambda entry: entry.shown.runs)
_UNSAID = said("the evaluation document does not say why")
_EXTREMES = (
    ("force_max_kN", said("Force max."), "kN"),
    ("force_min_kN", said("Force min."), "kN"),
    ("stroke_max_mm", said("Stroke max."), "mm"),
    ("speed_max_mm_per_s", said("Speed max."), "mm/s"),
    ("temperature_max_C", said("Temperature max."), "°C"),
)
_NOT_HAD = said("not to be had from the record; see the warnings of the run")


def columns(entries: Catalogue) -> tuple[Column, ...]:
    """Return the columns of quantities."""
    return tuple(Column(label(entry.shown.heading), entry.printed_unit) for entry in entries)


def value_cell(entry: Quantity, cycle: Mapping[str, Any]) -> Cell:
    """Return a quantity of a cycle, or a dash with the reason that the cycle carries."""
    return quantity_cell(entry.name, entry.value_in(cycle), _why_missing(cycle, entry.name))


def _why_missing(part: Mapping[str, Any], name: str) -> str:
    """Return why a cycle, a run or a step has no value; an earlier version's document has no reasons."""
    return str((part.get("missing") or {}).get(name) or joined("; ", part.get("why") or ()) or _UNSAID)


def recorded_section(source: ReportSource) -> Section:
    """Return what was done in each run, and the extremes of its samples."""
    done = Table(
        said("Tests performed"),
        (
            Column(said("Run")),
            Column(said("Run id")),
            Column(said("Kind")),
            Column(said("Step")),
            Column(said("Started")),
            Column(said("Length")),
            Column(said("Cycles / used")),
            Column(said("Ended")),
        ),
        tuple(_done(run) for run in source.runs),
    )
    return Section("recorded", said("Runs as recorded"), (done, extremes_table(source)), annex=True)


def runs_section(source: ReportSource) -> Section:
    """Return what came out of each run."""
    results = Table(
        said("Results"),
        (
            Column(said("Run")),
            *(
                Column(label(entry.shown.heading) + " ± U" * entry.shown.main, entry.printed_unit)
                for entry in _OF_RUN
            ),
            Column(said("Temperature start → max."), "°C"),
            Column(said("Verdict")),
        ),
        tuple(_result(part) for run in source.runs for part in run.parts),
        note=said(
            "Means over the cycles used, but for Force max. and Temperature max., which are those of all "
            "samples of the run; U = k u with coverage factor k = 2. The tangent stiffness is the slope "
            "of the loading branch at the cycle’s mean stroke. Prestress is the mean stroke, amplitude "
            "half the range."
        )
        + (
            said(" 1#2 is the second step of run 1, whose record has several.")
            if any(run.part is not None for each in source.runs for run in each.parts)
            else ""
        ),
    )
    return Section("runs", said("Runs"), (results,))


def _done(run: ReportRun) -> tuple[Cell, ...]:
    started = moment_text(run.metadata["run"].get("started_utc"))
    complete = sum(bool(cycle.get("complete")) for cycle in run.cycles)
    step = run.fact("step", "name") or run.metadata["run"].get("step_index")
    ended = (
        said("{status} (simulated)", status=status_words(run.status))
        if run.simulated
        else status_words(run.status)
    )
    return (
        Cell(str(run.number), "number"),
        Cell(run.id, "code"),
        Cell(kind_words(run.kind)),
        Cell(str(step))
        if step not in {None, ""}
        else Cell(DASH, "missing", said("not a step of a campaign")),
        Cell(started) if started else Cell(DASH, "missing", NOT_RECORDED),
        Cell(DASH, "missing", run.problem or said("no usable samples"))
        if run.record is None
        else Cell(duration_text(run.duration_s), "number"),
        Cell(
            said(
                "{complete} / {what}",
                complete=complete,
                what=sum(len(part.cycles_used) for part in run.parts),
            ),
            "number",
        ),
        Cell(ended, "bad" if run.ended_early else "text"),
    )


def _result(run: ReportRun) -> tuple[Cell, ...]:
    shown = run.shown_cycle()
    nothing = _no_record(run) or (
        said("no complete cycle in the run")
        if shown is None
        else said("no cycle of the run is complete and steady")
    )
    cells = [Cell(run.label, "number")]
    for entry in _OF_RUN:
        why = _why_missing(run.evaluated, entry.name) if shown is not None and run.cycles_used else nothing
        mean = run.summary.get(entry.name)
        if entry.shown.runs == "extreme":
            extreme = run.extreme(entry.name)
            cells.append(quantity_cell(entry.name, None if extreme is None else extreme.value, nothing))
        elif entry.shown.main and isinstance(mean, Mapping):
            cells.append(measured_cell(mean.get("value"), mean.get("expanded_uncertainty"), why))
        else:
            cells.append(quantity_cell(entry.name, run.result(entry.name), why))
    cells.append(_temperature_of_run(run))
    cells.append(run_verdict_cell(run))
    return tuple(cells)


def _no_record(run: ReportRun) -> str:
    """Return why a run has no samples; nothing where it has: then its problem is no reason for a dash."""
    return run.problem if run.record is None else ""


def _temperature_of_run(run: ReportRun) -> Cell:
    starts = [usable((cycle.get("temperature_C") or {}).get("start")) for cycle in run.cycles]
    known_starts = [value for value in starts if value is not None]
    warmest = run.extreme("temperature_max_C")
    if not known_starts or warmest is None or warmest.value is None:
        why = _no_record(run) or (
            said("the run has no temperature channel")
            if run.record is None or not run.record.temperatures
            else said("no reading within a cycle")
        )
        return Cell(DASH, "missing", why)
    return Cell(f"{known_starts[0]:.1f} → {warmest.value:.1f}".replace("-", "−"), "number")


def cycles_section(source: ReportSource) -> Section | None:
    """Return the tables with a row for each cycle of a detailed report, or None."""
    if not source.detailed:
        return None
    chosen = [(run, cycle) for run in source.runs for cycle in _printed(run)]
    left_out = [
        said(
            "run {number}: {count_of_run} of {count_of_cycles}",
            number=run.number,
            count_of_run=len(_printed(run)),
            count_of_cycles=len(run.cycles),
        )
        for run in source.runs
        if len(_printed(run)) < len(run.cycles)
    ]
    note = (
        said(
            "Of long harmonic runs the last {most_harmonic_cycles} cycles up to the last one used are "
            "printed ({list}); the evaluation document holds all.",
            most_harmonic_cycles=MOST_HARMONIC_CYCLES,
            list=joined("; ", left_out),
        )
        if left_out
        else ""
    )
    motion = Table(
        said("Cycles: stroke, force, speed and temperature"),
        (
            Column(said("Run")),
            Column(said("Cycle")),
            Column(said("State")),
            *columns(_MOTION),
        ),
        tuple((*cycle_head(run, cycle), *_values(cycle, _MOTION)) for run, cycle in chosen),
        note=note,
    )
    energy = Table(
        said("Cycles: energy, damping and stiffness"),
        (
            Column(said("Run")),
            Column(said("Cycle")),
            Column(said("State")),
            *columns(_ENERGY),
        ),
        tuple((*cycle_head(run, cycle), *_values(cycle, _ENERGY)) for run, cycle in chosen),
        note=said(
            "With ± U where the record states the accuracy of its channels. Damping by EN 15551 is the "
            "absorbed over the stored energy; it is not the loss factor."
        ),
    )
    return Section("cycles", said("Cycles"), (motion, energy), annex=True)


def _printed(run: ReportRun) -> list[Mapping[str, Any]]:
    if run.kind != "harmonic" or len(run.cycles) <= MOST_HARMONIC_CYCLES:
        return run.cycles
    used = [index for part in run.parts for index in part.cycles_used]
    last = max(used, default=run.cycles[-1]["index"])
    upto = [cycle for cycle in run.cycles if cycle["index"] <= last]
    return upto[-MOST_HARMONIC_CYCLES:]


def cycle_head(run: ReportRun, cycle: Mapping[str, Any]) -> tuple[Cell, Cell, Cell]:
    """Return the cells that name a cycle: its run, its number, and whether the results are from it."""
    if not cycle.get("complete"):
        state = said("incomplete")
    elif any(cycle["index"] in part.cycles_used for part in run.parts):
        state = said("used")
    else:
        state = said("steady") if cycle.get("steady") else said("settling")
    return (Cell(str(run.number), "number"), Cell(str(cycle["index"]), "number"), Cell(state))


def _values(cycle: Mapping[str, Any], entries: Catalogue) -> tuple[Cell, ...]:
    expanded = cycle.get("expanded_uncertainty") or {}
    return tuple(
        measured_cell(cycle.get(entry.name), expanded[entry.name], _why_missing(cycle, entry.name))
        if entry.shown.main and usable(expanded.get(entry.name)) is not None
        else value_cell(entry, cycle)
        for entry in entries
    )


def extremes_table(source: ReportSource) -> Table:
    """Return the extremes of each run with U, and when they were reached."""
    return Table(
        said("Extremes of all samples"),
        (
            Column(said("Run")),
            *(
                column
                for _, words, unit in _EXTREMES
                for column in (Column(said("{words} ± U", words=words), unit), Column(said("at"), "s"))
            ),
        ),
        tuple(_extremes_row(run) for run in source.runs),
        note=said(
            "Over every sample of the run, also outside of cycles; all other figures are those of "
            "cycles, or means over them. ? : in doubt, see Warnings."
        ),
    )


def _extremes_row(run: ReportRun) -> tuple[Cell, ...]:
    cells = [Cell(str(run.number), "number")]
    for name, _, _ in _EXTREMES:
        extreme = run.extreme(name)
        if extreme is None:
            cells += [Cell(DASH, "missing", run.problem or _NOT_HAD)] * 2
            continue
        shown = measured_cell(extreme.value, extreme.expanded_uncertainty, _NOT_HAD)
        at = DASH if extreme.time_s is None else fixed(extreme.time_s, 2)
        cells += [
            Cell(said("{text} ?", text=shown.text), "open") if extreme.doubt else shown,
            Cell(at, "number"),
        ]
    return tuple(cells)
