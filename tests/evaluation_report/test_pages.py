"""The printed page: how many, nothing torn apart, nothing said twice."""

from __future__ import annotations

import dataclasses
import io
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pypdfium2
import pytest
from pypdfium2.raw import FPDFText_GetFontWeight

from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Content, Picture
from bufferstand.evaluation.report.content.numbers import UNBROKEN
from bufferstand.evaluation.report.rendering.html import kept
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import Given, read_source
from tests.evaluation_report.campaigns import settling, write_eventful_campaign
from tests.evaluation_report.test_content import FILLED
from tests.house.test_recipes import RUNS

MOST_PAGES = {"static": 4, "harmonic": 4, "campaign": 8}
"""Pages before the annex."""
MOST_EMPTY = 0.33
"""Share of a page below what it shows; the last one ends where it ends."""
HEAD_OF_PAGE = re.compile(r"^Report BR-|^Page \d+ of \d+|DRAFT$|^\s*$")
LEAST_CLAUSE = 40
"""Letters that state something by themselves."""
PATHS = {
    "static": RUNS / "001-static-5mm_s.h5",
    "harmonic": RUNS / "005-harmonic-20mm-20mm-1.27Hz.h5",
    "campaign": RUNS,
}


@dataclasses.dataclass(frozen=True)
class Printed:
    name: str
    content: Content
    pdf: bytes

    def texts(self) -> list[str]:
        return [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(io.BytesIO(self.pdf))]

    def body(self) -> list[str]:
        """Return the pages before the annex; that on which it begins counts where something stands above."""
        texts, annex = self.texts(), re.compile(r"^Annex\r?$", re.MULTILINE)
        number, begin = next(
            (n, found.start()) for n, text in enumerate(texts) if (found := annex.search(text))
        )
        above = [line for line in texts[number][:begin].splitlines() if not HEAD_OF_PAGE.search(line)]
        return texts[: number + bool(above)]

    def empty(self) -> list[float]:
        """Return which share of each page is empty below what it shows."""
        shares = []
        for page in pypdfium2.PdfDocument(io.BytesIO(self.pdf)):
            grey = np.asarray(page.render(scale=0.5).to_pil().convert("L"))
            top, bottom = (round(grey.shape[0] * at / 297.0) for at in (24.0, 297.0 - 20.0))
            inked = np.flatnonzero((grey[top:bottom] < 200).any(axis=1))
            shares.append(1.0 - (inked.max() + 1) / (bottom - top))
        return shares


def made(name: str, fields: ReportFields | None = None, path: Path | None = None) -> Printed:
    given = Given(options=Options(draws=200), fields=fields)
    content = build_content(read_source(path or PATHS[name], None, given))
    return Printed(name, content, render_pdf(content, [draw(one.plot) for one in content.pictures()]))


@pytest.fixture(scope="module")
def filled() -> Printed:
    """The campaign as a laboratory hands it in."""
    return made("campaign", FILLED)


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Printed:
    """A campaign with a harmonic run whose force drifts, and takes the extremes with it."""
    folder = tmp_path_factory.mktemp("drifting")
    time, stroke, force = settling()
    run = ("drifting", "harmonic", (time, stroke, force + 20.0 * time / time[-1]), {})
    return made("harmonic", path=write_eventful_campaign(folder, (run,)))


def test_a_drifting_force_is_found(drifting: Printed) -> None:
    assert any("force drifts by" in text for text in prose(drifting.content.document()))


@pytest.fixture(scope="module", params=[*PATHS, "filled", "drifting"])
def printed(request: pytest.FixtureRequest) -> Printed:
    if request.param in PATHS:
        return made(request.param)
    return request.getfixturevalue(request.param)  # type: ignore[no-any-return]


def test_no_more_pages_than_someone_reads(printed: Printed) -> None:
    assert len(printed.body()) <= MOST_PAGES[printed.name]


def test_no_page_is_half_empty(printed: Printed) -> None:
    assert max(printed.empty()[:-1]) < MOST_EMPTY


def test_the_certificate_is_the_first_page_with_its_signatures(printed: Printed) -> None:
    first, second, *_ = printed.texts()
    for words in ("Key values", "Figure 1.", "Tested by", "Checked by", "Authorised by", "items tested."):
        assert words in first
        assert words not in second


def test_the_temperatures_of_a_single_run_stand_in_the_annex(printed: Printed) -> None:
    places = {
        section.annex
        for section in printed.content.sections
        for block in section.blocks
        if isinstance(block, Picture) and block.caption.startswith("Temperatures")
    }
    assert places == {printed.name != "campaign"}


