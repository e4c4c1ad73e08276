"""The live page in real Chromium: spans, channels, cursor, cycles, a stop, and what comes behind the end."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.monitor.process import Address, web_process
from tests.monitor.browser import chromium
from tests.monitor.served import TOKENS, Page, Running, running, served
from tests.monitor.test_browser import PHONE, Tab

ESSENTIALS = ("#status", "#force", "#stroke", "#heat", "#cycle", "#step", "#left", "#stop-now", "#loop-chart",
              "#stroke-chart", "#force-chart", "#cycle-rows", "#nearest")  # fmt: skip
WIDE = {"viewport": {"width": 1300, "height": 900}}
SPANS = "document.getElementById('trace-said').textContent"
CHOOSE = """([id, value]) => { const one = document.getElementById(id); one.value = value;
    one.dispatchEvent(new Event("change")); return one.value; }"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory, browser: Any) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("live")) as going:
        yield going


@pytest.fixture(scope="module")
def page(campaign: Running) -> Iterator[Page]:
    with served(campaign.case.out) as it:
        yield it


def seen(it: Tab, name: str) -> bool:
    """Whether something stands above the fold, and is not hidden."""
    box = it.tab.locator(name).bounding_box()
    return box is not None and box["y"] >= 0 and box["y"] + min(box["height"], 40) <= 900 and box["width"] > 0


@pytest.mark.slow
def test_the_essentials_are_above_the_fold(browser: Any, page: Page) -> None:
    with Tab(browser, f"{page.origin}/#{TOKENS.control}", **WIDE) as it:
        it.drawn()
        it.wait("document.querySelectorAll('#cycle-rows tr').length > 2")
        for name in ESSENTIALS:
            assert seen(it, name), f"{name} is below the fold"
        assert it.tab.evaluate("document.documentElement.scrollWidth") == 1300
        assert it.complaints == []


@pytest.mark.slow
def test_on_a_phone_cycles_are_read_without_scrolling_sideways(browser: Any, page: Page) -> None:
    with Tab(browser, f"{page.origin}/#{TOKENS.view}", **PHONE) as it:
        it.drawn()
        it.wait("document.querySelectorAll('#cycle-rows tr').length > 2")
        table = "document.querySelector('#cycles-panel table')"
        assert it.tab.evaluate(f"{table}.parentElement.scrollWidth <= {table}.parentElement.clientWidth")
        rights = f"[...{table}.querySelectorAll('td')].map((one) => one.getBoundingClientRect().right)"
        assert 0 < max(it.tab.evaluate(rights)) <= 390
        said = "['::before', '::after'].map((one) => getComputedStyle(document.querySelector("
        said += "'#cycle-rows td[data-label=amplitude]:not(.none)'), one).content).join()"
        assert it.tab.evaluate(said) == '"amplitude","mm"'
        rows, cells, heads = it.tab.evaluate(
            "['tbody [role=row]', 'tbody [role=cell]', '[role=columnheader]']"
            f".map((one) => {table}.querySelectorAll(one).length)"
        )
        assert (cells, heads > 4) == (rows * heads, True), "for a screen reader it stays a table"


