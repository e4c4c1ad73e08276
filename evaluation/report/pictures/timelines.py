"""Figures of a campaign over time: temperature with its limit, and the stroke as it was run."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.figures import TimelineStep, Trace, stroke_plot, temperature_plot
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Picture,
    Table,
    fixed,
    quantity_cell,
    usable,
)
from bufferstand.evaluation.report.source import (
    CampaignClock,
    ReportRun,
    ReportSource,
    campaign_clock,
    energy_trace,
    steps_of,
    stroke_trace,
    temperature_traces,
)
from bufferstand.evaluation.wording import joined, numeral, said, status_words
from bufferstand.foundation import duration_text


def temperature_pictures(source: ReportSource) -> list[Picture]:
    """Return the temperatures over the campaign, with the absorbed energy; none where there is no sensor."""
    placed = _placed(source)
    if placed is None:
        return []
    clock, steps = placed
    traces = temperature_traces(source.runs, clock)
    if not traces:
        return []
    limits = [run.temperature_stop_C for run in source.runs]
    known = sorted({limit for limit in limits if limit is not None})
    limit_text = (
        said(", limit {known} °C", known=numeral(f"{known[0]:g}"))
        if known
        else said(", no temperature limit on record")
    )
    energy = energy_trace(source.runs, clock)
    of_energy = "" if energy is None else said("; below, the energy that the complete cycles absorbed")
    return [
        Picture(
            caption=said(
                "Temperatures over the campaign{limit_text}{of_energy}. {clock}",
                limit_text=limit_text,
                of_energy=of_energy,
                clock=_note(clock),
            ),
            alt=_temperature_words(traces, known[0] if known else None),
            plot=temperature_plot(traces, steps, known[0] if known else None, energy),
            numbers=_temperature_table(source),
        )
    ]


def stroke_pictures(source: ReportSource) -> list[Picture]:
    """Return the stroke over the campaign; none where there are no samples."""
    placed = _placed(source)
    if placed is None:
        return []
    clock, steps = placed
    trace = stroke_trace(source.runs, clock)
    highest = fixed(float(np.nanmax(trace.value)), 1)
    return [
        Picture(
            caption=said("Stroke over the campaign. {clock}", clock=_note(clock)),
            alt=said(
                "Stroke of {count_of_runs} runs over time, up to {highest} mm.",
                count_of_runs=len(source.runs),
                highest=highest,
            ),
            plot=stroke_plot([trace], steps),
            numbers=_stroke_table(source, steps),
        )
    ]


def _placed(source: ReportSource) -> tuple[CampaignClock, list[TimelineStep]] | None:
    if not any(run.record is not None for run in source.runs):
        return None
    clock = campaign_clock(source.runs)
    return clock, steps_of(source.runs, clock)


def _note(clock: CampaignClock) -> str:
    shaded = said("Runs are shaded and numbered.")
    return said("{shaded} {note}", shaded=shaded, note=clock.note) if clock.note else shaded


def _temperature_words(traces: list[Trace], limit_C: float | None) -> str:
    parts = []
    for trace in traces:
        low, high = (fixed(float(end(trace.value)), 1) for end in (np.nanmin, np.nanmax))
        parts.append(said("{label}: {low} to {high} °C", label=trace.label, low=low, high=high))
    limit = "" if limit_C is None else said("; the limit is {limit_c} °C", limit_c=numeral(f"{limit_C:g}"))
    return said("Temperature over time. {list}{limit}.", list=joined("; ", parts), limit=limit)


def _temperature_table(source: ReportSource) -> Table:
    sensors = list(
        dict.fromkeys(
            sensor.place or sensor.name
            for run in source.runs
            if run.record is not None
            for sensor in run.record.temperatures
        )
    )
    columns = [Column(said("Run"))]
    for sensor in sensors:
        columns += [
            Column(said("{sensor}: start", sensor=sensor), "°C"),
            Column(said("max."), "°C"),
            Column(said("end"), "°C"),
        ]
    columns.append(Column(said("Energy absorbed"), "kJ"))
    rows = tuple(
        (Cell(str(run.number), "number"), *_readings(run, sensors), _absorbed(run)) for run in source.runs
    )
    return Table(said("Temperatures and absorbed energy of each run"), tuple(columns), rows)


def _absorbed(run: ReportRun) -> Cell:
    energies = [
        value for cycle in run.cycles if (value := usable(cycle.get("absorbed_energy_J"))) is not None
    ]
    if not energies:
        return Cell(DASH, "missing", said("no complete cycle"))
    return Cell(fixed(sum(energies) / 1000.0, 2), "number")


def _readings(run: ReportRun, sensors: list[str]) -> list[Cell]:
    cells: list[Cell] = []
    found = {s.place or s.name: s for s in (run.record.temperatures if run.record is not None else ())}
    for sensor in sensors:
        values = found[sensor].temperature_C if sensor in found else np.empty(0)
        values = values[~np.isnan(values)]
        if values.size == 0:
            cells += [Cell(DASH, "missing", said("the sensor was not recorded in this run"))] * 3
        else:
            shown = (values[0], values.max(), values[-1])
            cells += [Cell(fixed(float(value), 1), "number") for value in shown]
    return cells


def _stroke_table(source: ReportSource, steps: list[TimelineStep]) -> Table:
    rows = []
    for run, step in zip(source.runs, steps, strict=True):
        why = said("nothing of the kind was required or measured")
        required = [
            quantity_cell(name, run.nominal(name), why)
            for name in ("prestress_mm", "amplitude_mm", "frequency_Hz")
        ]
        rows.append(
            (
                Cell(str(run.number), "number"),
                Cell(duration_text(step.start_s), "number"),
                Cell(duration_text(step.end_s - step.start_s), "number"),
                *required,
                Cell(status_words(run.status), "bad" if step.stop else "text"),
            )
        )
    return Table(
        said("The steps"),
        (
            Column(said("Run")),
            Column(said("Start")),
            Column(said("Length")),
            Column(said("Prestress"), "mm"),
            Column(said("Amplitude"), "mm"),
            Column(said("Frequency"), "Hz"),
            Column(said("Ended")),
        ),
        tuple(rows),
        note=said(
            "Prestress, amplitude and frequency as required by the step; as measured where it states none."
        ),
    )
