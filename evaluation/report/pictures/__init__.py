"""Figures of a report, with their captions and the numbers behind them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.pictures.comparison import (
        comparison_pictures,
    )
    from bufferstand.evaluation.report.pictures.gallery import (
        certificate_picture,
        course_section,
        figures_section,
        model_comparison_section,
    )

__all__ = [
    "certificate_picture",
    "comparison_pictures",
    "course_section",
    "figures_section",
    "model_comparison_section",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
