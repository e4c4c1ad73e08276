"""Steps of a run: groups of cycles that belong together, each with a summary of its own.

What makes the figures of a step is in :mod:`bufferstand.evaluation.run.steps.step_figures`; it is slow to
import, and documents and archives do without."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.run.steps.division import (
        Division,
    )
    from bufferstand.evaluation.run.steps.means_without_spoiled import (
        division_without,
        summed_without_claims,
        unfit_warnings,
    )
    from bufferstand.evaluation.run.steps.sine_corrections import (
        with_settling,
    )
    from bufferstand.evaluation.run.steps.step_figures import (
        EvaluatedCycles,
        StepFigures,
        sum_up,
    )

__all__ = [
    "Division",
    "EvaluatedCycles",
    "StepFigures",
    "division_without",
    "sum_up",
    "summed_without_claims",
    "unfit_warnings",
    "with_settling",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