@pytest.mark.slow
def test_any_span_and_every_channel_can_be_chosen_with_cursor_and_zoom(browser: Any, page: Page) -> None:
    with Tab(browser, f"{page.origin}/#{TOKENS.view}", **WIDE) as it:
        it.drawn()
        channels = it.tab.evaluate(
            "[...document.getElementById('force-channel').options].map((o) => o.value)"
        )
        assert {"stroke", "force", "stroke_1", "position", "command", "temperature_1"} <= set(channels)
        assert it.tab.evaluate(CHOOSE, ["span", "whole"]) == "whole"
        it.wait(f"{SPANS}.includes('since the start, least and greatest value')")
        assert it.tab.evaluate(CHOOSE, ["force-channel", "temperature_1"]) == "temperature_1"
        box = it.tab.locator("#stroke-chart .u-over").bounding_box()
        it.tab.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 20)
        it.wait("/stroke .* mm, temperature_1 .* °C/.test(document.getElementById('cursor').textContent)")
        whole = it.tab.evaluate(SPANS)
        it.tab.mouse.down()
        it.tab.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 20)
        it.tab.mouse.up()
        it.wait("document.getElementById('span').value === 'chosen'")
        it.wait(f"{SPANS} !== {json.dumps(whole)}")
        closer = it.tab.evaluate(SPANS)
        for name in ("zoom-out", "earlier", "later", "zoom-in"):
            it.tab.focus(f"#{name}")
            it.tab.keyboard.press("Enter")
            it.tab.wait_for_timeout(300)
        assert it.tab.evaluate("document.getElementById('span').value") == "chosen"
        assert closer.startswith(it.tab.evaluate(SPANS)[:1])
        assert it.tab.evaluate(CHOOSE, ["span", "live"]) == "live"
        it.tab.evaluate(CHOOSE, ["force-channel", "force"])
        before = it.tab.evaluate("Number(document.body.dataset.redraws)")
        it.wait(f"Number(document.body.dataset.redraws) > {before}")
        loop = it.tab.locator("#loop-chart .u-over").bounding_box()
        it.tab.mouse.move(loop["x"] + 60, loop["y"] + 60)
        it.wait("/mm, .* kN/.test(document.getElementById('loop-cursor').textContent)")
        it.tab.click("#loop-closer")
        it.tab.click("#loop-whole")
        assert it.complaints == []


@pytest.mark.slow
@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_cycles_come_with_their_figures_beside_what_was_asked(browser: Any, page: Page, size: Any) -> None:
    with Tab(browser, f"{page.origin}/#{TOKENS.view}", **size) as it:
        it.wait("document.querySelectorAll('#cycle-rows tr').length > 2")
        row = it.tab.locator("#cycle-rows tr").nth(1)
        cells = [float(text.replace("−", "-")) for text in row.locator("td").all_inner_texts()]
        assert cells[1] == pytest.approx(5.0, abs=0.1), "the amplitude"
        assert abs(cells[3]) < 1e-2, "this stand is elastic"
        assert "10.00 ± 5.00 mm at 1.000 Hz" in it.tab.inner_text("#asked")
        it.wait("document.querySelector('#trend-chart canvas') !== null")
        assert "whole cycle" in it.tab.inner_text("#loop-legend")
        assert it.tab.evaluate("document.documentElement.scrollWidth") == size["viewport"]["width"]
        unnamed = it.tab.evaluate(
            """[...document.querySelectorAll('main input, main select, main button')].filter((e) =>
                !(e.labels?.length || e.textContent.trim() || e.getAttribute('aria-label'))).length"""
        )
        assert unnamed == 0
        assert it.complaints == []


@pytest.mark.slow
def test_a_stop_is_asked_until_it_works_and_the_page_goes_on_to_the_results(
    browser: Any, tmp_path: Path
) -> None:
    """Asked by Ada, the stand still moves; then stopped and seen safe, with the results on the same page."""
    with (
        running(tmp_path) as going,
        going_page(going) as (page, process),
        Tab(browser, f"{page.origin}/#{TOKENS.control}", **WIDE) as it,
    ):
        it.drawn()
        it.wait("document.getElementById('left').textContent !== '–'")
        assert it.tab.evaluate(CHOOSE, ["span", "whole"]) == "whole"
        it.tab.evaluate("document.getElementById('who').value = 'Ada'")
        it.tab.click("[data-after=step]")
        it.wait("document.getElementById('status').textContent === 'stop asked'")
        assert "Asked to stop after the step: Ada at this computer" in it.tab.inner_text("#alarm")
        assert "still moves" in it.tab.inner_text("#alarm")
        assert it.tab.inner_text("#left") == "–", "nothing is foretold of a campaign that is being ended"
        it.tab.click("[data-after=cycle]")
        it.wait("document.getElementById('status').textContent === 'stopped'")
        it.wait("document.getElementById('alarm').textContent.includes('The stand was seen to be safe')")
        assert "(cycle)" not in it.tab.inner_text("#alarm"), "words of the page"
        process.end()
        assert process.stays
        it.wait("document.querySelectorAll('#runs tr').length === 1")
        assert "Ada at this computer" in it.tab.inner_text("#events")
        assert it.tab.evaluate("document.getElementById('span').value") == "whole", "what was looked at stays"
        it.wait("document.getElementById('evaluating').textContent.startsWith('1 run.')")
        it.wait("!document.getElementById('trace-tools').hidden")
        it.tab.click("#runs tr")
        it.wait("document.getElementById('traces-title').textContent.startsWith('Over time: ')")
        it.wait(f"/^0.00 s to [0-9.]+ s of the run/.test({SPANS})")
        for _ in range(3):
            before = it.tab.evaluate(SPANS)
            it.tab.click("#zoom-in")
            it.wait(f"{SPANS} !== {json.dumps(before)}")
        assert it.tab.evaluate("document.getElementById('span').value") == "chosen"
        it.tab.click("#later")
        it.tab.select_option("#force-channel", "temperature_1")
        box = it.tab.locator("#stroke-chart .u-over").bounding_box()
        it.tab.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20)
        it.wait("/^[0-9.]+ s: stroke .* mm, temp.* °C$/.test(document.getElementById('cursor').textContent)")
        it.tab.mouse.down()
        it.tab.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 20)
        closer = it.tab.evaluate(SPANS)
        it.tab.mouse.up()
        it.wait(f"{SPANS} !== {json.dumps(closer)} && {SPANS}.includes('of the run')")
        it.tab.click("#runs tr")
        it.wait(f"document.getElementById('span').value === 'run' && {SPANS}.startsWith('0.00 s')")
        it.tab.select_option("#span", "whole")
        it.wait(f"{SPANS}.includes('since the start')")
        assert "monitor: " not in it.tab.inner_text("body")
        assert it.tab.inner_text("#status") == "stopped"
        assert it.tab.is_hidden("#stop-now")
        assert it.tab.inner_text("#title")
        it.tab.click("#close")
        it.wait("document.getElementById('age').textContent.includes('has been closed')")
        assert it.complaints == []