def broken(pdf: bytes) -> Iterator[str]:
    """Yield what a line is broken in: its end lies lower than its start, and further to the left.

    The last word of a column's heading and the number that begins the row below it are of two weights.
    """
    pattern = re.compile(UNBROKEN.replace(" ", r"[ \r\n]+"))
    for page in pypdfium2.PdfDocument(io.BytesIO(pdf)):
        text = page.get_textpage()
        for found in pattern.finditer(text.get_text_range()):
            if "\n" not in found[0]:
                continue
            left, bottom, _, top = text.get_charbox(found.start())
            right_of_end, end_bottom, _, _ = text.get_charbox(found.end() - 1)
            if len({FPDFText_GetFontWeight(text, at) for at in (found.start(), found.end() - 1)}) > 1:
                continue
            if bottom - end_bottom > 0.5 * (top - bottom) and right_of_end < left:
                yield found[0]


def test_no_number_is_broken_over_a_line(printed: Printed) -> None:
    assert list(broken(printed.pdf)) == []


def test_a_broken_number_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bufferstand.evaluation.report.rendering.pdf.UNBROKEN", "never this")
    content = build_content(read_source(PATHS["campaign"], None, Given(options=Options(draws=200))))
    pdf = render_pdf(content, [draw(one.plot) for one in content.pictures()])
    assert list(broken(pdf))


def test_no_heading_stands_alone_at_the_end_of_a_page(printed: Printed) -> None:
    titles = {block.title for s in printed.content.sections for block in s.blocks if hasattr(block, "title")}
    titles |= {section.title for section in printed.content.sections} | {"Annex"}
    for text in printed.texts():
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        said = [line for line in lines if line != printed.content.subtitle]  # at the foot of each page
        assert said[-1] not in titles


def prose(value: Any, key: str = "") -> Iterator[str]:
    """Yield every sentence of a report: texts, notices, notes, reasons; not the cells of tables.

    ``missing`` is what ``lacks`` has, without its places: only this is printed.
    """
    if isinstance(value, dict):
        for name, inner in value.items():
            if name not in {"rows", "numbers", "footnotes", "columns", "facts", "missing"}:
                yield from prose(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from prose(inner, key)
    elif key in {"items", "notices", "where", "sentence", "points", "note", "caption"} and value:
        yield value


def clauses(text: str) -> Iterator[str]:
    """Yield what a text states, without whose it is: a reason may stand behind several names."""
    for clause in re.split(r"[:;] |\. | \(", text):
        if len(clause) >= LEAST_CLAUSE:
            yield clause.rstrip(".)")


FACTS = (
    *("Studentská 95, Pardubice", "Poprad", "EN 15551:2022, procedure P-7 rev. 3", "2026-02-20"),
    "2026-03-09",
    *("P. Vágner", "A. Kohout", "Date of assembly", "The room was at 27 °C."),
    *("nothing in this report was measured on a specimen", "relate only to the items tested"),
    *("serial number corrected", "Serial number 0815 instead of 0816."),
    *("the stroke ended at 94.22 mm", "has reached the stop threshold of 40 °C", "above the limit of 600 kN"),
    *("Simple acceptance", "coverage factor k = 2 (about 95 % coverage)", "category A, elastomer"),
    *("Temperature stop", "Stroke limit", "End of report"),
)
"""What a report says once. Identities (report, specimen, runs) are named wherever they are needed."""


def test_no_fact_is_said_twice(printed: Printed) -> None:
    told = set(prose(printed.content.document()))
    assert len(told) == len(list(prose(printed.content.document())))
    captions = {picture.caption for picture in printed.content.pictures()}
    said = Counter(clause for text in told - captions for clause in clauses(text))
    assert {text: count for text, count in said.items() if count > 1} == {}
    names = Counter(
        name
        for sheet in (printed.content.head, *(b for s in printed.content.sections for b in s.blocks))
        for name, _ in getattr(sheet, "facts", ())
        if name != "SHA-256"
    )
    assert [name for name, count in names.items() if count > 1] == []


def test_the_facts_of_the_list_are_said_once(filled: Printed) -> None:
    whole = re.sub(r"\s+", " ", " ".join(filled.texts()))
    assert {fact: whole.count(fact) for fact in FACTS} == dict.fromkeys(FACTS, 1)


@pytest.mark.parametrize(
    ("text", "together"),
    [
        ("up to 80 mm/s and 12 kN/mm", ["80 mm/s", "12 kN/mm"]),
        ("0.4527 ± 0.0024 of it", ["0.4527 ± 0.0024"]),
        ("10 … 50 kN in run 3 by EN 15551", ["10 … 50 kN", "run 3", "EN 15551"]),
        ("at −0.5 % <b>", ["−0.5 %"]),
        ("7 months", []),
    ],
)
def test_what_is_kept_together(text: str, together: list[str]) -> None:
    assert re.findall(r'<span class="kept">(.*?)</span>', str(kept(text))) == together
    assert "<b>" not in kept(text)
