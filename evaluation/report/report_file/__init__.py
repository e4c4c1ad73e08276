"""A report as a file: its PDF from anywhere, read within bounds, and the files inside (extra ``sign``)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.report_file.proof import (
        PROOF_NAME,
        PROOF_SCHEMA,
        NamedRun,
        Proof,
    )
    from bufferstand.evaluation.report.report_file.reading import (
        ReportFile,
        read_pdf,
        read_report,
    )

__all__ = [
    "PROOF_NAME",
    "PROOF_SCHEMA",
    "NamedRun",
    "Proof",
    "ReportFile",
    "read_pdf",
    "read_report",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
