"""A spring model beside the measurement: loops (paper, Figs 10 and 12) and a run that warms up (Fig. 11)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.figures.decimate import kept_samples
from bufferstand.evaluation.figures.loops import FORCE_LABEL, STROKE_LABEL, LoopCurve, framed_ranges
from bufferstand.evaluation.figures.plot import BLACK, Curve, Floats, Plot
from bufferstand.evaluation.figures.timeline import ENERGY, STROKE, TEMPERATURE, Trace, time_unit
from bufferstand.evaluation.wording import said

_POINTS = 1500
_SOLID = 0


@dataclass(frozen=True, eq=False)
class LoopPair:
    """One cycle as measured and by the model, and how the legend names it."""

    label: str
    measured: LoopCurve
    model: LoopCurve


@dataclass(frozen=True, eq=False)
class Warming:
    """A run over time, measured and by the model."""

    stroke: Trace
    energies: Sequence[Trace]
    """Energy absorbed [J]."""
    temperatures: Sequence[Trace]


def model_loops(pairs: Sequence[LoopPair]) -> Plot:
    """Return measured loops, black with a symbol each, under those of the model, dashed in colour."""
    curves = []
    for number, pair in enumerate(pairs):
        curves.append(
            _curve(said("{label}, measured", label=pair.label), pair.measured, BLACK, _SOLID, number)
        )
        curves.append(_curve(said("{label}, model", label=pair.label), pair.model, number, number + 1, None))
    ranges = framed_ranges([loop for pair in pairs for loop in (pair.measured, pair.model)])
    return Plot(STROKE_LABEL, FORCE_LABEL, curves=tuple(curves), height_mm=92.0, **ranges)


def _curve(label: str, loop: LoopCurve, tone: int, dash: int, marker: int | None) -> Curve:
    kept = kept_samples(loop.stroke_mm, loop.force_kN, _POINTS)
    return Curve(label, loop.stroke_mm[kept], loop.force_kN[kept], tone, dash, marker)


def warming_plot(warming: Warming) -> Plot:
    """Return stroke, energy absorbed and temperatures over time, one below the other (paper, Fig. 11)."""
    unit, scale = time_unit(float(np.nanmax(warming.stroke.time_s)))
    x_label = said("Time since the start of the run [{unit}]", unit=unit)
    x_range = (0.0, float(np.nanmax(warming.stroke.time_s)) / scale or 1.0)

    def panel(label: str, traces: Sequence[Trace], height_mm: float, below: Plot | None, tone: int) -> Plot:
        curves = tuple(
            Curve(trace.label, time / scale, value, tone=tone + number, dash=tone + number)
            for number, trace in enumerate(traces)
            for time, value in [_thinned(trace)]
        )
        return Plot(
            x_label,
            label,
            kind="timeline",
            curves=curves,
            x_range=x_range,
            y_range=_framed([trace.value for trace in traces]),
            height_mm=height_mm,
            below=below,
        )

    kilo = [Trace(one.label, one.time_s, one.value / 1000.0) for one in warming.energies]
    temperature = panel(TEMPERATURE, warming.temperatures, 48.0, None, 3)
    energy = panel(ENERGY, kilo, 40.0, temperature, 1)
    return panel(STROKE, [warming.stroke], 32.0, energy, 0)


def _thinned(trace: Trace) -> tuple[Floats, Floats]:
    kept = kept_samples(trace.time_s, trace.value, 2 * _POINTS)
    return trace.time_s[kept], trace.value[kept]


def _framed(values: Sequence[Floats]) -> tuple[float, float]:
    low = min(float(np.nanmin(value)) for value in values)
    high = max(float(np.nanmax(value)) for value in values)
    margin = 0.06 * (high - low) or 1.0
    return (low - margin if low < 0.0 or low > margin else 0.0), high + margin
