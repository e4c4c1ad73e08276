"""Figures of a spring model beside the runs: loops (paper, Figs 10, 12) and a run that warms up (Fig. 11)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bufferstand.evaluation.figures import (
    Floats,
    LoopCurve,
    LoopPair,
    Trace,
    Warming,
    model_loops,
    warming_plot,
)
from bufferstand.evaluation.figures.model_comparison import RunCheck
from bufferstand.evaluation.report.content import (
    Cell,
    Column,
    Picture,
    Table,
    fixed,
    quantity_cell,
    significant,
    usable,
)
from bufferstand.evaluation.report.source import ModelAnswer, ReportRun, loop_of, runs_text
from bufferstand.evaluation.wording import said

_WARM_K = 3.0
"""A run whose spring warms by more is shown over time, and with its first and last loop."""
_MOST_LOOPS = 4
_SAME_PRESTRESS_MM = 2.0
_HISTORY_ROWS = 12
_MOTION = (
    ("prestress_mm", said("Prestress"), "mm"),
    ("amplitude_mm", said("Amplitude"), "mm"),
    ("frequency_Hz", said("Frequency"), "Hz"),
)


def model_pictures(runs: Sequence[ReportRun], given: ModelAnswer) -> list[Picture]:
    """Return loops of static runs, of each prestress, and of the run that warms up most, with its history."""
    shown = [run for run in runs if run.number in given.checks]
    pictures = []
    static = [
        pair for run in shown if run.kind == "static" and (pair := _pair(run, given, run.shown_cycle()))
    ]
    if static:
        pictures.append(_loops_picture(static[:_MOST_LOOPS], said("Quasi-static loops"), given))
    for group in _by_prestress([run for run in shown if run.kind == "harmonic"]):
        pairs = [pair for run in group if (pair := _pair(run, given, run.shown_cycle()))]
        if pairs:
            mean = significant(pairs[0][1].measured.prestress_mm or 0.0, 3)
            pictures.append(
                _loops_picture(_spread(pairs), said("Loops at prestress {mean} mm", mean=mean), given)
            )
    warmest = max(shown, key=lambda run: _rise_K(given.checks[run.number]))
    if _rise_K(given.checks[warmest.number]) > _WARM_K:
        pictures += _warming_pictures(warmest, given)
    return pictures


_Pair = tuple[ReportRun, LoopPair, Mapping[str, Any]]


def _pair(
    run: ReportRun, given: ModelAnswer, cycle: Mapping[str, Any] | None, label: str = ""
) -> _Pair | None:
    """Return a cycle as measured and by the model."""
    measured = None if cycle is None else loop_of(run, cycle)
    if cycle is None or measured is None:
        return None
    check = given.checks[run.number]
    time = check.drive.time_s
    inside = (time >= float(cycle["start_s"])) & (time <= float(cycle["end_s"]))
    if np.count_nonzero(inside) < 4:
        return None
    modelled = LoopCurve(
        measured.run, measured.cycle, check.drive.stroke_mm[inside], check.answer.force_kN[inside]
    )
    frequency = usable(cycle.get("frequency_Hz"))
    shown = said("run {number}", number=run.number) + (
        "" if frequency is None else said(", {frequency} Hz", frequency=significant(frequency, 3))
    )
    return run, LoopPair(label or shown, measured, modelled), cycle


def _by_prestress(runs: Sequence[ReportRun]) -> list[list[ReportRun]]:
    groups: list[list[ReportRun]] = []
    means = {run.number: run.result("prestress_mm") for run in runs}
    for run in sorted((r for r in runs if means[r.number] is not None), key=lambda r: means[r.number] or 0.0):
        mean = means[run.number] or 0.0
        if groups and mean - (means[groups[-1][-1].number] or 0.0) <= _SAME_PRESTRESS_MM:
            groups[-1].append(run)
        else:
            groups.append([run])
    return groups


def _spread(pairs: Sequence[_Pair]) -> list[_Pair]:
    """Return no more loops than one figure can show, from the smallest to the largest amplitude."""
    ordered = sorted(pairs, key=_by_amplitude)
    if len(ordered) <= _MOST_LOOPS:
        return ordered
    at = np.linspace(0, len(ordered) - 1, _MOST_LOOPS).round().astype(int)
    return [ordered[int(n)] for n in at]


def _by_amplitude(pair: _Pair) -> tuple[float, float]:
    loop = pair[1].measured
    return loop.amplitude_mm or 0.0, loop.frequency_Hz or 0.0


def _rise_K(check: RunCheck) -> float:  # noqa: N802 - the unit's own letter
    return float(check.answer.temperature_C[-1] - check.answer.temperature_C[0])


def _loops_picture(pairs: Sequence[_Pair], words: str, given: ModelAnswer) -> Picture:
    numbers = runs_text(dict.fromkeys(run.number for run, _, _ in pairs))
    return Picture(
        caption=said(
            "{words} of {numbers}, measured (thin, black) and by the model {name} (dashed).",
            words=words,
            numbers=numbers,
            name=given.model.name,
        ),
        alt=said(
            "{count_of_pairs} measured force–stroke loops with those of the model; the numbers are "
            "tabulated.",
            count_of_pairs=len(pairs),
        ),
        plot=model_loops([pair for _, pair, _ in pairs]),
        numbers=_pairs_table(pairs),
    )


def _pairs_table(pairs: Sequence[_Pair]) -> Table:
    why = said("not to be had of this cycle")
    rows = []
    for run, pair, cycle in pairs:
        loops = (pair.measured, pair.model)
        motion = [quantity_cell(name, cycle.get(name), why) for name, _, _ in _MOTION]
        tops = [quantity_cell("force_max_kN", float(np.nanmax(loop.force_kN)), "") for loop in loops]
        areas = [quantity_cell("absorbed_energy_J", _area(loop), "") for loop in loops]
        head = (Cell(str(run.number), "number"), Cell(str(cycle["index"]), "number"))
        rows.append((*head, *motion, *tops, *areas))
    return Table(
        said("Cycles shown"),
        (
            Column(said("Run")),
            Column(said("Cycle")),
            *(Column(title, unit) for _, title, unit in _MOTION),
            Column(said("Top force compared, measured"), "kN"),
            Column(said("Top force compared, model"), "kN"),
            Column(said("Loop area measured"), "J"),
            Column(said("Loop area model"), "J"),
        ),
        tuple(rows),
        note=said(
            "Areas are those of the curves as drawn; the energies of the evaluation stand under Cycles."
        ),
    )


def _area(loop: LoopCurve) -> float:
    whole = ~(np.isnan(loop.stroke_mm) | np.isnan(loop.force_kN))
    return float(np.trapezoid(loop.force_kN[whole], loop.stroke_mm[whole]))


def _warming_pictures(run: ReportRun, given: ModelAnswer) -> list[Picture]:
    """Return the loops and the history of a run in which the spring warms up (paper, Figs 12 and 11)."""
    check = given.checks[run.number]
    complete = [c for c in run.cycles if c.get("complete") and usable(c.get("absorbed_energy_J")) is not None]
    if not complete:
        return []
    pairs = []
    for cycle in (complete[0], complete[-1])[: len(complete)]:
        warm = np.interp(float(cycle["start_s"]), check.drive.time_s, check.answer.temperature_C)
        label = said("cycle {index}, spring {warm} °C", index=cycle["index"], warm=fixed(float(warm), 1))
        if pair := _pair(run, given, cycle, label):
            pairs.append(pair)
    loops = (
        [_loops_picture(pairs, said("First and last loop of a spring that warms up"), given)] if pairs else []
    )
    return [*loops, _history(run, given, complete)]


def _history(run: ReportRun, given: ModelAnswer, complete: Sequence[Mapping[str, Any]]) -> Picture:
    check = given.checks[run.number]
    drive, answer = check.drive, check.answer
    force = answer.force_kN
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(drive.stroke_mm))
    work = np.concatenate([[0.0], work])
    starts, ends = (np.array([float(c[key]) for c in complete]) for key in ("start_s", "end_s"))
    measured = np.cumsum([float(c["absorbed_energy_J"]) for c in complete])
    modelled = np.cumsum(np.interp(ends, drive.time_s, work) - np.interp(starts, drive.time_s, work))
    temperatures = [
        Trace(said("spring, model"), drive.time_s, answer.temperature_C),
        Trace(said("sensor, model"), drive.time_s, answer.sensor_C),
    ]
    if drive.sensor_C.size:
        temperatures.append(Trace(said("sensor, measured"), drive.sensor_s, drive.sensor_C))
    assert run.record is not None
    first, last = (fixed(float(answer.temperature_C[n]), 1) for n in (0, -1))
    return Picture(
        caption=said(
            "Stroke, energy absorbed by complete cycles, and temperature over time of run {number}, "
            "measured and by the model {name}.",
            number=run.number,
            name=given.model.name,
        ),
        alt=said(
            "Run {number} over time; the model's spring warms from {first} to {last} °C.",
            number=run.number,
            first=first,
            last=last,
        ),
        plot=warming_plot(
            Warming(
                Trace(said("stroke"), run.record.time_s, run.record.stroke_mm),
                [
                    Trace(said("absorbed, measured"), ends, measured),
                    Trace(said("absorbed, model"), ends, modelled),
                ],
                temperatures,
            )
        ),
        numbers=_history_table(ends, (measured, modelled), check),
    )


def _history_table(end_s: Floats, energies_J: tuple[Floats, Floats], check: RunCheck) -> Table:
    """Return energy and temperature at some ends of cycles."""
    drive, answer = check.drive, check.answer
    rows = []
    for n in np.unique(np.linspace(0, end_s.size - 1, _HISTORY_ROWS).round().astype(int)):
        at = float(end_s[n])
        sensor = float(np.interp(at, drive.sensor_s, drive.sensor_C)) if drive.sensor_C.size else None
        by_model = [float(np.interp(at, drive.time_s, t)) for t in (answer.sensor_C, answer.temperature_C)]
        rows.append(
            (
                Cell(fixed(at, 1), "number"),
                *(Cell(fixed(float(energy[n]) / 1000.0, 2), "number") for energy in energies_J),
                quantity_cell("temperature_C", sensor, said("the run has no sensor on the specimen")),
                *(quantity_cell("temperature_C", value, "") for value in by_model),
            )
        )
    return Table(
        said("Energy and temperature at the ends of cycles"),
        (
            Column(said("Time"), "s"),
            Column(said("Absorbed, measured"), "kJ"),
            Column(said("Absorbed, model"), "kJ"),
            Column(said("Sensor, measured"), "°C"),
            Column(said("Sensor, model"), "°C"),
            Column(said("Spring, model"), "°C"),
        ),
        tuple(rows),
    )
