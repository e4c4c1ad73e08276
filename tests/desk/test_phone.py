"""On a phone no page scrolls sideways, a verdict is seen at once; and steps are moved by keyboard."""

from __future__ import annotations

import os
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from tests.desk.served import SAMPLES, Served, laboratory, served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.monitor.browser import chromium

PICTURES = os.environ.get("BUFFERSTAND_PICTURES")
STATIC = "old/001-static-5mm_s.h5"
BOXES = """[...document.querySelectorAll("main *")].filter((one) => {
    const style = getComputedStyle(one), inside = one.parentElement.closest(".scroll, pre, textarea");
    return !inside && style.visibility !== "hidden" && style.position !== "absolute"
        && one.getBoundingClientRect().right > document.documentElement.clientWidth + 1;
}).map((one) => one.outerHTML.slice(0, 100))"""
"""What reaches beyond the screen, and is in no box that scrolls by itself."""
FITS = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
PAGES = {
    "/": "A-105-E-01",
    "/new": "Laboratory",
    "/prepare": "demo",
    "/prepare?campaign=demo.toml": "Peak force",
    "/check": "simulated-630kN",
    "/check?stand=stand.toml": "Disk",
    "/start": "demo",
    "/start?campaign=demo.toml": "Peak force",
    "/campaign": "None yet",
    "/campaign?folder=nowhere": "This cannot be shown",
    "/results": "Of which campaign",
    f"/results?{urlencode({'run': STATIC})}": "not-tested",
    "/archive": "001-static",
    f"/archive/run?{urlencode({'path': STATIC})}": "On record",
}
"""Page → what it says once it is whole."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = laboratory(tmp_path_factory.mktemp("laboratory"))
    (folder / "old").mkdir()
    shutil.copy(SAMPLES / "runs" / Path(STATIC).name, folder / "old")
    (folder / "checklist.toml").write_text(f'items = ["hall clear", "{"a-very-long-word-" * 8}"]\n')
    with served(folder) as it:
        yield it


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_nothing_scrolls_sideways_but_wide_tables_in_their_box(browser: Any, desk: Served, size: Any) -> None:
    wide = size["viewport"]["width"]
    with Tab(browser, desk.link, **size) as it:
        for number, (path, text) in enumerate(PAGES.items()):
            it.go(f"{desk.origin}{path}")
            it.says(text)
            it.tab.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
            if PICTURES:
                name = f"p{number:02d}-{path.strip('/').partition('?')[0].replace('/', '-')}-{wide}.png"
                it.tab.screenshot(path=Path(PICTURES) / name, full_page=True)
            assert it.tab.evaluate(FITS), path
            assert it.tab.evaluate(BOXES) == [], path
        it.tab.evaluate(
            "document.querySelector('main').append('wide'.repeat(9), document.createElement('pre'))"
        )
        it.tab.evaluate(
            "Object.assign(document.querySelector('main').lastChild.style, {width: '3000px', height: '20px'})"
        )
        assert not it.tab.evaluate(FITS), "it would be seen"


def test_on_a_phone_a_verdict_is_seen_without_scrolling_sideways(browser: Any, desk: Served) -> None:
    with Tab(browser, desk.link, **PHONE) as it:
        it.go(f"{desk.origin}/results?{urlencode({'run': STATIC})}")
        it.says("not-tested")
        places = it.tab.evaluate(
            "[...document.querySelectorAll('#requirements tbody tr')].map((row) => "
            "[row.querySelector('.verdict'), row.cells[1]].map((cell) => cell.getBoundingClientRect())"
            ".map((at) => [at.left, at.right, at.top]))"
        )
        assert len(places) > 2
        for verdict, words in places:
            assert 0 <= verdict[0] < verdict[1] <= 390
            assert words[1] <= 390
            assert verdict[2] < words[2], "the verdict stands first"
        roles = "document.querySelectorAll('#requirements [role=cell]').length"
        assert it.tab.evaluate(roles) == 10 * len(places), "for a screen reader it stays a table"


def test_on_a_phone_the_plan_is_read_step_by_step_without_scrolling_sideways(
    browser: Any, desk: Served
) -> None:
    with Tab(browser, desk.link, **PHONE) as it:
        it.go(f"{desk.origin}/prepare?campaign=demo.toml")
        it.says("Peak force")
        box = "document.querySelector('#plan .scroll')"
        assert it.tab.evaluate(f"{box}.scrollWidth <= {box}.clientWidth"), "the table's own box neither"
        rights = it.tab.evaluate(
            "[...document.querySelectorAll('#plan tbody td, #plan tbody th')].map((one) => "
            "one.getBoundingClientRect().right)"
        )
        assert len(rights) > 9
        assert max(rights) <= 390
        force = "[...document.querySelectorAll('#plan tbody td[data-label=Force]:not(.none)')][0]"
        said = it.tab.evaluate(
            f"['::before', '::after'].map((one) => getComputedStyle({force}, one).content).join()"
        )
        assert "Force" in said
        assert "kN" in said
        assert it.tab.locator("#plan [role=cell]").count() % 8 == 0, "for a screen reader it stays a table"
        assert it.tab.locator("#plan [role=columnheader]").count() == 9


@pytest.mark.parametrize(
    ("path", "text", "label"),
    [
        (f"/results?{urlencode({'run': STATIC})}", "not-tested", "greatest force"),
        ("/archive", "001-static", "kind"),
    ],
    ids=["results", "archive"],
)
def test_on_a_phone_runs_are_cards_that_are_sorted_and_need_no_scrolling_sideways(
    browser: Any, desk: Served, path: str, text: str, label: str
) -> None:
    with Tab(browser, desk.link, **PHONE) as it:
        it.go(f"{desk.origin}{path}")
        it.says(text)
        table = "document.querySelector('table.cards')"
        it.wait(f"{table}.tBodies[0].rows.length > 0")
        assert it.tab.evaluate(f"{table}.parentElement.scrollWidth <= {table}.parentElement.clientWidth")
        rights = f"[...{table}.querySelectorAll('td, th')].map((one) => one.getBoundingClientRect().right)"
        assert 0 < max(it.tab.evaluate(rights)) <= 390
        cell = f"{table}.querySelector('td[data-label=\"{label}\"]')"
        assert label in it.tab.evaluate(f"getComputedStyle({cell}, '::before').content")
        rows, cells, heads = it.tab.evaluate(
            f"['tbody [role=row]', 'tbody [role=cell]', '[role=columnheader]']"
            f".map((one) => {table}.querySelectorAll(one).length)"
        )
        assert (cells, heads > 5) == (rows * heads, True), "for a screen reader it stays a table"
        heading = it.tab.locator("table.cards th button").nth(1)
        heading.click()
        it.wait(f"{table}.querySelectorAll('th[aria-sort]').length === 1")
        assert it.complaints == []


def test_steps_are_moved_by_keyboard_and_nothing_is_lost(browser: Any, desk: Served) -> None:
    before = (desk.folder / "demo.toml").read_text()
    steps = tomllib.loads(before)["step"]
    with Tab(browser, desk.link, **WIDE) as it:
        it.go(f"{desk.origin}/prepare?campaign=demo.toml")
        it.says("Peak force")
        it.tab.evaluate("document.querySelector('#g-step-0 [data-move=\"1\"]').focus()")
        it.tab.keyboard.press("Enter")
        it.says("Step 1 is now step 2.")
        at = "document.activeElement.getAttribute('aria-label')"
        assert it.tab.evaluate(at) == "Move step 2 down", "the keyboard goes along with the step"
        text = it.tab.input_value("#text")
        assert tomllib.loads(text)["step"] == [steps[1], steps[0], *steps[2:]]
        assert sorted(text.splitlines()) == sorted(before.splitlines())
        it.tab.keyboard.press("Shift+Tab")
        assert it.tab.evaluate(at) == "Move step 2 up"
        it.tab.keyboard.press("Enter")
        it.says("Step 2 is now step 1.")
        assert it.tab.input_value("#text") == before
        assert it.tab.evaluate(at) == "Move step 1 down", "where it cannot go on the other one has the focus"
        assert it.tab.locator("#g-step-0 [data-move='-1']").is_disabled()
        assert it.complaints == []
