"""A spring model beside recorded runs, and the paper's figures beside simulated ones."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.figures.model_comparison.model_answers import (
        AT_CONTACT_MM,
        KINDS,
        RunCheck,
        answer_to,
        check_run,
        drive_of,
        start_temperature_C,
    )
    from bufferstand.evaluation.figures.model_comparison.paper_figures import (
        PaperComparison,
        PaperFigure,
        compare_with_paper,
    )
    from bufferstand.evaluation.figures.model_comparison.paper_measured import (
        MeasuredComparison,
        MeasuredRow,
        compare_measured,
    )
    from bufferstand.evaluation.figures.model_comparison.paper_rows import (
        PaperRow,
    )

__all__ = [
    "AT_CONTACT_MM",
    "KINDS",
    "MeasuredComparison",
    "MeasuredRow",
    "PaperComparison",
    "PaperFigure",
    "PaperRow",
    "RunCheck",
    "answer_to",
    "check_run",
    "compare_measured",
    "compare_with_paper",
    "drive_of",
    "start_temperature_C",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
