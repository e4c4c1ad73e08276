"""The HTML report in a real browser: a phone, a desk, paper; nothing requested, nothing run."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pypdfium2
import pytest
from PIL import Image as Pixels

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Section
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.own_text import read_own_text
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_checklist import flat
from tests.monitor.browser import chromium

HOSTILE = (
    "<script>document.title='run'</script><img src=x onerror=\"document.title='run'\">"
    "</title></style><a href=\"javascript:document.title='run'\">KX</a>"
)
PHONE = {"width": 390, "height": 844}
DESK = {"width": 1280, "height": 900}
A4_TEXT_PX = 680
"""Width of the text on A4 with the margins of the print style, in CSS pixels (180 mm)."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as browser:
        yield browser


def hostile(source: ReportSource) -> ReportSource:
    """Return the source with a specimen, an operator and a reason that want to be markup."""
    runs = []
    for run in source.runs:
        metadata = {**run.metadata, "specimen": {**run.metadata["specimen"], "id": HOSTILE, "maker": HOSTILE}}
        metadata["run"] = {**metadata["run"], "operator": HOSTILE, "reason": HOSTILE}
        evaluated = {**run.evaluated, "warnings": [*run.warnings, HOSTILE]}
        runs.append(dataclasses.replace(run, metadata=metadata, evaluated=evaluated))
    return dataclasses.replace(source, runs=tuple(runs), name=HOSTILE)


