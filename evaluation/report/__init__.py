"""Test reports: built from runs and their evaluation, and written as HTML and PDF."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.source import (
        Given,
    )
    from bufferstand.evaluation.report.validation_record import (
        write_validation,
    )
    from bufferstand.evaluation.report.writing import (
        formats_here,
        write_comparison,
        write_report,
    )

__all__ = [
    "Given",
    "formats_here",
    "write_comparison",
    "write_report",
    "write_validation",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
