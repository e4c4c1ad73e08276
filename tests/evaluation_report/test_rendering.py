"""The HTML and the PDF: nothing from outside, nothing executed, nothing lost."""

from __future__ import annotations

import base64
import copy
import dataclasses
import re
from html.parser import HTMLParser
from typing import Any

import pypdfium2
import pytest

from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_content import FILLED, strings

SCRIPT = "<script>alert('x')</script>\"'&#[$x$] @ref \\ {{ 7*7 }} *b* _i_ <b>"
_VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Collects tags, attributes and text, and checks that every element is closed in its turn."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def squeezed(text: str) -> str:
    return re.sub(r"[\s\u200b\u00ad]+", "", text)


def pages(pdf: bytes) -> list[str]:
    document = pypdfium2.PdfDocument(pdf)
    try:
        return [page.get_textpage().get_text_range() for page in document]
    finally:
        document.close()


def hostile(report: Made) -> Content:
    """Return the content with markup of both languages in the names that users choose."""
    metadata: dict[str, Any] = copy.deepcopy(dict(report.source.runs[0].metadata))
    metadata["specimen"]["id"] = SCRIPT
    metadata["run"] |= {"operator": SCRIPT, "campaign": SCRIPT}
    first = dataclasses.replace(report.source.runs[0], metadata=metadata)
    runs = (dataclasses.replace(first, evaluated={**first.evaluated, "warnings": [SCRIPT]}),)
    return build_content(dataclasses.replace(report.source, runs=runs, document={}, name=SCRIPT))


def test_html_says_everything_that_the_content_says(report: Made) -> None:
    page = Page(report.html)
    text = squeezed(page.text)
    document = report.content.document()
    for value in strings({key: document[key] for key in ("title", "subtitle", "notices", "missing", "head")}):
        assert squeezed(value) in text or value in {"sheet", "text"}
    first_page = {"title": "", "blocks": document["certificate"]}
    for section in (first_page, *document["sections"]):
        assert squeezed(section["title"]) in text
        for block in section["blocks"]:
            table = block if block["kind"] == "table" else block.get("numbers", {})
            for cell in [cell for row in table.get("rows", []) for cell in row]:
                assert squeezed(cell["text"]) in text
            for item in [*block.get("items", []), *[n["why"] for n in table.get("footnotes", [])]]:
                assert squeezed(item) in text


def test_html_needs_nothing_from_outside_and_runs_nothing(report: Made) -> None:
    assert not re.search(r"https?:|//[a-z]|@import|url\(", report.html, flags=re.IGNORECASE)
    page = Page(report.html)
    assert not {tag for tag, _ in page.tags} & {"script", "iframe", "object", "embed", "link", "form"}
    for _, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith(("data:image/svg+xml;base64,", "#"))


def test_html_figures_are_images_with_alternative_text_and_their_numbers_unfold(report: Made) -> None:
    page = Page(report.html)
    images = [attributes for tag, attributes in page.tags if tag == "img"]
    assert [base64.b64decode(str(i["src"]).split(",")[1]).decode() for i in images] == list(report.figures)
    assert all(len(str(image["alt"])) > 40 for image in images)
    assert sum(tag == "details" for tag, _ in page.tags) == len(images) == 8


def test_svgs_inside_hold_no_script_and_ask_for_nothing(report: Made) -> None:
    for svg in report.figures:
        addresses = set(re.findall(r'"(https?://[^"]+)"', svg))
        assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}, (
            "names, not requests"
        )
        assert "<script" not in svg
        assert "<image" not in svg


def test_html_is_made_for_paper_and_for_small_screens(report: Made) -> None:
    assert "@media print" in report.html
    assert "max-width: 700px" in report.html
    assert '<meta name="viewport"' in report.html
    page = Page(report.html)
    tables = sum(tag == "table" for tag, _ in page.tags)
    boxes = sum(attributes.get("class") == "box" for _, attributes in page.tags)
    assert boxes == tables + 8, "each table and figure scrolls in a box of its own"


def test_html_is_small_and_ends_with_its_mark(report: Made) -> None:
    assert len(report.html) < 3_000_000
    assert Page(report.html).text.endswith(f"End of report {report.content.report_id}")


def test_a_script_in_a_name_stays_text(report: Made) -> None:
    content = hostile(report)
    html = render_html(content, ["<svg/>"] * len(content.pictures()))
    assert "<script>" not in html
    assert "{{ 7*7 }}" in html
    page = Page(html)
    assert "script" not in {tag for tag, _ in page.tags}
    assert squeezed(SCRIPT) in squeezed(page.text)


def test_markup_in_a_name_stays_text_in_the_pdf(report: Made) -> None:
    content = hostile(report)
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'
    text = squeezed("".join(pages(render_pdf(content, [svg] * len(content.pictures())))))
    assert squeezed(SCRIPT) in text


def test_pdf_has_the_report_id_and_its_place_on_every_page(report: Made) -> None:
    texts = pages(report.pdf)
    assert len(texts) >= 5
    for number, text in enumerate(texts, start=1):
        assert f"Page {number} of {len(texts)}" in text
        assert report.content.report_id in text
    assert f"End of report {report.content.report_id}" in texts[-1]


def test_pdf_says_what_the_html_says(report: Made) -> None:
    text = squeezed("".join(pages(report.pdf)))
    for run in report.source.runs:
        assert run.id in text
        assert run.sha256 in text
    assert squeezed("Nothing failed; 12 of 18 requirements are met") in text
    assert "DRAFT" in text
    for picture in report.content.pictures():
        assert squeezed(f"Figure {picture.number}. {picture.caption[:40]}") in text
    assert squeezed("Figure 1: Force at round strokes") not in text
    detailed = squeezed("".join(pages(render_pdf(report.detailed, report.figures))))
    for picture in report.detailed.pictures():
        assert squeezed(f"Figure {picture.number}: {picture.numbers.title}") in detailed


def test_pdf_dates_from_the_end_of_the_last_run(report: Made) -> None:
    ended = report.source.runs[-1].ended
    assert ended is not None
    document = pypdfium2.PdfDocument(report.pdf)
    made = document.get_metadata_value("CreationDate")
    document.close()
    assert made.startswith(f"D:{ended:%Y%m%d%H%M%S}")


def test_a_report_that_lacks_nothing_is_no_draft(report: Made) -> None:
    content = build_content(dataclasses.replace(report.source, fields=FILLED))
    assert "DRAFT" not in render_html(content, report.figures)
    texts = pages(render_pdf(content, report.figures))
    assert not any("DRAFT" in text for text in texts)
    assert any("Authorised by: P. Vágner" in text for text in texts)


def test_a_warning_of_the_typesetter_is_a_failure(report: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "bufferstand.evaluation.report.rendering.pdf._OPTIONS",
        {"ignore_system_fonts": True, "font_paths": []},
    )
    with pytest.raises(RuntimeError, match="typst warned: unknown font family: dejavu sans"):
        render_pdf(report.content, report.figures)


def test_a_letter_that_the_font_lacks_is_refused_by_the_pdf_and_kept_by_the_html(report: Made) -> None:
    content = dataclasses.replace(report.content, subtitle="buffer 缓")
    with pytest.raises(BadInput, match=r"has no “缓” \(U\+7F13\); write the HTML report only"):
        render_pdf(content, report.figures)
    assert "buffer 缓" in render_html(content, report.figures)
