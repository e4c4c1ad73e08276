"""Figures: builders turn results into plot data, and the painter makes SVG or PNG of it."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.figures.decimate import (
        kept_samples,
        with_breaks,
    )
    from bufferstand.evaluation.figures.differences import (
        ChangeSeries,
        changes_plot,
    )
    from bufferstand.evaluation.figures.loops import (
        STATIC_MM,
        LoopCurve,
        amplitude_loops,
        dynamic_loops,
        frequency_loops,
        labelled_loops,
        static_loops,
    )
    from bufferstand.evaluation.figures.model import (
        LoopPair,
        Warming,
        model_loops,
        warming_plot,
    )
    from bufferstand.evaluation.figures.paint import (
        draw,
        draw_png,
    )
    from bufferstand.evaluation.figures.plot import (
        Floats,
        Plot,
        Window,
    )
    from bufferstand.evaluation.figures.timeline import (
        TimelineStep,
        Trace,
        stroke_plot,
        temperature_plot,
    )
    from bufferstand.evaluation.figures.trends import (
        LEAST_FREEDOM,
        TrendSeries,
        trend_plot,
    )

__all__ = [
    "LEAST_FREEDOM",
    "STATIC_MM",
    "ChangeSeries",
    "Floats",
    "LoopCurve",
    "LoopPair",
    "Plot",
    "TimelineStep",
    "Trace",
    "TrendSeries",
    "Warming",
    "Window",
    "amplitude_loops",
    "changes_plot",
    "draw",
    "draw_png",
    "dynamic_loops",
    "frequency_loops",
    "kept_samples",
    "labelled_loops",
    "model_loops",
    "static_loops",
    "stroke_plot",
    "temperature_plot",
    "trend_plot",
    "warming_plot",
    "with_breaks",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