BURST = """async () => {
    const rows = await import("/static/rows.js?of-a-test"), own = Array.prototype.push;
    let most = 0;
    Array.prototype.push = function (...more) {
        const size = own.apply(this, more);
        if ([rows.fine.t, rows.coarse.t].includes(this)) most = Math.max(most, size);
        return size;
    };
    const packet = (k) => ({ t0_us: 1e5 * k, ...Object.fromEntries(["t", "s", "f"].map((n) => [n, Array.from({ length: 100 }, (_, i) => 10 * i)])) });
    for (let turn = 0; turn < 5; turn++) rows.take(Array.from({ length: 600 }, (_, k) => packet(600 * turn + k)));
    Array.prototype.push = own;
    return [most, rows.fine.t.length, rows.coarse.t.length, rows.fine.t.at(-1)];
}"""  # noqa: E501
LABELS = """async () => {
    const { TraceChart } = await import("/static/charts.js"), element = document.createElement("div");
    element.style.width = "500px"; element.style.height = "142px";
    document.body.append(element);
    const chart = new TraceChart(element, "--force", { least: 5, zoomed() {}, pointed() {} });
    return [["temperature_1 in °C", "°C"], ["stroke in mm", "mm"]].map(([text, unit]) => { chart.label(text, unit); return chart.text; });
}"""  # noqa: E501


@pytest.mark.slow
def test_a_burst_of_rows_takes_no_room_that_is_kept_and_a_label_that_is_too_long_is_not_cut(
    browser: Any, page: Page
) -> None:
    """Five minutes in five messages, as a page gets them that was asleep: 3 s, and 30 s thinned out."""
    with Tab(browser, f"{page.origin}/#{TOKENS.view}", **WIDE) as it:
        it.drawn()
        most, fine, coarse, newest = it.tab.evaluate(BURST)
        assert fine == pytest.approx(3000, abs=300)
        assert coarse == pytest.approx(6000, abs=300)
        assert most <= 6300, "what an array once held it keeps the room for"
        assert newest == pytest.approx(300.0, abs=0.01)
        assert it.tab.evaluate(LABELS) == ["°C", "stroke in mm"]


class going_page:  # noqa: N801 - used like a function
    """A page that stays, beside a campaign."""

    def __init__(self, going: Running) -> None:
        said: list[str] = []
        self._said = said
        self._served = web_process(going.case.out, Address(port=0), said.append, TOKENS, stays=True)

    def __enter__(self) -> tuple[Page, Any]:
        process = self._served.__enter__()
        return Page(process, self._said), process

    def __exit__(self, *why: Any) -> None:
        self._served.__exit__(*why)
