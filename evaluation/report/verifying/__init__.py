"""Checking a report that somebody sent: its signature, what it has inside, and the runs that it names."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.verifying.checks import (
        Against,
        verify_report,
    )
    from bufferstand.evaluation.report.verifying.file_kind import (
        is_report,
    )
    from bufferstand.evaluation.report.verifying.findings import (
        Finding,
    )

__all__ = [
    "Against",
    "Finding",
    "is_report",
    "verify_report",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
