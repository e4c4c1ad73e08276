"""The desk's pages as axe-core (an outside checker) judges them, by keyboard, and with motion reduced."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from tests.desk.served import SAMPLES, Served, laboratory, served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.monitor.browser import chromium, demand_axe, faults

RUN = "old/001-static-5mm_s.h5"
PAGES = {
    "/": "A-105-E-01",
    "/new": "Laboratory",
    "/prepare": "demo",
    "/prepare?campaign=demo.toml": "Peak force",
    "/check?stand=stand.toml": "Disk",
    "/start?campaign=demo.toml": "Peak force",
    "/campaign": "None yet",
    "/campaign?folder=nowhere": "This cannot be shown",
    "/results": "Of which campaign",
    f"/results?{urlencode({'run': RUN})}": "not-tested",
    "/archive": "001-static",
    f"/archive/run?{urlencode({'path': RUN})}": "On record",
}
"""Page → what it says once it is whole."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = laboratory(tmp_path_factory.mktemp("laboratory"))
    (folder / "old").mkdir()
    shutil.copy(SAMPLES / "runs" / Path(RUN).name, folder / "old")
    (folder / "checklist.toml").write_text('items = ["hall clear", "hoses tight"]\n')
    with served(folder) as it:
        yield it


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_axe_finds_no_fault(browser: Any, desk: Served, size: Any, scheme: str) -> None:
    demand_axe()
    with Tab(browser, desk.link, bypass_csp=True, color_scheme=scheme, **size) as it:
        for path, text in PAGES.items():
            it.go(f"{desk.origin}{path}")
            it.says(text)
            it.tab.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
            assert faults(it.tab) == [], f"{path} at {size['viewport']['width']}, {scheme}"
        it.tab.evaluate("document.querySelector('main').append(document.createElement('input'))")
        assert any("label" in one for one in faults(it.tab)), "it would find a field without a name"


def test_the_keyboard_reaches_everything_and_shows_where_it_is(browser: Any, desk: Served) -> None:
    with Tab(browser, desk.link, **WIDE) as it:
        it.go(f"{desk.origin}/start?campaign=demo.toml")
        it.says("Peak force")
        it.tab.keyboard.press("Tab")
        assert it.tab.evaluate("document.activeElement.className") == "skip"
        it.tab.keyboard.press("Enter")
        reached: list[str] = []
        for _ in range(40):
            it.tab.keyboard.press("Tab")
            reached.append(it.tab.evaluate("document.activeElement.id || document.activeElement.value || ''"))
            if reached[-1] == "start":
                break
            outline = it.tab.evaluate("getComputedStyle(document.activeElement).outlineStyle")
            assert outline == "solid", f"the focus is not seen at {reached[-1]}"
        wanted = ["hall clear", "hoses tight", "simulate", "speed", "out", "operator", "specimen", "start"]
        assert [one for one in reached if one in wanted] == wanted


def test_every_field_has_a_name_and_every_picture_words(browser: Any, desk: Served) -> None:
    nameless = """[...document.querySelectorAll("input, select, textarea, button, meter, img")].filter(
        (one) => !(one.labels?.length || one.getAttribute("aria-label") || one.alt || one.textContent.trim()))
        .map((one) => one.outerHTML.slice(0, 120))"""
    with Tab(browser, desk.link) as it:
        for path, text in PAGES.items():
            it.go(f"{desk.origin}{path}")
            it.says(text)
            assert it.tab.evaluate(nameless) == [], path
