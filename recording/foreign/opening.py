"""Chooses the reader of a foreign record by the content of the file, not by its name."""

from __future__ import annotations

import stat
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.record import ForeignRecord, ReadingOptions
from bufferstand.recording.foreign.text import DelimitedRecord

_ZIP = b"PK\x03\x04"
_OLD_OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_HDF5 = b"\x89HDF\r\n\x1a\n"


def open_record(path: Path, reading: ReadingOptions) -> ForeignRecord:
    """Open a foreign record of any kind that is understood.

    Raises
    ------
    BadInput
        If it cannot be read, is no regular file, or is of no kind that is understood.
    """
    try:
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            # Of a pipe, nothing can be read twice; and one that nobody writes to is waited for, for ever.
            raise BadInput("is no regular file", file=path, remedy="save it as a file first")
        with path.open("rb") as stream:
            head = stream.read(8)
            stream.seek(512)
            behind_user_block = stream.read(8)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None
    if head.startswith((b"TDSm", b"TDSh")):
        from bufferstand.recording.foreign.channel_groups import TdmsRecord  # noqa: PLC0415 - optional library

        return TdmsRecord(path, reading)
    if head.startswith((b"MDF ", b"UnFinMF")):
        from bufferstand.recording.foreign.channel_groups import MdfRecord  # noqa: PLC0415 - optional library

        return MdfRecord(path, reading)
    if head.startswith(_ZIP):
        from bufferstand.recording.foreign.workbook import ExcelRecord  # noqa: PLC0415 - optional library

        return ExcelRecord(path, reading)
    if head.startswith(_OLD_OFFICE):
        raise BadInput(
            "a workbook in the old Excel format (.xls)", file=path, remedy="save it as .xlsx or CSV"
        )
    if _HDF5 in (head, behind_user_block):
        raise BadInput(
            "this is an HDF5 file, maybe a run file already",
            file=path,
            remedy="“bufferstand evaluate” reads run files; export other HDF5 files as CSV, TDMS or MDF4",
        )
    if reading.sheet is not None:
        raise BadInput("a sheet is named, and this is no workbook", file=path, remedy="leave out --sheet")
    if reading.groups:
        raise BadInput(
            "a group of channels is named, and this is a text file", file=path, remedy="leave out --group"
        )
    return DelimitedRecord(path, reading)