@pytest.fixture(scope="module")
def page_file(report: Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    content = build_content(hostile(report.source))
    figures = [draw(picture.plot) for picture in content.pictures()]
    file = tmp_path_factory.mktemp("html") / "report.html"
    file.write_text(render_html(content, figures), encoding="utf-8")
    return file


@dataclasses.dataclass
class Opened:
    page: Any
    requested: list[str]
    complaints: list[str]


@pytest.fixture(scope="module")
def opened(browser: Any, page_file: Path) -> Iterator[Opened]:
    """The report with scripts switched off: everything must be there without them."""
    yield from open_in(browser, page_file, scripts=False)


@pytest.fixture(scope="module")
def opened_with_scripts(browser: Any, page_file: Path) -> Iterator[Opened]:
    yield from open_in(browser, page_file, scripts=True)


def open_in(browser: Any, page_file: Path, *, scripts: bool) -> Iterator[Opened]:
    context = browser.new_context(viewport=PHONE, java_script_enabled=scripts)
    page = context.new_page()
    found = Opened(page, [], [])
    page.on("request", lambda r: found.requested.append(r.url))
    page.on("console", lambda m: found.complaints.append(m.text))
    page.on("pageerror", lambda e: found.complaints.append(str(e)))
    page.on("dialog", lambda d: (found.complaints.append(d.message), d.dismiss()))
    page.goto(page_file.as_uri(), wait_until="load")
    yield found
    context.close()


def test_nothing_is_requested_but_the_file_itself_and_nothing_complains(
    opened_with_scripts: Opened, page_file: Path
) -> None:
    requested = opened_with_scripts.requested
    assert [url for url in requested if not url.startswith("data:image/svg+xml")] == [page_file.as_uri()]
    assert opened_with_scripts.complaints == []


def test_no_script_is_there_and_none_of_a_specimen_s_name_is_run(opened_with_scripts: Opened) -> None:
    opened = opened_with_scripts
    assert opened.page.locator("script, iframe, object, embed, form, link").count() == 0
    assert opened.page.locator("[onerror], [onload], [onclick], a[href^='javascript:']").count() == 0
    assert opened.page.title() != "run"
    assert opened.page.title().startswith("BR-")
    assert HOSTILE in opened.page.locator("dl").first.inner_text()


def test_on_a_phone_a_figure_fits_and_is_as_large_as_drawn_once_it_is_tapped(opened: Opened) -> None:
    opened.page.set_viewport_size(PHONE)
    widths = "[...document.querySelectorAll('figure .box img')].map(one => one.getBoundingClientRect().width)"
    fitting = opened.page.evaluate(widths)
    assert fitting
    assert max(fitting) <= PHONE["width"]
    box = opened.page.locator("figure .box").first
    box.tap() if opened.page.evaluate("'ontouchstart' in window") else box.click()
    assert opened.page.evaluate(widths)[0] == 640
    assert box.evaluate("box => box.scrollWidth > box.clientWidth"), "it scrolls in its box"
    assert opened.page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    opened.page.locator("h1").first.click()
    assert opened.page.evaluate(widths) == fitting, "tapped elsewhere, it fits again"


def test_on_a_phone_the_page_does_not_scroll_sideways(opened: Opened) -> None:
    opened.page.set_viewport_size(PHONE)
    size = opened.page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert size == [PHONE["width"]] * 2
    beyond = opened.page.evaluate(
        "[...document.querySelectorAll('main *')].filter(e => !e.closest('.box') && "
        "e.getClientRects().length && e.getBoundingClientRect().right > innerWidth + 1)"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert beyond == []


def test_on_a_phone_the_laboratory_s_own_parts_fit(browser: Any, report: Made, tmp_path: Path) -> None:
    """Two marks left the title a word a line, and a long option in a text made the page wide."""
    wide, square = tmp_path / "wide.png", tmp_path / "square.png"
    Pixels.new("RGB", (2400, 400), (200, 0, 0)).save(wide)
    Pixels.new("RGB", (900, 900), (0, 0, 200)).save(square)
    text = tmp_path / "own"
    text.write_text(
        "Run with `demo.toml --an-option-that-is-longer-than-the-screen-of-a-phone-is-wide`.", "utf-8"
    )
    own = Section("own", "Own", (read_own_text(str(text)).prose,))
    content = dataclasses.replace(
        report.content,
        mark=read_image(str(wide), "mark", "Mark"),
        accreditation=read_image(str(square), "accreditation_mark", "Accreditation"),
        sections=(own,),
        certificate=(),
    )
    file = tmp_path / "own.html"
    file.write_text(render_html(content, []), encoding="utf-8")
    for opened in open_in(browser, file, scripts=False):
        assert opened.page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        title = opened.page.locator("h1").evaluate("e => e.getBoundingClientRect()")
        marks = opened.page.locator(".mark").evaluate_all("all => all.map(m => m.getBoundingClientRect())")
        assert len(marks) == 2
        assert all(mark["bottom"] <= title["top"] + 1.0 for mark in marks), "the title has lines of its own"


def test_on_a_phone_figures_fit_and_verdicts_show(opened: Opened) -> None:
    opened.page.set_viewport_size(PHONE)
    images = opened.page.locator("figure img")
    rights = images.evaluate_all("all => all.map(i => i.getBoundingClientRect().right)")
    assert rights
    assert max(rights) <= PHONE["width"]
    verdicts = opened.page.locator("td:is(.good, .open, .bad):last-child").filter(visible=True)
    sides = verdicts.evaluate_all(
        "all => all.map(c => c.getBoundingClientRect()).map(r => [r.left, r.right])"
    )
    assert len(sides) > 10
    assert all(0.0 <= left < right <= PHONE["width"] + 1.0 for left, right in sides)


def test_every_figure_is_drawn(opened: Opened, report: Made) -> None:
    images = opened.page.locator("figure img")
    assert images.count() == len(report.content.pictures())
    sizes = images.evaluate_all(
        "all => all.map(i => [i.complete, i.naturalWidth, i.naturalHeight, i.alt.length])"
    )
    assert all(
        complete and width > 400 and height > 200 and alt > 20 for complete, width, height, alt in sizes
    )
    opened.page.set_viewport_size(DESK)
    for number in (0, images.count() - 1):
        pixels = pixels_of(images.nth(number).screenshot())
        ink = np.mean(pixels < 128)
        assert 0.005 < ink < 0.5, "neither empty nor black"
    opened.page.set_viewport_size(PHONE)


def pixels_of(png: bytes) -> np.ndarray:
    """Return a picture's grey values, shape (height, width)."""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("L"))


@pytest.mark.parametrize("viewport", [PHONE, DESK], ids=["phone", "desk"])
def test_tables_are_readable_and_what_is_wide_scrolls_in_its_own_box(
    opened: Opened, viewport: dict[str, int]
) -> None:
    opened.page.set_viewport_size(viewport)
    opened.page.locator("details").evaluate_all("all => all.forEach(d => { d.open = true; })")
    tables = opened.page.locator("table")
    facts = tables.evaluate_all(
        "all => all.map(t => { const box = t.closest('.box'), style = getComputedStyle(t);"
        " const cells = [...t.querySelectorAll('th, td')];"
        " const cut = cells.filter(c => c.scrollWidth > c.clientWidth + 1).length;"
        " return [!!box, getComputedStyle(box).overflowX, parseFloat(style.fontSize), t.rows.length, cut]; })"
    )
    assert len(facts) > 10
    for in_box, overflow, size_px, rows, cut in facts:
        assert in_box
        assert overflow == "auto"
        assert size_px >= 12.0
        assert rows >= 2
        assert cut == 0
    opened.page.locator("details").evaluate_all("all => all.forEach(d => { d.open = false; })")


def test_the_print_view_has_everything_and_names_the_report_on_every_page(
    opened: Opened, report: Made
) -> None:
    opened.page.set_viewport_size({"width": A4_TEXT_PX, "height": 1000})
    opened.page.emulate_media(media="print")
    cut = opened.page.locator(".box").evaluate_all(
        "all => all.filter(b => b.scrollWidth > b.clientWidth + 1).length"
    )
    assert cut == 0, "what scrolls on a screen is lost on paper"
    assert not opened.page.locator("nav").is_visible()
    printed = pypdfium2.PdfDocument(io.BytesIO(opened.page.pdf(prefer_css_page_size=True)))
    opened.page.emulate_media(media="screen")
    texts = [flat(page.get_textpage().get_text_bounded()) for page in printed]
    identifier = opened.page.locator(".report-id").inner_text()
    for number, text in enumerate(texts, start=1):
        assert f"Report {identifier}" in text
        assert f"Page {number} of {len(texts)}" in text
    whole = " ".join(texts)
    for picture in report.content.pictures():
        assert f"Numbers behind figure {picture.number}" in whole
        last = picture.numbers.rows[-1][0].text
        assert last in whole, "the numbers unfold on paper"
    assert "End of report" in texts[-1]
    assert [page.get_size() for page in printed] == [pytest.approx((595, 842), abs=2)] * len(texts)
