"""The live page as axe-core (an outside checker) judges it: before it is opened, running, stopped, ended."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.monitor.process import Address, web_process
from tests.daq.test_runner import Case
from tests.monitor.browser import chromium, demand_axe, faults
from tests.monitor.served import TOKENS, Page, running
from tests.monitor.test_browser import PHONE, Tab
from tests.monitor.test_browser_live import WIDE, going_page

SIZES = {"1300": WIDE, "390": PHONE}
EVALUATED = "/^\\d+ runs?\\./.test(document.getElementById('evaluating').textContent)"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


def looks(browser: Any, url: str, shown: str) -> dict[str, list[str]]:
    """Return what axe-core finds, by width and colours, once the page shows what it is to show."""
    found = {}
    for size, options in SIZES.items():
        for scheme in ("light", "dark"):
            with Tab(browser, url, bypass_csp=True, color_scheme=scheme, **options) as it:
                it.wait(shown)
                found[f"{size} {scheme}"] = faults(it.tab)
    return {place: texts for place, texts in found.items() if texts}


def test_axe_finds_no_fault_while_it_runs_and_when_it_is_stopped(browser: Any, tmp_path: Path) -> None:
    demand_axe()
    with running(tmp_path) as going, going_page(going) as (page, process):
        control = f"{page.origin}/#{TOKENS.control}"
        shown = (
            "document.querySelectorAll('#cycle-rows tr').length > 2 && "
            "document.querySelectorAll('#guards li').length > 2 && Number(document.body.dataset.points) > 100"
        )
        assert looks(browser, control, shown) == {}
        assert looks(browser, f"{page.origin}/#{TOKENS.view}", shown) == {}
        with Tab(browser, control, bypass_csp=True, **WIDE) as it:
            it.drawn()
            it.tab.click("#write")
            it.tab.click("[data-after=cycle]")
            it.wait("document.getElementById('status').textContent === 'stopped'")
            process.end()
            stopped = f"{EVALUATED} && document.getElementById('alarm').textContent.startsWith('Stopped')"
            it.wait(stopped)
            it.tab.click("#runs tr")
            assert faults(it.tab) == []
            assert looks(browser, control, stopped) == {}
            it.tab.evaluate("document.querySelector('main').append(document.createElement('input'))")
            assert any("label" in one for one in faults(it.tab)), "it would find a field without a name"


def test_axe_finds_no_fault_when_it_has_ended_nor_before_it_is_opened(browser: Any, tmp_path: Path) -> None:
    demand_axe()
    case = Case(tmp_path)
    assert case.run().status == "complete"
    said: list[str] = []
    with web_process(case.out, Address(port=0), said.append, TOKENS, stays=True) as process:
        page = Page(process, said)
        control = f"{page.origin}/#{TOKENS.control}"
        ended = "document.getElementById('status').textContent === 'complete'"
        with Tab(browser, control) as it:
            it.wait(ended)
            process.end()
            assert looks(browser, control, f"{ended} && {EVALUATED}") == {}
            assert looks(browser, f"{page.origin}/", "!document.getElementById('door').hidden") == {}
            it.tab.click("#close")
