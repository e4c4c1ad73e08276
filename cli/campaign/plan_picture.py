"""Pictures of a plan: the required stroke over time, as the paper's Fig. 4, with the expected temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bufferstand.protocols.planning import Plan, stroke_over_time
from bufferstand.protocols.steps import PlannedStep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

NUMBERED = 45
"""Up to so many steps are numbered in the picture."""


def picture_plan(plan: Plan) -> Figure:
    """Return stroke over time with every step's number, and the temperature expected at each step's end."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only where a picture is drawn

    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.4))
    unit, per_s = ("min", 60.0) if _lasts_s(plan.steps) < 4 * 3600.0 else ("h", 3600.0)
    _stroke(above, plan.steps, per_s)
    _temperature(below, plan, per_s)
    above.set_title(plan.campaign.content.campaign.title or plan.campaign.id)
    below.set_xlabel(f"time, with the expected pauses and waits [{unit}]")
    below.set_xlim(0.0, _lasts_s(plan.steps) / per_s)
    return figure


def _lasts_s(steps: Sequence[PlannedStep]) -> float:
    wait_s = _last_wait_s(steps[-1])  # what comes after the last step is no longer of interest
    return max(1.0, sum(_whole_s(step) for step in steps) - wait_s)


def _whole_s(step: PlannedStep) -> float:
    """Return what a step takes of the time axis [s], with the waits of its stops, the last included."""
    return step.expected_duration_s + _last_wait_s(step)


def _last_wait_s(step: PlannedStep) -> float:
    return (step.stops[-1].wait_s or 0.0) if _ends_early(step) else 0.0


def _ends_early(step: PlannedStep) -> bool:
    return bool(step.stops) and step.expected_duration_s < step.duration_s


def _with_stops(step: PlannedStep) -> tuple[Floats, Floats]:
    """Return time [s] and required stroke [mm] of a step, interrupted by its expected stops."""
    time, stroke = stroke_over_time(step)
    for stop in step.stops:
        at = int(np.searchsorted(time, stop.at_s))
        if stop is step.stops[-1] and _ends_early(step):
            return time[:at], stroke[:at]
        wait_s = stop.wait_s or 0.0
        later = time[at:] + wait_s
        time = np.concatenate([time[:at], [stop.at_s, stop.at_s + wait_s], later])
        stroke = np.concatenate([stroke[:at], [0.0, 0.0], stroke[at:]])
    return time, stroke


def _stroke(axes: Axes, steps: Sequence[PlannedStep], per_s: float) -> None:
    began_s, top_mm = 0.0, 0.0
    for number, step in enumerate(steps):
        time, stroke = _with_stops(step)
        axes.plot((began_s + time) / per_s, stroke, color="0.15", linewidth=0.6)
        highest_mm = float(stroke.max(initial=0.0))
        top_mm = max(top_mm, highest_mm)
        end_s = began_s + _whole_s(step)
        if number % 2:
            axes.axvspan(began_s / per_s, end_s / per_s, color="0.93", linewidth=0, zorder=0)
        if len(steps) <= NUMBERED and highest_mm > 0.0:
            axes.annotate(
                str(step.index),
                ((began_s + step.expected_duration_s / 2.0) / per_s, highest_mm),
                textcoords="offset points",
                xytext=(0, 4 + 9 * (number % 2)),
                ha="center",
                fontsize=7,
            )
        began_s = end_s
    axes.set_ylim(-0.03 * max(top_mm, 1.0), 1.16 * max(top_mm, 1.0))
    axes.set_ylabel("required stroke [mm]")


def _temperature(axes: Axes, plan: Plan, per_s: float) -> None:
    conditions, test = plan.campaign.content.conditions, plan.campaign.limits
    start_C = conditions.start_C()
    mass, sensor = [(0.0, start_C)], [(0.0, start_C)]
    began_s = 0.0
    for step in plan.steps:
        ends = _ends_early(step)
        for stop in step.stops:
            at = (began_s + stop.at_s) / per_s
            sensor.append((at, test.temperature_stop_C))
            axes.axvline(at, color="tab:red", linewidth=0.6)
            if stop.wait_s is not None and not (ends and step is plan.steps[-1]):
                sensor.append((at + stop.wait_s / per_s, test.temperature_resume_C))
        end_s = began_s + step.expected_duration_s
        mass.append((end_s / per_s, step.end_temperature_C))
        if not ends:
            sensor.append((end_s / per_s, step.sensor_end_temperature_C))
        began_s += _whole_s(step)
    axes.plot(*zip(*mass, strict=True), color="tab:red", linewidth=1.0, label="spring")
    axes.plot(*zip(*sensor, strict=True), color="tab:orange", linewidth=1.0, linestyle="--", label="sensor")
    axes.axhline(test.temperature_stop_C, color="0.4", linestyle=":", linewidth=1.0)
    axes.annotate(
        "stop", (0.0, test.temperature_stop_C), textcoords="offset points", xytext=(3, 2), fontsize=8
    )
    axes.set_ylim(top=max(test.temperature_stop_C, plan.max_temperature_C) + 2.0)
    axes.set_ylabel("expected [°C]")
    axes.legend(loc="lower right", fontsize=8)
