"""The desk's pages in real Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.desk.served import HACK, laboratory, served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.monitor.browser import chromium


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_the_folder_is_shown_and_nothing_foreign_asked_for(browser: Any, tmp_path: Path, size: Any) -> None:
    laboratory(tmp_path)
    with served(tmp_path) as desk, Tab(browser, desk.link, **size) as it:
        for name in ("demo", "en15551-static", "simulated-630kN", "A-105-E-01"):
            it.says(name)
        assert desk.token not in it.tab.url, "the token does not stay in the address"
        assert it.width() == size["viewport"]["width"], "no scrolling sideways"
        assert {url.split("/")[2] for url in it.requests} == {f"127.0.0.1:{desk.port}"}
        assert it.complaints == []


def test_script_in_a_file_is_shown_as_text_and_never_run(browser: Any, tmp_path: Path) -> None:
    laboratory(tmp_path)
    demo = tmp_path / "demo.toml"
    text = demo.read_text()
    lines = [f"title = '{HACK}'" if line.startswith("title") else line for line in text.splitlines()]
    demo.write_text("\n".join(lines))
    with served(tmp_path) as desk, Tab(browser, desk.link) as it:
        it.says("<img src=x onerror")
        assert it.tab.evaluate("window.hacked") is None
        assert it.tab.locator("img, main script").count() == 0
        assert it.complaints == []


def test_the_link_to_work_opens_where_the_page_is_shown_already(browser: Any, tmp_path: Path) -> None:
    with served(tmp_path) as desk, Tab(browser, f"{desk.origin}/") as it:
        it.says("may only look on")
        it.go(desk.link)  # only what is behind the # is other: the browser loads nothing by itself
        assert desk.token not in it.tab.url
        assert it.complaints == []


def test_a_wrong_value_of_the_first_files_is_marked_and_a_mended_one_is_written(
    browser: Any, tmp_path: Path
) -> None:
    with served(tmp_path) as desk, Tab(browser, desk.link) as it:
        it.go(f"{desk.origin}/new")
        it.tab.fill("#max-stroke", "85")
        it.tab.press("#max-stroke", "Tab")
        assert it.tab.is_visible("#model-help")
        assert not it.tab.is_checked("#model")
        it.tab.fill("#max-stroke", "105,0")
        it.tab.press("#max-stroke", "Tab")
        assert it.tab.is_checked("#model"), "what was ticked is ticked again"
        it.tab.fill("#port", "99999")
        it.tab.click("#make")
        it.says("Its port: 99999 is not from 1 to 65535")
        assert it.tab.evaluate("document.activeElement.id") == "port"
        assert it.tab.get_attribute("#port", "aria-invalid") == "true"
        it.tab.fill("#port", "15021")
        it.tab.click("#make")
        it.wait("location.pathname === '/prepare'")
        it.says("The files are written")
    assert "port = 15021" in (tmp_path / "stand.toml").read_text()
    assert "max_stroke_mm = 105.0" in (tmp_path / "specimens" / "A-0001.toml").read_text()
