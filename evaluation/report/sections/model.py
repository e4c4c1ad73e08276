"""The comparison of a given spring model with the runs: which model, and its deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.figures.model_comparison import RunCheck
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Sheet,
    Table,
    Texts,
    fixed,
    quantity_cell,
    significant,
)
from bufferstand.evaluation.report.source import ModelAnswer, ReportRun, ReportSource
from bufferstand.evaluation.wording import said

_METHOD = said(
    "Nothing is fitted here: the model answers to the stroke as it was run, beginning each run "
    "at the first measured temperature. Residuals are model less measured, over the forces of "
    "whole cycles; beside them the share of the largest measured force. The model's temperature "
    "is that of the spring's mass, not of the place of the sensor."
)
_COMPARED = said(
    "Compared: measured and model over the same few strokes that a record is reduced to, without the tips of "
    "the turns. So its damping and top force differ a little from those of the evaluation, which are the "
    "results of the run and stand under Results."
)


def model_section(source: ReportSource) -> Section | None:
    """Return which model was compared, and by how much it misses each run; None where none was given."""
    given = source.modelled
    if given is None:
        return None
    model = given.model
    facts = Sheet(
        said("The model"),
        (
            (said("Name"), Cell(model.name)),
            (said("File"), Cell(given.file, "code")),
            ("SHA-256", Cell(given.sha256, "code")),
            (
                said("Curves hold at"),
                Cell(said("{reference_c} °C", reference_c=significant(model.temperature.reference_C))),
            ),
            (
                said("Temperature sensitivity c_ts"),
                Cell(
                    said(
                        "{sensitivity_per_k} 1/K",
                        sensitivity_per_k=significant(model.temperature.sensitivity_per_K),
                    )
                ),
            ),
            (
                said("Heat capacity"),
                Cell(
                    said("{capacity_j_per_k} J/K", capacity_j_per_k=significant(model.heat.capacity_J_per_K))
                ),
            ),
        ),
    )
    temperatures = [check.answer.temperature_C for check in given.checks.values()]
    notes = model.warnings(
        min(float(t.min()) for t in temperatures), max(float(t.max()) for t in temperatures)
    )
    if model.identified is not None:
        drives = [check.drive for check in given.checks.values()]
        left_range = (model.identified.warnings(model.curves, d.time_s, d.stroke_mm) for d in drives)
        notes = (*notes, *dict.fromkeys(sentence for found in left_range for sentence in found))
    left = [
        said("Run {number} was left out: {why}.", number=number, why=why)
        for number, why in given.left_out.items()
    ]
    blocks: list[Sheet | Table | Texts] = [facts, _misses(source.runs, given), Texts((_METHOD,))]
    if notes or left:
        blocks.append(Texts((*notes, *left), listed=True))
    return Section("model", said("Model against measurement"), tuple(blocks))


def _misses(runs: Sequence[ReportRun], given: ModelAnswer) -> Table:
    rows = [_miss(run, given.checks[run.number]) for run in runs if run.number in given.checks]
    return Table(
        said("Measurement and model"),
        (
            Column(said("Run")),
            Column(said("Whole cycles")),
            Column(said("Damping compared, measured"), "–"),
            Column(said("Damping compared, model"), "–"),
            Column(said("Top force compared, measured"), "kN"),
            Column(said("Top force compared, model"), "kN"),
            Column(said("Residual rms"), "kN"),
            Column(said("Residual worst"), "%"),
            Column(said("End temp. sensor"), "°C"),
            Column(said("End temp. sensor, model"), "°C"),
            Column(said("End temp. spring, model"), "°C"),
        ),
        tuple(rows),
        note=_COMPARED,
    )


def _miss(run: ReportRun, check: RunCheck) -> tuple[Cell, ...]:
    drive, answer = check.drive, check.answer
    pairs = [(cycle.damping, cycle.predicted_damping) for cycle in check.cycles]
    damping = [float(mean) for mean in np.mean(pairs, axis=0)] if pairs else [None, None]
    sensor = float(drive.sensor_C[-1]) if drive.sensor_C.size else None
    why = said("no cycle of the run is closed")
    return (
        Cell(str(run.number), "number"),
        Cell(str(len(check.cycles)), "number"),
        *(quantity_cell("damping", value, why) for value in damping),
        quantity_cell("force_max_kN", check.largest_force_kN, ""),
        quantity_cell("force_max_kN", float(answer.force_kN[drive.node].max()), ""),
        *_residuals(check),
        quantity_cell("temperature_C", sensor, said("the run has no sensor on the specimen")),
        quantity_cell("temperature_C", float(answer.sensor_C[-1]), ""),
        quantity_cell("temperature_C", float(answer.temperature_C[-1]), ""),
    )


def _residuals(check: RunCheck) -> tuple[Cell, Cell]:
    rest, peak = check.residual_kN, check.largest_force_kN
    if not rest.size or peak <= 0.0:
        return (Cell(DASH, "missing", said("no force of the run counts")),) * 2
    rms, worst = float(np.sqrt(np.mean(rest**2))), float(np.max(np.abs(rest)))
    return Cell(fixed(rms, 2), "number"), Cell(fixed(100.0 * worst / peak, 2), "number")
