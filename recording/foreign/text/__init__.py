"""Text files of columns (CSV, TSV): how they are written, and their rows."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.foreign.text.record import (
        DelimitedRecord,
    )
    from bufferstand.recording.foreign.text.row_filter import (
        HEADINGS,
        REMARKS,
    )

__all__ = [
    "HEADINGS",
    "REMARKS",
    "DelimitedRecord",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
