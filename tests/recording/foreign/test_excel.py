"""Excel workbooks as people fill them: read right, or refused with the cell."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from openpyxl import Workbook, load_workbook
from openpyxl.utils.datetime import CALENDAR_MAC_1904, CALENDAR_WINDOWS_1900
from openpyxl.worksheet.formula import ArrayFormula

from bufferstand.recording.foreign.record import ReadingOptions
from bufferstand.recording.foreign.workbook.record import ExcelRecord
from bufferstand.recording.runfile.run import Run

from .attempts import mapping, read, refused


def book(tmp_path: Path, sheets: dict[str, list[list[Any]]]) -> Path:
    path = tmp_path / "record.xlsx"
    workbook = Workbook()
    workbook.remove(workbook.active)
    for title, rows in sheets.items():
        sheet = workbook.create_sheet(title)
        for row in rows:
            sheet.append(row)
    workbook.save(path)
    return path


def rewritten(path: Path, old: str, new: str) -> None:
    """Change the XML of the first sheet, to what openpyxl does not write."""
    with ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    text = parts[sheet].decode()
    assert old in text
    parts[sheet] = text.replace(old, new).encode()
    with ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


HEAD = ["time [s]", "stroke [mm]", "force [kN]"]
ROWS: list[list[Any]] = [[0, 1, 2], [1, 2.5, 3], [2, 3, 4]]


def test_several_sheets_are_named_or_refused(tmp_path: Path) -> None:
    path = book(tmp_path, {"Info": [["Rig 3"]], "Data": [HEAD, *ROWS], "Nothing": []})
    assert "2 sheets hold something; say which by --sheet; they are “Info”, “Data”, “Nothing”" in refused(
        path
    )
    assert "no sheet is named “data”; the sheets are “Info”" in refused(path, sheet="data")
    run, _ = read(path, sheet="Data")
    assert run.series("stroke").value.tolist() == [1.0, 2.5, 3.0]
    assert run.metadata["original"]["sheet"] == "Data"


def test_formulas_count_by_their_stored_values(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, [0, 1, 2], [1, "=B2*2", 3], [2, 3, 4]]})
    assert "sheet “Data”, cell B3: a formula whose value is not stored; open the workbook" in refused(path)


def test_cells_of_a_sheet_that_are_no_numbers(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, [0, 1, 2], [1, "#DIV/0!", 3], [2, 3, True]]})
    assert "row 3, column 2 “stroke [mm]”: “#DIV/0!” is no number" in refused(path)
    run, warnings = read(path, salvage=True)
    assert np.array_equal(run.series("stroke").value, [1.0, np.nan, 3.0], equal_nan=True)
    assert "2 cell(s) that are no number, taken as no value, the first in row 3" in warnings


def test_numbers_stored_as_texts(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, [0, "1,5", "2"], [1, "2,5", "3"], [2, 3.5, "4"]]})
    run, warnings = read(path)
    assert run.series("stroke").value.tolist() == [1.5, 2.5, 3.5]
    assert "5 number(s) stored as text, the first in row 2" in warnings


def test_a_sheet_with_dates_and_headings_inside(tmp_path: Path) -> None:
    start = datetime(2026, 3, 5, 14, 2, 11)  # noqa: DTZ001 - Excel knows no zones
    rows = [[start + timedelta(milliseconds=20 * i), i, 2 * i] for i in range(6)]
    head, units = ["time", "stroke", "force"], [None, "mm", "kN"]
    path = book(tmp_path, {"Data": [head, units, *rows[:3], [], head, units, *rows[3:]]})
    run, warnings = read(path)
    assert run.series("force").time_s == pytest.approx(np.arange(6) * 0.02, abs=1e-9)
    assert run.metadata["run"]["started_utc"] == "2026-03-05T14:02:11+00:00"
    assert "1 header row(s) inside the data, the first in row 7" in warnings
    assert "its dates and times state no zone and count as UTC" in warnings


def test_a_row_of_text_inside_a_sheet(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, *ROWS, ["operator stopped"], [3, 4, 5]]})
    assert "sheet “Data”, row 5: a row of text inside the data" in refused(path)
    run, _ = read(path, salvage=True)
    assert run.series("stroke").value.tolist() == [1.0, 2.5, 3.0, 4.0]


def test_workbooks_that_are_none(tmp_path: Path) -> None:
    path = tmp_path / "record.xls"
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600)
    assert "a workbook in the old Excel format (.xls); save it as .xlsx" in refused(path)
    assert "the workbook is empty" in refused(book(tmp_path, {"Data": []}))
    assert "no header row" in refused(book(tmp_path, {"Data": ROWS}))


# --- where the table is, and what stands between its rows ---------------------------------------------


@pytest.mark.parametrize(
    "above",
    [[[]], [[], [], []], [["# by rig 3"]], [["Rig 3"]], [["Test", "of", "rig", "3", "by", "K. Test"]]],
)
@pytest.mark.parametrize("left", [0, 1])
def test_a_table_below_other_rows_and_right_of_empty_columns(
    tmp_path: Path, above: list[list[Any]], left: int
) -> None:
    path = book(tmp_path, {"Data": [*above, *([*[None] * left, *row] for row in [HEAD, *ROWS])]})
    run, warnings = read(path)
    assert run.series("stroke").value.tolist() == [1.0, 2.5, 3.0]
    assert run.metadata["original"]["header_line"] == len(above) + 1
    assert warnings == ()


def test_headers_that_are_numbers_are_headers_if_that_is_said(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [["a", "b", "c", "d"], [1, 2, 3], *ROWS]})
    columns = (f'[columns.{n}]\nheader = "{i}"\nunit = "{u}"' for n, i, u in NUMBERED)
    run, _ = read(path, mapping=mapping(path, "[file]", "header_line = 2", *columns))
    assert run.series("force").value.tolist() == [2.0, 3.0, 4.0]


NUMBERED = [("time", 1, "s"), ("stroke", 2, "mm"), ("force", 3, "kN")]


def test_the_first_row_is_row_1_where_there_are_no_headers(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": ROWS})
    assert "sheet “Data”, row 1: no column is named “stroke”" in refused(
        path, mapping=mapping(path, "[file]", "header_line = 0")
    )


def segments(run: Run) -> list[int]:
    return [segment.first_row for segment in run.streams["record"].segments]


def test_a_blank_row_interrupts_a_record_without_time(tmp_path: Path) -> None:
    """A sample is missing there: what follows was not one interval later."""
    rows: list[list[Any]] = [HEAD[1:], [1, 2], [2, 3], [], [" ", None], [3, 4], [4, 5], [], []]
    run, warnings = read(book(tmp_path, {"Data": rows}), sample_rate_hz=10.0)
    assert run.series("force").value.tolist() == [2.0, 3.0, 4.0, 5.0]
    assert segments(run) == [0, 2]
    assert warnings[0] == "2 blank row(s) inside the data, the first in row 4"
    assert warnings[1].startswith("1 interruption(s) of unknown length")


def test_a_blank_row_of_a_record_with_time_is_reported(tmp_path: Path) -> None:
    run, warnings = read(book(tmp_path, {"Data": [HEAD, [], ROWS[0], [], *ROWS[1:]]}))
    assert run.series("force").time_s.tolist() == [0.0, 1.0, 2.0]
    assert segments(run) == [0]
    assert warnings == ("1 blank row(s) inside the data, the first in row 4",)


def test_a_row_that_is_left_out_interrupts_a_record_without_time(tmp_path: Path) -> None:
    rows: list[list[Any]] = [HEAD[1:], [1, 2], ["operator stopped"], [3, 4], ["OVER", 5]]
    run, warnings = read(book(tmp_path, {"Data": rows}), sample_rate_hz=10.0, salvage=True)
    assert np.array_equal(run.series("stroke").value, [1.0, 3.0, np.nan], equal_nan=True)
    assert run.series("force").value.tolist() == [2.0, 4.0, 5.0]
    assert segments(run) == [0, 1]
    assert "1 row(s) could not be read and were left out, the first in row 3" in warnings


@pytest.mark.parametrize("between", [[], [[]]])
def test_rows_above_a_repeated_header_row_are_of_its_block(tmp_path: Path, between: list[list[Any]]) -> None:
    head, units = ["time", "stroke", "force"], ["s", "mm", "kN"]
    block = [*between, ["Test rig 3"], ["Cycle", 2], *between, head, units, *between]
    path = book(tmp_path, {"Data": [["Cycle", 1], head, units, *ROWS, *block, [3, 4, 5], [4, 5, 6]]})
    run, warnings = read(path)
    assert run.series("stroke").value.tolist() == [1.0, 2.5, 3.0, 4.0, 5.0]
    place = 7 + len(between)
    assert warnings == (
        f"1 header row(s) inside the data, the first in row {place + 2 + len(between)}",
        f"2 row(s) of text above a header row inside the data, left out with it, the first in row {place}",
    )


def test_rows_with_numbers_above_a_repeated_header_row_are_no_part_of_its_block(tmp_path: Path) -> None:
    """Neither a sample that lacks a value, nor one with a bad cell, is lost with the header row below it."""
    path = book(tmp_path, {"Data": [HEAD, *ROWS, [3, None, 5], HEAD, [4, 5, 6]]})
    assert read(path)[0].series("force").value.tolist() == [2.0, 3.0, 4.0, 5.0, 6.0]
    for row in ([3, "OVER", 5], ["#DIV/0!", 4, None]):
        other = tmp_path / str(row[0]).strip("#!").replace("/", "")
        other.mkdir()
        message = refused(book(other, {"Data": [HEAD, *ROWS, row, HEAD, [4, 5, 6]]}))
        assert "row 5, column" in message
        assert "is no number" in message


def test_a_date_that_is_a_text_begins_a_sample(tmp_path: Path) -> None:
    head = ["time", *HEAD[1:]]
    rows: list[list[Any]] = [[f"2026-03-05T14:00:0{i}Z", i, None if i == 1 else 2.0] for i in range(4)]
    path = book(tmp_path, {"Data": [head, *rows[:2], head, *rows[2:]]})
    run, _ = read(path, unit={"time": "date-time"})
    assert np.array_equal(run.series("force").value, [2.0, np.nan, 2.0, 2.0], equal_nan=True)


def test_a_key_and_its_number_without_a_header_row_below_are_refused(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, *ROWS, ["Cycle", 2], [3, 4, 5]]})
    assert "row 5, column 1 “time [s]”: “Cycle” is no number" in refused(path)


def test_a_row_without_values_of_the_columns_used_keeps_its_place(tmp_path: Path) -> None:
    rows: list[list[Any]] = [[*HEAD[1:], "n"], [1, 2, 0], [None, None, 1], [3, 4, 2]]
    run, warnings = read(book(tmp_path, {"Data": rows}), sample_rate_hz=10.0)
    assert np.array_equal(run.series("force").value, [2.0, np.nan, 4.0], equal_nan=True)
    assert segments(run) == [0]
    assert "force: 1 empty or NaN cell(s), the first in row 3" in warnings


def test_remarks_inside_a_sheet_are_reported(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, *ROWS, ["# operator stopped"], [3, 4, 5]]})
    run, warnings = read(path)
    assert run.series("force").value.tolist() == [2.0, 3.0, 4.0, 5.0]
    assert warnings == ("1 remark(s) (#) inside the data, the first in row 5",)


# --- formulas -----------------------------------------------------------------------------------------


def test_a_formula_that_gave_an_empty_text_is_no_value(tmp_path: Path) -> None:
    """As ``=IF(…,"")`` is stored, by Excel and by LibreOffice."""
    path = book(tmp_path, {"Data": [HEAD, [0, 1, 2], [1, "=777", 3], [2, 3, 4]]})
    stored = '<c r="B3"><f>777</f><v></v></c>'
    rewritten(path, stored, '<c r="B3" t="str"><f>IF(C3&gt;9,C3,"")</f><v></v></c>')
    run, warnings = read(path)
    assert np.array_equal(run.series("stroke").value, [1.0, np.nan, 3.0], equal_nan=True)
    assert warnings == ("stroke_1: 1 empty or NaN cell(s), the first in row 3",)


@pytest.mark.parametrize("row", [["=A2", "=B2", "=C2"], [1, ArrayFormula("B3", "=B2*2"), 3]])
def test_formulas_without_values_are_found_in_rows_that_look_blank_and_in_arrays(
    tmp_path: Path, row: list[Any]
) -> None:
    path = book(tmp_path, {"Data": [HEAD, [0, 1, 2], row, [2, 3, 4]]})
    assert "3: a formula whose value is not stored" in refused(path)


# --- numbers, missing values, thousands ---------------------------------------------------------------


@pytest.mark.parametrize(
    "cells", [["950", "1,234", "1,300"], [950, "1,234", "-12,300"], ["950", "1.234", "1.300"]]
)
def test_a_sign_that_may_separate_thousands_is_refused(tmp_path: Path, cells: list[Any]) -> None:
    path = book(tmp_path, {"Data": [HEAD, *([i, cell, 2] for i, cell in enumerate(cells))]})
    message = refused(path)
    assert f"row 3, column 2 “stroke [mm]”: “{cells[1]}” may be 1234, with “{cells[1][1]}” between" in message
    assert "state “decimal” in a mapping file, or export without thousands separators" in message
    assert "may be 1234" in refused(path, salvage=True)
    stated = mapping(path, "[file]", f'decimal = "{cells[1][1]}"')
    assert read(path, mapping=stated)[0].series("stroke").value[1] == 1.234


@pytest.mark.parametrize(
    ("cells", "values"),
    [
        (["1,234", "12,345", "1,300"], [1.234, 12.345, 1.3]),  # every number has the sign
        (["950", "0,998", "1,300"], [950.0, 0.998, 1.3]),  # no thousands begin with 0
        (["950", "1,234", "1,5"], [950.0, 1.234, 1.5]),  # nor have one digit
        ([950, "1234,567", 2.5], [950.0, 1234.567, 2.5]),
    ],
)
def test_a_sign_that_cannot_separate_thousands_is_a_decimal_sign(
    tmp_path: Path, cells: list[Any], values: list[float]
) -> None:
    path = book(tmp_path, {"Data": [HEAD, *([i, cell, 2] for i, cell in enumerate(cells))]})
    run, _ = read(path)
    assert run.series("stroke").value.tolist() == values
    assert run.metadata["original"]["decimal"] == ","


def test_a_stated_number_means_no_value_however_it_is_written(tmp_path: Path) -> None:
    cells = [1.5, -9999, -9999.0, "-9999", "-9999.00", "n/a", -999.9]
    path = book(tmp_path, {"Data": [HEAD, *([i, cell, 2] for i, cell in enumerate(cells))]})
    run, warnings = read(path, mapping=mapping(path, "[file]", 'missing = ["-9999", "n/a"]'))
    expected = [1.5, *[np.nan] * 5, -999.9]
    assert np.array_equal(run.series("stroke").value, expected, equal_nan=True)
    assert "stroke_1: 5 empty or NaN cell(s), the first in row 3" in warnings


def test_an_integer_too_long_for_a_number_is_infinite(tmp_path: Path) -> None:
    path = book(tmp_path, {"Data": [HEAD, [0, 1, 2], [1, 777, 3]]})
    rewritten(path, "<v>777</v>", f"<v>{'9' * 400}</v>")
    (numbers,) = ExcelRecord(path, ReadingOptions()).read([1, 2])
    assert numbers.columns[1].tolist() == [1.0, np.inf]


# --- dates and times ----------------------------------------------------------------------------------


def clocked(tmp_path: Path, cells: list[Any], number_format: str, epoch: datetime) -> Path:
    """Write a record with its time in cells of a number format; the workbook counts days from an epoch."""
    path = tmp_path / "record.xlsx"
    workbook = Workbook()
    workbook.epoch = epoch
    sheet = workbook.active
    sheet.append(["time", *HEAD[1:]])
    for row, cell in enumerate(cells, start=2):
        sheet.append([cell, row, 2 * row])
        sheet.cell(row, 1).number_format = number_format
    workbook.save(path)
    return path


@pytest.mark.parametrize("epoch", [CALENDAR_WINDOWS_1900, CALENDAR_MAC_1904])
@pytest.mark.parametrize("number_format", ["hh:mm:ss.000", "[h]:mm:ss.000"])
@pytest.mark.parametrize("first_s", [50_000.0, 86_398.0, 2 * 86_400.0 - 2.0])
def test_times_of_day_run_on_over_midnight(
    tmp_path: Path, epoch: datetime, number_format: str, first_s: float
) -> None:
    cells = [(first_s + i / 2.0) / 86_400.0 for i in range(10)]
    run, warnings = read(clocked(tmp_path, cells, number_format, epoch))
    assert run.series("force").time_s == pytest.approx(np.arange(10) / 2.0, abs=1e-9)
    assert run.metadata["run"]["started_utc"] is None
    assert warnings == ()


@pytest.mark.parametrize("epoch", [CALENDAR_WINDOWS_1900, CALENDAR_MAC_1904])
def test_dates_are_those_of_the_workbooks_own_numbering(tmp_path: Path, epoch: datetime) -> None:
    start = datetime(2026, 3, 5, 23, 59, 59)  # noqa: DTZ001 - Excel knows no zones
    cells = [start + timedelta(milliseconds=500 * i) for i in range(4)]
    run, _ = read(clocked(tmp_path, cells, "yyyy-mm-dd hh:mm:ss.000", epoch))
    assert run.series("force").time_s == pytest.approx([0.0, 0.5, 1.0, 1.5], abs=1e-9)
    assert run.metadata["run"]["started_utc"] == "2026-03-05T23:59:59+00:00"


def test_times_of_day_with_cells_that_mean_no_value(tmp_path: Path) -> None:
    path = clocked(tmp_path, [0.5, "n/a", -9999, 0.5 + 3.0 / 86_400.0], "hh:mm:ss", CALENDAR_WINDOWS_1900)
    sheet = load_workbook(path)
    for row in (3, 4):
        sheet.active.cell(row, 1).number_format = "General"
    sheet.save(path)
    run, _ = read(path, mapping=mapping(path, "[file]", 'missing = ["n/a", "-9999"]'))
    assert np.array_equal(run.streams["record"].time_s, [0.0, np.nan, np.nan, 3.0], equal_nan=True)


@pytest.mark.parametrize(
    ("cell", "number_format"),
    [(400_000, "yyyy-mm-dd"), (900_000_000, "[h]:mm:ss")],
    ids=["year 2995", "hours"],
)
def test_a_date_out_of_range_is_refused_and_not_wrapped(
    tmp_path: Path, cell: float, number_format: str
) -> None:
    path = clocked(tmp_path, [46_000, cell], number_format, CALENDAR_WINDOWS_1900)
    assert "row 3, column 1 “time”: “" in refused(path)


def test_what_openpyxl_says_of_a_workbook_is_kept_from_the_user(tmp_path: Path) -> None:
    """As of one with a validation list, which Excel keeps as an extension: no matter of numbers."""
    path = book(tmp_path, {"Data": [HEAD, *ROWS]})
    extension = '<ext uri="{CCE6A557-97BC-4b89-ADB6-D9C93CAAB3DF}"></ext>'
    rewritten(path, "</worksheet>", f"<extLst>{extension}</extLst></worksheet>")
    run, warnings = read(path)  # a warning would be an error here
    assert run.series("stroke").value.tolist() == [1.0, 2.5, 3.0]
    assert warnings == ()
