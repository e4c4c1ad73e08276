"""The paper's Figs 10 and 12 with runs of one's own: measured loops, and a model's over the same strokes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.figures.loops import FORCE_LABEL, STROKE_LABEL
from bufferstand.evaluation.figures.model_comparison.model_answers import answer_to, check_run
from bufferstand.evaluation.figures.model_comparison.paper_figures import PaperFigure
from bufferstand.evaluation.figures.plot import BLACK, Curve, Floats, Plot
from bufferstand.foundation import BadInput
from bufferstand.model import SpringModel
from bufferstand.model.identification import Answer, CycleCheck, Drive

_NEAR_MM = 5.0
"""Loops whose mean strokes differ by no more have one prestress."""
PRESTRESS_MM = 48.5
"""Of the paper's Fig. 10, as it was."""
_SHOWN = 5
_STATIC = "a slow stroke to the largest force (kind = “static”)"


@dataclass(frozen=True)
class MeasuredRow:
    """One figure of a cycle, as measured and by the model."""

    figure: str
    run: str
    quantity: str
    unit: str
    measured: float
    model: float


@dataclass(frozen=True)
class MeasuredComparison:
    """Both figures, as far as the runs have them, and their table."""

    figures: tuple[PaperFigure, ...]
    rows: tuple[MeasuredRow, ...]
    missing: tuple[str, ...]
    """What of the two figures could not be drawn, and which run it needs."""


def compare_measured(
    model: SpringModel, static: Sequence[Drive], harmonic: Sequence[Drive], temperature_C: float
) -> MeasuredComparison:
    """Draw a model over measured runs as the paper does.

    Fig. 10: the last loops of all runs about one prestress (that with most amplitudes, nearest to the
    paper's 48.5 mm), and the model's over the same strokes with a spring of one temperature. Fig. 12: the run
    with the largest upper turn, and the model's loops while it warms up from the first measured temperature.

    Parameters
    ----------
    model : SpringModel
    static, harmonic : sequence of Drive
        The runs, by kind.
    temperature_C : float
        Of the spring in Fig. 10 [°C].

    Raises
    ------
    BadInput
        If there is no static run: both figures stand on its loop.
    """
    if not static:
        raise BadInput("no static run: Figs 10 and 12 stand on its loop", remedy=f"give {_STATIC}, too")
    envelope = _envelope(max(static, key=_top))
    figures, rows, missing = [], [], []
    for name, drawn in (
        ("10", _constant(model, harmonic, temperature_C)),
        ("12", _warming(model, harmonic)),
    ):
        if isinstance(drawn, str):
            missing.append(f"Fig. {name}: {drawn}")
            continue
        caption, curves, found = drawn
        everything = (envelope, *curves)
        top = max(float(curve.y.max()) for curve in everything)
        end = max(float(curve.x.max()) for curve in everything)
        plot = Plot(STROKE_LABEL, FORCE_LABEL, curves=everything,
                    x_range=(0.0, 1.03 * end), y_range=(0.0, 1.03 * top))  # fmt: skip
        figures.append(PaperFigure(f"fig-{name}-measured", caption, plot))
        rows += found
    return MeasuredComparison(tuple(figures), tuple(rows), tuple(missing))


_Drawn = tuple[str, list[Curve], list[MeasuredRow]]


def _constant(model: SpringModel, harmonic: Sequence[Drive], temperature_C: float) -> _Drawn | str:
    """Fig. 10: loops of several amplitudes about one prestress, the spring at one temperature."""
    closed = [(drive, last) for drive in harmonic if (last := _last_cycle(model, drive, None)) is not None]
    if not closed:
        return "needs harmonic runs with a closed loop"
    groups = [
        [item for item in closed if abs(_mean(item[1]) - _mean(about)) <= _NEAR_MM] for _, about in closed
    ]
    chosen = max(groups, key=_likeness)
    curves, rows = [], []
    for tone, (drive, _) in enumerate(sorted(chosen, key=lambda item: _half_range(item[1]))):
        given = answer_to(model, drive, start_C=temperature_C, isothermal=True)
        check = _last_cycle(model, drive, given)
        assert check is not None, "the same strokes close as before"
        label = f"± {_half_range(check):.3g} mm"
        curves += _pair(drive, given, check, label, tone)
        rows += _rows("10", check)
    mean = float(np.mean([_mean(check) for _, check in chosen]))
    caption = f"Loops about {mean:.3g} mm, measured, and by a model of {temperature_C:g} °C"
    return caption, curves, rows


