"""Every place that docs/report-checklist.md names is looked up in an actual report, HTML and PDF."""

from __future__ import annotations

import dataclasses
import io
import re
from dataclasses import dataclass
from html import unescape
from pathlib import Path

import pypdfium2
import pytest

from bufferstand.evaluation.facts.budget import budget_entry
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.requirements.limit_set import shipped_limit_set
from tests.evaluation.signals import StaticTest
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_content import FILLED
from tests.evaluation_report.test_validated import validation_record

PAGE = Path(__file__).parents[2] / "docs" / "report-checklist.md"
COMPLETE = FILLED.model_copy(
    update={
        "specimen_condition": "new, undamaged",
        "sampling": "every 50th of the lot",
        "external_results": ("impact test by VUZ, report 17/2026",),
        "not_tested": ("F3: the side load was not applied.",),
        "decision_rule_set_by": "the customer",
        "opinions": ("The spring is that of the type test.",),
        "number": "P-2026-17",
    }
)


@dataclass(frozen=True)
class Place:
    """A row of the page."""

    chapter: str
    clause: str
    section: str
    words: tuple[str, ...]


def places() -> list[Place]:
    found, chapter = [], ""
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            chapter = line[3:].partition(":")[0]
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if len(cells) == 4 and cells[0] not in {"Clause", "---"}:
            found.append(Place(chapter, cells[0], cells[2], tuple(re.findall("`([^`]+)`", cells[3]))))
    return found


def complete(source: ReportSource) -> ReportSource:
    """Return the source as a laboratory would hand it in, with everything that may be asked for."""
    limits = shipped_limit_set()
    runs = []
    for run in source.runs:
        evaluated = dict(run.evaluated)
        if run.kind == "static":
            evaluated["limit_set"] = limits.identity()
            evaluated["budget"] = budget_entry(StaticTest().evaluate(draws=200).budget)
        runs.append(dataclasses.replace(run, evaluated=evaluated))
    return dataclasses.replace(
        source, fields=COMPLETE, runs=tuple(runs), limit_sets=(limits,), validation=validation_record()
    )


@dataclass(frozen=True)
class Whole:
    content: Content
    html: str
    pages: tuple[str, ...]


@pytest.fixture(scope="module")
def whole(report: Made) -> Whole:
    content = build_content(complete(report.source))
    figures = [draw(picture.plot) for picture in content.pictures()]
    document = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, figures)))
    pages = tuple(flat(page.get_textpage().get_text_bounded()) for page in document)
    return Whole(content, render_html(content, figures), pages)


def flat(text: str) -> str:
    return re.sub(r"\s+", " ", text.replace("\u00ad", "").replace("\u200b", "").replace("\ufffe", "-"))


def text_of(html: str) -> str:
    html = re.sub(r'<span class="kept">(.*?)</span>', r"\1", html)
    return flat(unescape(re.sub(r"<[^>]+>", " ", html)))


def html_sections(html: str) -> dict[str, str]:
    body = html[html.index("<main>") :]
    head, *rest = body.split("<section ")
    sections = {"Head": text_of(head)}
    for part in rest:
        title = re.search(r"<h2>(.*?)</h2>", part)
        assert title is not None
        sections[unescape(title[1])] = text_of(part.partition("</section>")[0])
    sections["End"] = text_of(body.rpartition("</section>")[2])
    return sections


def test_the_page_lists_every_item_of_the_three_clauses() -> None:
    clauses = {(place.chapter, place.clause) for place in places()}
    assert {("7.8.2.1", letter) for letter in "abcdefghijklmnop"} <= clauses
    assert {("7.8.3.1", letter) for letter in "abcde"} <= clauses
    assert {("7.8.6", f"7.8.6.{n}") for n in ("1", "2 a", "2 b", "2 c")} <= clauses
    assert all(place.words for place in places())


@pytest.mark.parametrize("place", places(), ids=lambda p: f"{p.chapter} {p.clause} {p.section}")
def test_each_place_holds_what_the_page_says(whole: Whole, place: Place) -> None:
    sections = html_sections(whole.html)
    if place.section == "every page":
        for page in whole.pages:
            assert all(flat(word) in page for word in place.words)
        return
    assert place.section in sections, f"no section “{place.section}”: {list(sections)}"
    for word in place.words:
        # Units stand in a line of their own in the HTML, without brackets.
        assert flat(word).strip("[]") in sections[place.section], word
    if place.section not in {"Head", "End"}:
        printed = " ".join(whole.pages)
        assert place.section in printed
        for word in place.words:
            assert squeezed(word) in squeezed(printed), word


def squeezed(text: str) -> str:
    """Return text without spaces: the PDF breaks lines and keeps values together with hard ones."""
    return re.sub(r"[\s\u00a0]+", "", flat(text))


def test_the_complete_report_is_no_draft_and_ends_once(whole: Whole) -> None:
    assert whole.content.missing == ()
    assert "DRAFT" not in whole.html
    end = f"End of report {whole.content.report_id}"
    assert sum(end in page for page in whole.pages) == 1
    assert end in whole.pages[-1]


def test_without_the_laboratory_s_file_it_is_a_draft_that_lists_the_places(report: Made) -> None:
    content = build_content(dataclasses.replace(complete(report.source), fields=ReportFields()))
    assert len(content.missing) >= 8
    facts = dict(content.head.facts)
    for name in ("Address", "Place of the test", "Test method", "Specimen received", "Report issued"):
        assert name not in facts, "it stands in the list of what is missing"
