"""Extremes of a run: the least and the greatest of all its samples, apart from any mean."""

from bufferstand.evaluation.extremes.of_run import (
    Extremes,
    Recorded,
    extreme_warnings,
    run_extremes,
    sample_extremes,
    step_extremes,
)
from bufferstand.evaluation.extremes.peaks import joined, peaks_of

__all__ = [
    "Extremes",
    "Recorded",
    "extreme_warnings",
    "joined",
    "peaks_of",
    "run_extremes",
    "sample_extremes",
    "step_extremes",
]
