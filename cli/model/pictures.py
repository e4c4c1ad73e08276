"""Pictures of the spring model: as the paper's Figs 10 to 12."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model import Simulation, SpringModel
from bufferstand.model.identification import Answer, Drive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

_CURVES: dict[str, Any] = {"color": "0.6", "linestyle": ":", "linewidth": 1.5}
_MEASURED: dict[str, Any] = {"color": "0.35", "linewidth": 0.9}
_MODEL: dict[str, Any] = {"color": "tab:red", "linewidth": 0.9}


def picture_comparison(model: SpringModel, drive: Drive, given: Answer) -> Figure:
    """Return force over stroke, measured and by the model (Figs 10 and 12), and residuals."""
    figure = _figure(7.0)
    loops, rest = figure.subplots(2, 1, height_ratios=(3, 1), sharex=True)
    _curves(loops, model)
    stroke = drive.stroke_mm[drive.node]
    loops.plot(stroke, drive.force_kN, label="measured", **_MEASURED)
    loops.plot(drive.stroke_mm, given.force_kN, label="model", **_MODEL)
    loops.set_ylabel("force [kN]")
    loops.set_title(drive.name or model.name)
    loops.legend(loc="upper left")
    rest.plot(stroke, given.force_kN[drive.node] - drive.force_kN, color="tab:red", linewidth=0.5)
    rest.set_ylabel("model − measured\n[kN]")
    rest.set_xlabel("stroke [mm]")
    return figure


def picture_warming(drive: Drive, given: Answer) -> Figure:
    """Return stroke, and temperature of spring and sensor, over time (Fig. 11)."""
    figure = _figure(5.5)
    stroke, warm = figure.subplots(2, 1, sharex=True)
    stroke.plot(drive.time_s, drive.stroke_mm, color="0.35", linewidth=0.7)
    stroke.set_ylabel("stroke [mm]")
    stroke.set_title(drive.name)
    warm.plot(drive.time_s, given.temperature_C, color="tab:red", linewidth=1.0, label="spring, model")
    warm.plot(drive.time_s, given.sensor_C, color="tab:orange", linewidth=1.0, label="sensor, model")
    warm.plot(drive.sensor_s, drive.sensor_C, ".", color="0.35", markersize=3, label="sensor, measured")
    warm.set_ylabel("temperature [°C]")
    warm.set_xlabel("time [s]")
    warm.legend(loc="upper left")
    return figure


def picture_simulation(model: SpringModel, time_s: Floats, stroke_mm: Floats, done: Simulation) -> Figure:
    """Return stroke, absorbed energy and temperature over time, and the loops (Figs 11 and 12)."""
    figure = _figure(8.0)
    axes = figure.subplots(3, 1, height_ratios=(1, 1, 2))
    axes[0].plot(time_s, stroke_mm, color="0.35", linewidth=0.7)
    axes[0].set_ylabel("stroke [mm]")
    axes[0].set_title(model.name)
    axes[1].plot(time_s, done.heat_J / 1000.0, color="0.1", label="absorbed energy")
    axes[1].set_ylabel("energy [kJ]")
    axes[1].set_xlabel("time [s]")
    right = axes[1].twinx()
    right.plot(time_s, done.temperature_C, color="tab:red", label="spring")
    right.plot(time_s, done.sensor_temperature_C, color="tab:orange", label="sensor")
    right.set_ylabel("temperature [°C]")
    right.legend(loc="upper left")
    _curves(axes[2], model)
    axes[2].plot(stroke_mm, done.force_kN, label="model", **_MODEL)
    axes[2].set_xlabel("stroke [mm]")
    axes[2].set_ylabel("force [kN]")
    axes[2].legend(loc="upper left")
    return figure


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure as PNG or SVG, by the file's ending; its folder is made.

    Raises
    ------
    BadInput
        If the ending is another, or the file cannot be written.
    """
    if path.suffix.lower() not in (".png", ".svg"):
        raise BadInput("a picture ends with .png or .svg", file=path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=path) from None


def _figure(height: float) -> Figure:
    from matplotlib.figure import Figure  # noqa: PLC0415 - only where a picture is drawn

    return Figure(figsize=(7.5, height), layout="constrained")


def _curves(axes: Axes, model: SpringModel) -> None:
    x = np.linspace(0.0, model.curves.end_mm, 400)
    label = f"curves at {model.temperature.reference_C:g} °C"
    axes.plot(x, model.curves.loading(x), label=label, **_CURVES)
    axes.plot(x, model.curves.unloading(x), **_CURVES)