def _warming(model: SpringModel, harmonic: Sequence[Drive]) -> _Drawn | str:
    """Fig. 12: the run that goes deepest, and the model that warms up along it."""
    if not harmonic:
        return "needs a harmonic run at a large prestress"
    drive = max(harmonic, key=_top)
    given = answer_to(model, drive)
    checks = check_run(drive, given).cycles
    if not checks:
        return f"the run that goes deepest ({drive.name}) has no closed loop"
    shown = sorted({round(at) for at in np.linspace(0, len(checks) - 1, min(_SHOWN, len(checks)))})
    curves, rows = [], []
    for tone, check in enumerate(checks[number] for number in shown):
        label = f"{check.start_s:.0f} s, {check.temperature_C:.0f} °C"
        curves += _pair(drive, given, check, label, tone)
        rows += _rows("12", check)
    return f"Loops of a spring that warms up, measured and by the model ({drive.name})", curves, rows


def _likeness(group: Sequence[tuple[Drive, CycleCheck]]) -> tuple[int, float]:
    """Return how many amplitudes a group of loops has, and how near to the paper's prestress it lies."""
    amplitudes = {round(_half_range(check)) for _, check in group}
    return len(amplitudes), -abs(float(np.mean([_mean(check) for _, check in group])) - PRESTRESS_MM)


def _last_cycle(model: SpringModel, drive: Drive, given: Answer | None) -> CycleCheck | None:
    checks = check_run(drive, answer_to(model, drive) if given is None else given).cycles
    return checks[-1] if checks else None


def _pair(drive: Drive, given: Answer, check: CycleCheck, label: str, tone: int) -> list[Curve]:
    """Return the measured loop and the model's over the same strokes."""
    nodes = drive.node
    begin = int(np.searchsorted(drive.time_s[nodes], check.start_s))
    last = drive.half[nodes[begin]] + 1
    part = nodes[begin:][drive.half[nodes[begin:]] <= last]
    measured = drive.force_kN[begin : begin + part.size]
    x = drive.stroke_mm[part]
    return [
        Curve(f"{label}, measured", *_closed(x, measured), tone=tone),
        Curve(f"{label}, model", *_closed(x, given.force_kN[part]), tone=tone, dash=1),
    ]


def _closed(x: Floats, force: Floats) -> tuple[Floats, Floats]:
    return np.append(x, x[0]), np.append(force, force[0])


def _rows(figure: str, check: CycleCheck) -> list[MeasuredRow]:
    what = f"{_mean(check):.3g} ± {_half_range(check):.3g} mm at {check.temperature_C:.1f} °C by the model"
    return [
        MeasuredRow(figure, check.run, f"upper force, {what}", "kN",
                    check.peak_force_kN, check.predicted_peak_force_kN),
        MeasuredRow(figure, check.run, f"damping, {what}", "1", check.damping, check.predicted_damping),
    ]  # fmt: skip


def _mean(check: CycleCheck) -> float:
    return 0.5 * (check.stroke_mm[0] + check.stroke_mm[1])


def _half_range(check: CycleCheck) -> float:
    return 0.5 * (check.stroke_mm[1] - check.stroke_mm[0])


def _top(drive: Drive) -> float:
    return float(drive.stroke_mm.max())


def _envelope(drive: Drive) -> Curve:
    """Return the first loading and unloading of a slow stroke."""
    nodes = drive.node
    first = drive.half[nodes[0]]
    part = drive.half[nodes] <= first + 1
    return Curve(
        "quasi-static, measured", drive.stroke_mm[nodes][part], drive.force_kN[part], BLACK, -1, filled=True
    )
