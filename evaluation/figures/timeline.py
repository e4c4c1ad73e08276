"""A campaign over time: temperature with its limit, and the stroke as it was run (paper, Fig. 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.figures.decimate import kept_samples
from bufferstand.evaluation.figures.plot import Curve, Floats, Level, Plot, Span, Stop
from bufferstand.evaluation.wording import numeral, said

TEMPERATURE = said("Temperature [°C]")
ENERGY = said("Energy absorbed [kJ]")
STROKE = said("Stroke [mm]")
_TRACE_POINTS = 3000
_AXIS_MM, _DIGIT_MM = 140.0, 1.7
"""Width of the time axis at least, and of a letter of the steps' numbers above it, with what is between."""


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel over the campaign's time; NaN between runs and at gaps, so that no line is drawn there."""

    label: str
    time_s: Floats
    value: Floats


@dataclass(frozen=True)
class TimelineStep:
    """One run on the campaign's time axis; ``stop`` says why it ended early, and is empty otherwise."""

    label: str
    start_s: float
    end_s: float
    stop: str = ""


def temperature_plot(
    traces: Sequence[Trace], steps: Sequence[TimelineStep], stop_C: float | None, energy: Trace | None = None
) -> Plot:
    """Return the temperatures over the campaign, its steps shaded, temperature limit and stops marked.

    ``energy`` [J] is drawn below them, in kJ (paper, Fig. 11).
    """
    levels = (
        () if stop_C is None else (Level(stop_C, said("stop at {stop_c} °C", stop_c=numeral(f"{stop_C:g}"))),)
    )
    lowest, highest = _span(traces)
    tops = [highest, *(level.at for level in levels)]
    margin = 0.06 * (max(tops) - lowest) or 1.0
    below = None if energy is None else _energy_panel(energy, steps, tone=len(traces))
    plot = _timeline(
        traces,
        steps,
        TEMPERATURE,
        levels=levels,
        y_range=(lowest - margin, max(tops) + margin),
        height_mm=52.0,
    )
    return replace(plot, below=below)


def _energy_panel(energy: Trace, steps: Sequence[TimelineStep], tone: int) -> Plot:
    """Return the energy absorbed since the start of the campaign; its steps are named in the panel above."""
    trace = Trace(energy.label, energy.time_s, energy.value / 1000.0)
    _, highest = _span([trace])
    unnamed = [replace(step, label="", stop="") for step in steps]
    plot = _timeline(
        [trace], unnamed, ENERGY, levels=(), y_range=(0.0, 1.05 * highest or 1.0), height_mm=28.0
    )
    (curve,) = plot.curves
    return replace(plot, curves=(replace(curve, tone=tone, dash=tone),))


def stroke_plot(traces: Sequence[Trace], steps: Sequence[TimelineStep]) -> Plot:
    """Return the stroke over the campaign with its steps shaded and the stops marked (paper, Fig. 4)."""
    lowest, highest = _span(traces)
    return _timeline(
        traces, steps, STROKE, levels=(), y_range=(min(0.0, lowest), 1.05 * highest or 1.0), height_mm=50.0
    )


def _timeline(
    traces: Sequence[Trace],
    steps: Sequence[TimelineStep],
    y_label: str,
    *,
    levels: tuple[Level, ...],
    y_range: tuple[float, float],
    height_mm: float,
) -> Plot:
    duration = max((step.end_s for step in steps), default=0.0)
    unit, scale = time_unit(duration)
    curves = []
    for number, trace in enumerate(traces):
        kept = kept_samples(trace.time_s, trace.value, _TRACE_POINTS)
        curves.append(
            Curve(trace.label, trace.time_s[kept] / scale, trace.value[kept], tone=number, dash=number)
        )
    spans = tuple(
        Span(step.start_s / scale, step.end_s / scale, label)
        for step, label in zip(steps, _labels_with_room(steps, duration), strict=True)
    )
    stops = tuple(
        Stop(step.end_s / scale, said("run {label} {stop}", label=step.label, stop=step.stop))
        for step in steps
        if step.stop
    )
    return Plot(
        said("Time since the start of the first step [{unit}]", unit=unit),
        y_label,
        kind="timeline",
        curves=tuple(curves),
        spans=spans,
        levels=levels,
        stops=stops,
        x_range=(0.0, duration / scale or 1.0),
        y_range=y_range,
        height_mm=height_mm,
    )


def _labels_with_room(steps: Sequence[TimelineStep], duration_s: float) -> list[str]:
    """Return the label of each step; none of a step whose label would run into the one before."""
    labels: list[str] = []
    taken_mm = 0.0
    for step in steps:
        middle_mm = 0.5 * (step.start_s + step.end_s) / (duration_s or 1.0) * _AXIS_MM
        half_mm = 0.5 * (len(step.label) + 1) * _DIGIT_MM
        fits = not labels or middle_mm - half_mm >= taken_mm
        labels.append(step.label if fits else "")
        if fits and step.label:
            taken_mm = middle_mm + half_mm
    return labels


def time_unit(duration_s: float) -> tuple[str, float]:
    """Return the unit in which a duration reads well, and its length [s]."""
    if duration_s <= 300.0:
        return "s", 1.0
    return ("min", 60.0) if duration_s <= 180.0 * 60.0 else ("h", 3600.0)


def _span(traces: Sequence[Trace]) -> tuple[float, float]:
    values = [trace.value[~np.isnan(trace.value)] for trace in traces]
    whole = [value for value in values if value.size]
    if not whole:
        return 0.0, 1.0
    return min(float(value.min()) for value in whole), max(float(value.max()) for value in whole)
