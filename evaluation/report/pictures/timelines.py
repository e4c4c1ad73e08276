"""Figures of a campaign over time: temperature with its limit, and the stroke as it was run."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.figures import TimelineStep, Trace, stroke_plot, temperature_plot
from bufferstand.evaluation.report.content import DASH, Cell, Column, Table, fixed, quantity_cell, usable
from bufferstand.evaluation.report.pictures.draft import DraftPicture
from bufferstand.evaluation.report.source import (
    ReportRun,
    ReportSource,
    campaign_clock,
    energy_trace,
    steps_of,
    stroke_trace,
    temperature_traces,
)
from bufferstand.foundation import duration_text


def timeline_pictures(source: ReportSource) -> list[DraftPicture]:
    """Return temperature and stroke over the campaign, as far as there are samples."""
    if not any(run.record is not None for run in source.runs):
        return []
    clock = campaign_clock(source.runs)
    steps = steps_of(source.runs, clock)
    note = f"Runs are shaded and numbered. {_stopped(source)}{clock.note}".strip()
    pictures = []
    traces = temperature_traces(source.runs, clock)
    if traces:
        limits = [run.temperature_stop_C for run in source.runs]
        known = sorted({limit for limit in limits if limit is not None})
        limit_text = f", limit {known[0]:g} °C" if known else ", no temperature limit on record"
        energy = energy_trace(source.runs, clock)
        of_energy = "" if energy is None else "; below, the energy that the complete cycles absorbed"
        pictures.append(
            DraftPicture(
                caption=f"Temperatures over the campaign{limit_text}{of_energy}. {note}",
                alt=_temperature_words(traces, known[0] if known else None),
                plot=temperature_plot(traces, steps, known[0] if known else None, energy),
                numbers=_temperature_table(source),
            )
        )
    trace = stroke_trace(source.runs, clock)
    highest = fixed(float(np.nanmax(trace.value)), 1)
    pictures.append(
        DraftPicture(
            caption=f"Stroke over the campaign. {note}",
            alt=f"Stroke of {len(source.runs)} runs over time, up to {highest} mm.",
            plot=stroke_plot([trace], steps),
            numbers=_stroke_table(source, steps),
        )
    )
    return pictures


def _stopped(source: ReportSource) -> str:
    return "".join(f"Run {run.number} {run.status}: {run.reason}. " for run in source.runs if run.ended_early)


def _temperature_words(traces: list[Trace], limit_C: float | None) -> str:
    parts = []
    for trace in traces:
        low, high = (fixed(float(end(trace.value)), 1) for end in (np.nanmin, np.nanmax))
        parts.append(f"{trace.label}: {low} to {high} °C")
    limit = "" if limit_C is None else f"; the limit is {limit_C:g} °C"
    return f"Temperature over time. {'; '.join(parts)}{limit}."


def _temperature_table(source: ReportSource) -> Table:
    sensors = list(
        dict.fromkeys(
            sensor.place or sensor.name
            for run in source.runs
            if run.record is not None
            for sensor in run.record.temperatures
        )
    )
    columns = [Column("Run")]
    for sensor in sensors:
        columns += [Column(f"{sensor}: start", "°C"), Column("max.", "°C"), Column("end", "°C")]
    columns.append(Column("Energy absorbed", "kJ"))
    rows = tuple(
        (Cell(str(run.number), "number"), *_readings(run, sensors), _absorbed(run)) for run in source.runs
    )
    return Table("Temperatures of each run, and what its complete cycles absorbed", tuple(columns), rows)


def _absorbed(run: ReportRun) -> Cell:
    energies = [
        value for cycle in run.cycles if (value := usable(cycle.get("absorbed_energy_J"))) is not None
    ]
    if not energies:
        return Cell(DASH, "missing", "no complete cycle")
    return Cell(fixed(sum(energies) / 1000.0, 2), "number")


def _readings(run: ReportRun, sensors: list[str]) -> list[Cell]:
    cells: list[Cell] = []
    found = {s.place or s.name: s for s in (run.record.temperatures if run.record is not None else ())}
    for sensor in sensors:
        values = found[sensor].temperature_C if sensor in found else np.empty(0)
        values = values[~np.isnan(values)]
        if values.size == 0:
            cells += [Cell(DASH, "missing", "the sensor was not recorded in this run")] * 3
        else:
            shown = (values[0], values.max(), values[-1])
            cells += [Cell(fixed(float(value), 1), "number") for value in shown]
    return cells


def _stroke_table(source: ReportSource, steps: list[TimelineStep]) -> Table:
    rows = []
    for run, step in zip(source.runs, steps, strict=True):
        why = "nothing of the kind was required or measured"
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
                Cell(run.status, "bad" if step.stop else "text"),
            )
        )
    return Table(
        "The steps",
        (
            Column("Run"),
            Column("Start"),
            Column("Length"),
            Column("Prestress", "mm"),
            Column("Amplitude", "mm"),
            Column("Frequency", "Hz"),
            Column("Ended"),
        ),
        tuple(rows),
        note="Prestress, amplitude and frequency as required by the step; as measured where it states none.",
    )
