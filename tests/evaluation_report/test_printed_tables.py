"""Tables on paper: nothing runs into the next column; what explains a table, or leads to it, is beside it."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest

from bufferstand.evaluation.figures.differences import ChangeSeries, changes_plot
from bufferstand.evaluation.figures.paint import _figure
from bufferstand.evaluation.report.content.content import Cell, Column, Content, Section, Sheet, Table, Texts
from bufferstand.evaluation.report.rendering.html import kept
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.sections.comparison import _temperature_cell
from bufferstand.evaluation.report.source.own_text import read_own_text
from bufferstand.evaluation.wording import ENGLISH
from tests.evaluation_report.conftest import Made

RUN_ID = "003-harmonic-20mm-20mm-0.318Hz"
REASON = "one line for several inputs"


def only(content: Content, *sections: Section) -> Content:
    """Return a report of nothing but these sections."""
    return replace(content, certificate=(), sections=sections)


def texts_of(pdf: bytes) -> list[str]:
    return [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(io.BytesIO(pdf))]


def boxes(pdf: bytes, words: str) -> Iterator[tuple[float, float, float, float]]:
    """Yield left, bottom, right and top [pt] of each letter of some words."""
    for page in pypdfium2.PdfDocument(io.BytesIO(pdf)):
        text = page.get_textpage()
        letters = [(n, c) for n, c in enumerate(text.get_text_range()) if not c.isspace()]
        start = "".join(c for _, c in letters).find(words)
        if start >= 0:
            yield from (text.get_charbox(n) for n, _ in letters[start : start + len(words)])


def long_table(rows: int, note: str = "", why: str = "") -> Table:
    """Return a table of so many rows, whose last cell has a reason."""
    cells = [(Cell(f"row {n}"), Cell("1", "number")) for n in range(1, rows)]
    last = (Cell(f"row {rows}"), Cell("—", "missing", why) if why else Cell("1", "number"))
    return Table("A table", (Column("Name"), Column("Number")), (*cells, last), note=note)


@pytest.mark.parametrize("others", [3, 4])
def test_a_long_name_stays_in_its_column(report: Made, others: int) -> None:
    words = "constant amplitude of twenty millimetres at forty millimetres per second"
    row = (Cell("1", "number"), Cell(RUN_ID, "code"), *(Cell(words) for _ in range(others)))
    names = ("Step", "Reason", "Event", "Note")[:others]
    columns = (Column("Run"), Column("Run id"), *(Column(name) for name in names))
    table = Table("Runs", columns, (row,))
    pdf = render_pdf(only(report.content, Section("a", "Runs", (table,))), [])
    next_column = min(left for left, *_ in boxes(pdf, "Step"))
    found = list(boxes(pdf, RUN_ID))
    assert len(found) == len(RUN_ID), "its text is copied whole, without a letter in between"
    assert max(right for _, _, right, _ in found) < next_column
    lines = [0] + [n for n in range(1, len(found)) if found[n][1] < found[n - 1][1] - 4.0]
    assert len(lines) > 1
    pieces = [RUN_ID[begin:end] for begin, end in zip(lines, [*lines[1:], None], strict=True)]
    assert all(piece.startswith("-") for piece in pieces[1:]), f"a number is not torn apart: {pieces}"


@pytest.mark.parametrize("before", range(30, 40, 2))
def test_neither_first_nor_last_of_several_sentences_or_facts_stands_alone(report: Made, before: int) -> None:
    sentences = tuple(f"Sentence {n} of five." for n in range(1, 6))
    facts = tuple((f"Name {n}", Cell(f"fact {n}")) for n in range(1, 6))
    first = Section("a", "First", (long_table(before),))
    for words, block in (
        ("Sentence {} of five.", Texts(sentences)),
        ("Sentence {} of five.", Texts(sentences, listed=True)),
        ("fact {}", Sheet("Facts", facts)),
    ):
        pages = texts_of(render_pdf(only(report.content, first, Section("b", "Second", (block,))), []))
        on = [next(n for n, page in enumerate(pages) if words.format(k) in page) for k in range(1, 6)]
        assert on[0] == on[1]
        assert on[3] == on[4]


@pytest.mark.parametrize("rows", range(42, 45))
def test_what_explains_a_long_table_is_on_the_page_of_its_last_rows(report: Made, rows: int) -> None:
    table = long_table(rows, "A note of its own.", REASON)
    pages = texts_of(render_pdf(only(report.content, Section("a", "First", (table,))), []))
    (last,) = (page for page in pages if f"row {rows}" in page)
    assert f"row {rows - 2}\r" in last or f"row {rows - 2}\n" in last or f"row {rows - 2} " in last
    assert "A note of its own." in last
    assert REASON in last


@pytest.mark.parametrize("before", range(34, 38))
def test_the_paragraph_that_leads_to_a_table_is_on_its_page(report: Made, before: int) -> None:
    first = Section("a", "First", (long_table(before),))
    led = Section("b", "Second", (Texts(("These words lead to it.",)), long_table(5, why=REASON)))
    pages = texts_of(render_pdf(only(report.content, first, led), []))
    (page,) = (text for text in pages if "These words lead to it." in text)
    assert REASON in page


def test_a_heading_stands_over_its_numbers_though_a_cell_is_empty(report: Made) -> None:
    rows = ((Cell("0.5", "number"),), (Cell(""),), (Cell("—", "missing", REASON),))
    section = Section("a", "First", (Table("T", (Column("u"),), rows),))
    (said,) = only(report.content, section).document()["sections"]
    assert said["blocks"][0]["columns"][0]["numeric"] is True


@pytest.mark.parametrize(
    ("text", "together"),
    [
        ("no record of F2 (≥ 500 kN) or F6 (≥ 0.5)", ["≥ 500 kN", "≥ 0.5"]),
        ("uncertainties U = k u with k = 2 and w = 0", ["U = k u", "k = 2", "w = 0"]),
        ("Zero counted from contact ± U", ["± U"]),
        ("of step 2, −3.0 % (E_n −50.7)", ["−3.0 %", "E<sub>n</sub> −50.7"]),
    ],
)
def test_a_sign_stays_with_what_it_is_of(text: str, together: list[str]) -> None:
    assert re.findall(r'<span class="kept">(.*?)</span>', str(kept(text))) == together


def lasting(report: Made, rows: int) -> list[str]:
    """Return the pages of a report that ends with a sheet and a sentence."""
    first = Section("a", "First", (long_table(rows),), annex=True)
    sheet = Sheet("Validation", (("Recorded with", Cell("bufferstand")), ("Evaluated with", Cell("it"))))
    last = Section("b", "Validation", (sheet, Texts(("The last sentence.",))), annex=True)
    return texts_of(render_pdf(only(report.content, first, last), []))


def test_the_last_page_holds_more_than_a_sentence(report: Made) -> None:
    lengths = set()
    for rows in range(28, 44, 2):
        *_, last = pages = lasting(report, rows)
        lengths.add(len(pages))
        assert "Recorded with" in last
        assert "The last sentence." in last
        assert "End of report" in last
    assert len(lengths) > 1, "none of them came to the end of a page"


def test_a_step_that_was_not_run_is_not_said_to_lack_a_temperature() -> None:
    assert _temperature_cell(None).why == "this step was not run on it"


def test_the_number_of_a_report_is_not_broken_below_a_long_subject(report: Made) -> None:
    subject = "A: A-105-E-01 (series-1) · B: A-105-E-02 (series-2) · C: A-105-E-03 (series-3)"
    section = Section("a", "First", (Texts(("Words.",)),))
    content = only(replace(report.content, subtitle=subject), section)
    page, *_ = texts_of(render_pdf(content, []))
    assert page.count(f"Report {content.report_id}") == 2, "in the head, and below the title"


def test_steps_have_whole_numbers_at_their_axis() -> None:
    one = ChangeSeries("W", np.array([1.0, 2.0]), np.array([1.0, 2.0]), np.array([0.1, 0.1]))
    axes = _figure(changes_plot([one], 3), ENGLISH).axes[0]
    assert all(float(tick).is_integer() for tick in axes.get_xticks())


LONG = "Grundstücksverkehrsgenehmigungszuständigkeitsübertragungsverordnung"


def lines_of(pdf: bytes, words: str) -> list[str]:
    """Return the lines that a word is set in."""
    found = list(boxes(pdf, words))
    starts = [n for n in range(len(found)) if n == 0 or found[n][1] < found[n - 1][1] - 4.0]
    return [words[begin:end] for begin, end in zip(starts, [*starts[1:], None], strict=True)]


def test_a_word_longer_than_its_column_is_broken_and_does_not_run_into_the_next(
    report: Made, tmp_path: Path
) -> None:
    file = tmp_path / "own"
    file.write_text(
        f"| A | B | C | D |\n|---|---|---|---|\n| {LONG} | b | {LONG[::-1]} | zuletzt |\n", "utf-8"
    )
    own = Section("own", "Own", (read_own_text(str(file)).prose,))
    row = (Cell(LONG), Cell("in between"), Cell("constant amplitude of twenty millimetres"), Cell("end"))
    row = (*row, Cell("another reason of so many words that it takes room"))
    table = Table("T", tuple(Column(name) for name in ("Name", "Between", "Step", "End", "Reason")), (row,))
    for section, beside in ((own, "zuletzt"), (Section("a", "First", (table,)), "in between")):
        pdf = render_pdf(only(report.content, section), [])
        assert len(lines_of(pdf, LONG)) > 1
        right = max(box[2] for box in boxes(pdf, LONG))
        left = min(box[0] for box in boxes(pdf, "".join(beside.split())))
        assert right < left


def test_a_last_page_of_a_few_lines_is_spared_where_the_report_can_be_set_closer(report: Made) -> None:
    """Some lengths of a report would leave two lines and the end mark on a page of their own."""
    counts = []
    for rows in (56, 60, 64, 68, 80):
        tables = (long_table(rows), *(long_table(6) for _ in range(5)))
        section = Section("a", "First", (*tables, Texts(("The last sentence.",))))
        content = only(report.content, section)
        pages = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, [])))
        last = np.asarray(pages[len(pages) - 1].render(scale=0.5).to_pil().convert("L"))
        inked = np.flatnonzero((last[: round(0.93 * last.shape[0])] < 200).any(axis=1)).max() / last.shape[0]
        counts.append((len(pages), inked))
    assert [count for count, _ in counts] == sorted(count for count, _ in counts)
    assert len({count for count, _ in counts}) > 1, "none of them came to the end of a page"
    assert min(inked for _, inked in counts) > 0.35, counts


def test_a_long_name_breaks_before_its_signs_and_only_where_it_must(report: Made) -> None:
    key = "proof.load.F1.permanent_deformation_max_mm"
    facts = (("Not filled in", Cell(f"no limit is set on these of them: {key}, {key[:-2]}kN, {key[:-2]}um")),)
    pdf = render_pdf(only(report.content, Section("a", "First", (Sheet("Facts", facts),))), [])
    for word in (key, f"{key[:-2]}kN", f"{key[:-2]}um"):
        assert all(line[0] in "p._" for line in lines_of(pdf, word)), lines_of(pdf, word)
    number = "A1234567890B-0.318Hz" * 3
    row = (Cell(number, "code"), *(Cell("constant amplitude of twenty millimetres or so") for _ in range(4)))
    table = Table("T", tuple(Column(name) for name in "abcde"), (row,))
    lines = lines_of(render_pdf(only(report.content, Section("a", "First", (table,))), []), number)
    assert len(lines) > 1
    assert not any(line.startswith(".") or line.endswith(".") for line in lines), lines
