"""The tables of a report as an Excel workbook: a sheet a table, numbers as numbers, rounded as printed."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Sequence
from typing import Any

from bufferstand.evaluation.document import fit_for_excel
from bufferstand.evaluation.report.content import Cell, Content, Picture, Table
from bufferstand.evaluation.report.rendering.frame import figure_title
from bufferstand.evaluation.wording import ENGLISH, Language, said

_LONGEST_NAME = 31
_NOT_IN_NAMES = re.compile(r"[\[\]:*?/\\]")
_NUMBER = re.compile(r"-?\d+(?:\.(\d+))?")
_POWER = re.compile(r"(-?\d\.\d+) × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_LOWERED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_PLUS_MINUS = " ± "
_VALUES = frozenset({"number", "open"})
"""Tones of a measured value; ``open`` is one in doubt."""
_EARLIEST = (1980, 1, 1, 0, 0, 0)
_SAVED = re.compile(rb"(<dcterms:(?:created|modified)[^>]*>)[^<]*(<)")
_WIDEST = 48


def render_workbook(content: Content) -> bytes:
    """Return the tables of a report as a workbook (.xlsx).

    Value and U stand in two columns; a missing value is its reason, as text.

    Parameters
    ----------
    content : Content
        A report, best a detailed one.

    Returns
    -------
    bytes
        The same bytes for the same content.
    """
    from openpyxl import Workbook  # noqa: PLC0415 - an optional library

    book = Workbook()
    book.remove(book.active)
    for number, table in enumerate(_tables(content), start=1):
        _fill(book.create_sheet(_name(number, table.title)), table, content)
    whole = io.BytesIO()
    book.save(whole)
    return _undated(whole)


def _tables(content: Content) -> Iterator[Table]:
    blocks = (*content.certificate, *(block for section in content.sections for block in section.blocks))
    for block in blocks:
        if isinstance(block, Table):
            yield block
        elif isinstance(block, Picture):
            title = figure_title(content.language, block.number, block.numbers.title)
            yield Table(title, block.numbers.columns, block.numbers.rows, block.numbers.note)


def _name(number: int, title: str) -> str:
    return _NOT_IN_NAMES.sub(" ", f"{number} {title}")[:_LONGEST_NAME].strip()


def _fill(sheet: Any, table: Table, content: Content) -> None:
    from openpyxl.styles import Alignment, Font  # noqa: PLC0415

    language = content.language
    spread = [any(_has_u(row[n]) for row in table.rows) for n in range(len(table.columns))]
    heads: list[str] = []
    for column, two in zip(table.columns, spread, strict=True):
        unit = f" [{column.unit}]" if column.unit else ""
        title = column.title.removesuffix(" ± U") if two else column.title
        heads += (
            [f"{title}{unit}", language.say(said("U of {quantity}", quantity=f"{title}{unit}"))]
            if two
            else [f"{title}{unit}"]
        )
    _put(sheet, 1, 1, table.title, Font(bold=True))
    for place, head in enumerate(heads, start=1):
        _put(sheet, 2, place, head, Font(bold=True)).alignment = Alignment(wrap_text=True, vertical="bottom")
    for at, row in enumerate(table.rows, start=3):
        _fill_row(sheet, at, row, spread, language)
    last = len(table.rows) + 4
    for below, text in enumerate(
        filter(None, (table.note, f"{language.say(said('Report'))} {content.report_id}"))
    ):
        _put(sheet, last + below, 1, text, Font(italic=True))
    sheet.freeze_panes = "B3"
    for place, head in enumerate(heads, start=1):
        longest = max([len(str(sheet.cell(at, place).value or "")) for at in range(3, last - 1)], default=0)
        width = min(_WIDEST, max(longest, max(map(len, head.split()), default=0)) + 2)
        sheet.column_dimensions[sheet.cell(2, place).column_letter].width = width


def _has_u(cell: Cell) -> bool:
    """Say whether a cell is one value with its U: a text with ± is none (a step's prestress ± amplitude).

    A span of two values, each with its U, stays whole.
    """
    return cell.tone in _VALUES and cell.text.count(_PLUS_MINUS) == 1


def _fill_row(sheet: Any, at: int, row: Sequence[Cell], spread: Sequence[bool], language: Language) -> None:
    from openpyxl.styles import Font  # noqa: PLC0415

    place = 1
    for cell, two in zip(row, spread, strict=True):
        if cell.tone == "missing":
            _put(sheet, at, place, cell.why, Font(italic=True, color="00565D69"))
        else:
            value, _, expanded = cell.text.partition(_PLUS_MINUS) if _has_u(cell) else (cell.text, "", "")
            for beside, text in enumerate((value, expanded) if two else (value,)):
                _put(sheet, at, place + beside, text, language=language)
        place += 1 + two


def _put(sheet: Any, row: int, column: int, text: str, font: Any = None, language: Language = ENGLISH) -> Any:
    """Write a cell: what is a number as one, with the decimals printed; a text stays a text."""
    cell = sheet.cell(row, column)
    plain = language.plain(text).replace("−", "-").replace("+", "")
    if font is None and (number := _NUMBER.fullmatch(plain)):
        cell.value = float(plain) if number[1] else int(plain)
        cell.number_format = "0." + "0" * len(number[1]) if number[1] else "0"
        return cell
    if font is None and (power := _POWER.fullmatch(plain)):
        cell.value = float(f"{power[1]}e{power[2].translate(_LOWERED)}")
        cell.number_format = "0." + "0" * (len(power[1].lstrip("-")) - 2) + "E+00"
        return cell
    cell.value = fit_for_excel(text) or None
    if cell.data_type == "f":
        cell.data_type = "s"  # openpyxl takes a text that begins with = for a formula
    if font is not None:
        cell.font = font
    return cell


def _undated(book: io.BytesIO) -> bytes:
    """Return a workbook without the time at which it was saved."""
    out = io.BytesIO()
    with zipfile.ZipFile(book) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.infolist():
            data = old.read(entry)
            if entry.filename == "docProps/core.xml":
                data = _SAVED.sub(rb"\g<1>1980-01-01T00:00:00Z\g<2>", data)
            new.writestr(zipfile.ZipInfo(entry.filename, _EARLIEST), data, zipfile.ZIP_DEFLATED)
    return out.getvalue()
