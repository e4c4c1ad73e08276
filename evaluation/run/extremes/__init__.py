"""Extremes of a run: the least and greatest of all samples and speeds, with their uncertainty."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.run.extremes.of_run import (
        Recorded,
        extreme_warnings,
        run_extremes,
        sample_extremes,
        step_extremes,
    )

__all__ = [
    "Recorded",
    "extreme_warnings",
    "run_extremes",
    "sample_extremes",
    "step_extremes",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
