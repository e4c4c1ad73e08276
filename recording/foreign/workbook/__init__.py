"""Excel workbooks: one sheet as a table, row by row."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.foreign.workbook.record import (
        ExcelRecord,
    )

__all__ = [
    "ExcelRecord",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
