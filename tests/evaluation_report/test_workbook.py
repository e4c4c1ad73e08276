"""The tables of a report as a workbook: every number as printed, as a number, with its unit."""

from __future__ import annotations

import io
from pathlib import Path

import openpyxl
import pytest

from bufferstand.evaluation.report.content.content import DASH, Cell, Column, Content, Section, Sheet, Table
from bufferstand.evaluation.report.rendering.workbook import render_workbook
from bufferstand.evaluation.report.writing import write_report
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import hand_made_document

ROWS = (
    (Cell("1", "number"), Cell("18160 ± 130", "number"), Cell("=1+1")),
    (Cell("2", "number"), Cell("−0.50", "number"), Cell("10 … 50", "number")),
    (Cell("3", "number"), Cell(DASH, "missing", "no cycle"), Cell("+0.020", "number")),
)
TABLE = Table("Energies [all]", (Column("Run"), Column("W ± U", "J"), Column("More")), ROWS, note="A note.")


def content(*tables: Table) -> Content:
    return Content("t", "s", (), (), Sheet("", ()), (Section("a", "A", tables),), "", "")


def test_values_are_numbers_with_their_decimals_and_u_has_its_column() -> None:
    book = openpyxl.load_workbook(io.BytesIO(render_workbook(content(TABLE))))
    assert book.sheetnames == ["1 Energies  all"]
    sheet = book.active
    assert [cell.value for cell in sheet[2]] == ["Run", "W [J]", "U of W [J]", "More"]
    assert [[cell.value for cell in row] for row in sheet.iter_rows(3, 5)] == [
        [1, 18160, 130, "=1+1"],
        [2, -0.5, None, "10 … 50"],
        [3, "no cycle", None, 0.02],
    ]
    assert [sheet.cell(*at).number_format for at in ((3, 2), (4, 2), (5, 4))] == ["0", "0.00", "0.000"]
    assert {cell.data_type for row in sheet.iter_rows() for cell in row} == {"s", "n"}
    assert "A note." in [row[0].value for row in sheet.iter_rows()]


def test_only_a_value_is_parted_from_its_u_and_never_a_label_or_a_span() -> None:
    rows = (
        (Cell("19.6 ± 19.6 mm"), Cell("0.31 ± 0.02", "number"), Cell("18.0 ± 0.2 ?", "open")),
        (Cell("50 ± 15 mm"), Cell("0.30 ± 0.01 … 0.33 ± 0.02", "number"), Cell("19.0 ± 0.2", "number")),
    )
    heads = (Column("Series"), Column("Value ± U", "–"), Column("Force ± U", "kN"))
    sheet = openpyxl.load_workbook(
        io.BytesIO(render_workbook(content(Table("A figure", heads, rows))))
    ).active
    assert [[cell.value for cell in row] for row in sheet.iter_rows(2, 4)] == [
        ["Series", "Value [–]", "U of Value [–]", "Force [kN]", "U of Force [kN]"],
        ["19.6 ± 19.6 mm", 0.31, 0.02, 18, "0.2 ?"],
        ["50 ± 15 mm", "0.30 ± 0.01 … 0.33 ± 0.02", None, 19, 0.2],
    ]


def test_a_power_of_ten_is_a_number() -> None:
    rows = ((Cell("−2.45 × 10⁻⁵", "number"),), (Cell("1.00 × 10⁻¹²", "number"),))
    book = openpyxl.load_workbook(io.BytesIO(render_workbook(content(Table("t", (Column("c"),), rows)))))
    values = [cell for row in book.worksheets[0].iter_rows() for cell in row if isinstance(cell.value, float)]
    assert [cell.value for cell in values] == [-2.45e-5, 1e-12]
    assert {cell.number_format for cell in values} == {"0.00E+00"}


def test_the_same_content_gives_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    first = render_workbook(content(TABLE))
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    assert render_workbook(content(TABLE)) == first
    assert b"2033" not in first


def test_every_table_of_the_report_is_in_it_by_cycle_too(report: Made, tmp_path: Path) -> None:
    path = tmp_path / "report.xlsx"
    written = write_report(
        report.folder, tmp_path, formats=("html",), document=hand_made_document(), table=path
    )
    assert written[-1] == path
    book = openpyxl.load_workbook(path)
    titles = [sheet.cell(1, 1).value for sheet in book]
    for words in ("Key values", "Results", "Cycles: energy, damping and stiffness", "Raw data"):
        assert words in titles
    pictures = report.detailed.pictures()
    assert [title for title in titles if title.startswith("Figure ")] == [
        f"Figure {picture.number}: {picture.numbers.title}" for picture in pictures
    ]
    printed = next(
        block
        for section in report.detailed.sections
        for block in section.blocks
        if isinstance(block, Table) and block.title == "Results"
    )
    sheet = book[book.sheetnames[titles.index("Results")]]
    heads = [cell.value for cell in sheet[2]]
    force = [column.title for column in printed.columns].index("Force max.")
    column = heads.index("Force max. [kN]") + 1
    shown = [f"{sheet.cell(row, column).value:.1f}" for row in range(3, 3 + len(printed.rows))]
    assert shown == [row[force].text for row in printed.rows]


def test_another_kind_of_table_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"the tables of a report are a workbook; name a \.xlsx file"):
        write_report(tmp_path / "nothing", tmp_path, table=tmp_path / "report.csv")
