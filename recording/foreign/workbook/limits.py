"""Limits on what a workbook makes a reader hold and go through: a few bytes can state a billion rows."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.library_files import of_library

MOST_ROWS = 1_048_576
"""Of a sheet, by Excel's own limit."""
MOST_COLUMNS = 1024
"""In which something stands; a row is filled up to its last one."""
MOST_CELLS = 100_000_000
MOST_SHEET_BYTES = 2 << 30
"""Of one sheet as it is unpacked, row by row: a million rows of 20 numbers have 800 MB."""
MOST_OTHER_BYTES = 256 << 20
"""Of everything else, which is held in memory: shared texts, styles."""
_EXPORT = "export the sheet as CSV"


def demand_bounded(stream: BinaryIO, path: Path) -> None:
    """Refuse a workbook whose parts are larger, as they are unpacked, than any record's.

    Raises
    ------
    BadInput
        If one is, or the file is no ZIP archive.
    """
    with of_library(path, "workbook (.xlsx)"), zipfile.ZipFile(stream) as archive:
        parts = archive.infolist()
    stream.seek(0)
    sheets = [part.file_size for part in parts if "/worksheets/" in f"/{part.filename}"]
    others = sum(part.file_size for part in parts) - sum(sheets)
    if max(sheets, default=0) > MOST_SHEET_BYTES or others > MOST_OTHER_BYTES:
        raise BadInput(
            f"it unpacks to {sum(sheets) + others} bytes, more than any record", file=path, remedy=_EXPORT
        )


def cells_of(sheet: Any, path: Path, *, values_only: bool = True) -> Iterator[tuple[Any, ...]]:
    """Yield the cells of each row of a sheet, also of those that are left out because they are empty.

    Raises
    ------
    BadInput
        If there are more rows or columns than a sheet can have, or more cells than a record can.
    """
    sheet.reset_dimensions()  # what other programs state of a sheet's size is often wrong
    place = f"sheet “{sheet.title}”"
    count = 0
    for number, cells in enumerate(sheet.iter_rows(values_only=values_only), start=1):
        count += len(cells)
        if number > MOST_ROWS:
            raise BadInput(f"more than {MOST_ROWS} rows", file=path, place=place, remedy=_EXPORT)
        if len(cells) > MOST_COLUMNS:
            where = f"{place}, row {number}"
            raise BadInput(f"more than {MOST_COLUMNS} columns", file=path, place=where, remedy=_EXPORT)
        if count > MOST_CELLS:
            raise BadInput(f"more than {MOST_CELLS} cells", file=path, place=place, remedy=_EXPORT)
        yield cells
