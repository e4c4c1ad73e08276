"""A technician's whole day at the desk, without a terminal, in real Chromium on the simulated stand."""

from __future__ import annotations

import json
import os
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.desk.served import Served, served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.evaluation_report.keys import PASSWORD, make
from tests.monitor.browser import chromium

PICTURES = os.environ.get("BUFFERSTAND_PICTURES")
"""Folder to leave pictures of the pages in, to be looked at."""
SHORT = """
[[step]]
kind = "harmonic"
name = "first"
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 12

[[step]]
kind = "harmonic"
name = "second"
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 6
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as it:
        yield it


class Technician(Tab):
    """A tab that fills in, pushes, and takes pictures."""

    name = ""

    def fill(self, **values: str) -> None:
        """Type into fields by their ids."""
        for key, value in values.items():
            self.tab.fill(f"#{key.replace('_', '-')}", value)

    def push(self, selector: str) -> None:
        """Push a button."""
        self.tab.click(selector, timeout=60_000)

    def look(self, what: str, size: Any) -> None:
        """See that the page fits and complains of nothing; keep a picture where one is wanted."""
        assert self.width() <= size["viewport"]["width"], f"{what}: scrolling sideways"
        assert self.complaints == [], what
        if PICTURES:
            path = Path(PICTURES) / f"{what}-{size['viewport']['width']}.png"
            self.tab.screenshot(path=path, full_page=True)


def free_port() -> int:
    """Return a port that nobody has just now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_a_whole_day(browser: Any, tmp_path: Path, size: Any) -> None:
    with served(tmp_path) as desk, Technician(browser, desk.link, **size) as it:
        make(tmp_path)
        it.go(f"{desk.origin}/archive")
        it.says("none found of 0")
        it.go(f"{desk.origin}/new")
        it.fill(stand="hall-2", specimen="B-77", port=str(free_port()), certificate_force="K-17")
        it.says("--stand=hall-2 --port=")
        it.says("--specimen=B-77 --certificate=force=K-17")
        it.look("new", size)
        it.push("#make")
        it.wait("location.pathname === '/prepare'")

        prepared(it, desk, size)
        checked(it, desk, size)
        folder = started(it, desk, size)
        live(it, desk, folder, size)
        stopped_and_resumed(it, desk, folder, size)
        reported(it, size)
        it.go(f"{desk.origin}/archive")
        it.says("3 in all")  # a list that is old is renewed, and shown without being asked for again
        it.look("archive", size)
        it.tab.locator("#archive a").first.click()
        it.says("On record")
        it.look("archive-run", size)
        it.go(f"{desk.origin}/")
        it.says("complete")
        it.look("folder", size)

    runs = sorted((tmp_path / folder / "runs").glob("*.h5"))
    assert len(runs) >= 2
    assert json.loads((tmp_path / folder / "campaign.json").read_text())["plan"]["specimen"]["id"] == "B-77"


def prepared(it: Technician, desk: Served, size: Any) -> None:
    """The campaign becomes a short one: one value in the form, the steps in the text."""
    it.says("Peak force")
    it.look("prepare", size)
    text = it.tab.input_value("#text")
    it.tab.fill("#text", text[: text.index("# Passes at once")] + SHORT.lstrip())
    it.wait("document.querySelectorAll('details[id^=g-step-]').length === 2")
    it.fill(f_step_0_cycles="200")
    it.tab.press("#f-step-0-cycles", "Tab")
    it.wait("document.querySelector('#text').value.includes('cycles = 200')")
    it.fill(scan="B-77")
    it.tab.press("#scan", "Enter")
    it.says("The specimen is B-77")
    it.wait("document.querySelector('#plan').innerText.includes('1 first')")
    it.push("#save")
    it.says("en15551.toml is written")
    assert "cycles = 200" in (desk.folder / "en15551.toml").read_text()


def checked(it: Technician, desk: Served, size: Any) -> None:
    """The simulated twin is served and checked, the specimen touched off, the twin ended."""
    it.go(f"{desk.origin}/check?campaign=en15551.toml")
    it.push("#twin-serve")
    it.says("The simulated stand can be asked")
    it.push("#check")
    assert it.tab.is_disabled("#zero-now"), "the devices are in use"
    it.wait(
        "document.querySelector('#verdict') !== null"
    )  # what it finds of rates is this computer's business
    for text in ("bufferstand-ring, serial", "K-17", "no certificate", "DS18B20"):
        it.says(text)
    it.complaints.clear()
    it.look("check", size)
    it.wait("!document.querySelector('#zero-now').disabled")
    it.push("#zero-now")
    it.says("the stand's id was not typed: nothing was moved")
    it.fill(specimen="B-78", operator="A. Smith", stand_id="hall-2")
    it.push("#zero-now")
    it.says("“B-78” was given, and the specimen is “B-77”")
    it.fill(specimen="B-77", stand_id="hall-3")
    it.push("#zero-now")
    it.says("“hall-3” was given, and the stand is “hall-2”")
    it.fill(stand_id="hall-2")
    it.push("#zero-now")
    it.says("First contact is found")
    assert (desk.folder / "stand.zero.toml").exists()
    it.complaints.clear()  # a refusal is an answer of 409, which the browser writes down
    it.push(".jog[data-by='-0.1']")
    it.says("It has moved")


def started(it: Technician, desk: Served, size: Any) -> str:
    """The start is refused without checklist and id, and then moves a simulated stand."""
    it.go(f"{desk.origin}/start?campaign=en15551.toml")
    it.says("Peak force")
    it.look("start", size)
    it.fill(specimen="B-78")
    it.tab.press("#specimen", "Enter")
    assert it.tab.evaluate("document.activeElement.id") == "start", "Enter of a scanner starts nothing"
    it.push("#start")
    it.says("of the checklist is not ticked")
    for box in it.tab.query_selector_all("[name=tick]"):
        box.check()
    it.push("#start")
    it.says("“B-78” was given, and the specimen is “B-77”")
    folder: str = it.tab.input_value("#out")
    assert not (desk.folder / folder).exists(), "what was refused leaves nothing behind"
    it.fill(specimen="B-77")
    it.tab.check("#simulate")  # that one waits for its reader, however busy this computer is
    it.tab.select_option("#speed", "5")
    it.says("--yes-move B-77 --simulate --speed 5")
    assert it.tab.inner_text("#start") == "Start the rehearsal: no real stand moves"
    it.push("#start")
    return folder


def live(it: Technician, desk: Served, folder: str, size: Any) -> None:
    """The live page opens behind the start, with all of the campaign, and is left again."""
    it.wait("document.body !== null && Number(document.body.dataset.redraws) > 3")
    assert it.tab.url.split("/")[2] != f"127.0.0.1:{desk.port}"
    it.complaints.clear()  # a refusal before is an answer of 409, which the browser writes down
    it.look("live", size)
    assert it.tab.is_visible("#desk-link")
    it.push("#desk-link")
    it.wait("location.pathname === '/campaign'")
    it.wait("document.querySelector('[data-status]').dataset.status === 'running'")
    it.says("simulated stand")
    it.look("campaign", size)


def stopped_and_resumed(it: Technician, desk: Served, folder: str, size: Any) -> None:
    """It is stopped after the cycle, resumed with the specimen's id, and completes."""
    record = desk.folder / folder / "campaign.json"
    it.wait("document.querySelector('.steps .running')?.parentElement.innerText.includes('first')")
    it.push("[data-after=cycle]")
    it.has_said("stopping after the cycle")
    it.wait("document.querySelector('[data-status]').dataset.status === 'stopped'")
    assert json.loads(record.read_text())["stopped_by"] == "operator"
    it.look("stopped", size)
    it.fill(specimen="B-77", operator="B. Jones")
    it.push("#resume")
    it.says("of the checklist is not ticked")
    for box in it.tab.query_selector_all("#resuming [name=tick]"):
        box.check()
    it.fill(specimen="B-78")
    it.push("#resume")
    it.says("“B-78” was given, and the specimen is “B-77”")
    it.complaints.clear()
    it.fill(specimen="B-77")
    it.push("#resume")
    it.has_said("It goes on.")
    it.wait("document.querySelector('[data-status]').dataset.status === 'complete'", 300.0)
    notes = (record.parent / "notes.jsonl").read_text()
    assert len(re.findall("checklist ticked: hall clear", notes)) == 2
    assert "B. Jones at the desk" in notes


def reported(it: Technician, size: Any) -> None:
    """The report is made, signed, verified and shown, and the results are one push away."""
    it.fill(report_key="key.p12", report_password="mistyped")
    it.push("#make-report")
    it.wait("document.getElementById('said').innerText.includes('the password does not open it')", 300.0)
    it.look("wrong-password", size)
    it.fill(report_password=PASSWORD)
    it.push("#make-report")
    it.wait("document.body?.innerText.includes('The report is made and signed')", 600.0)
    it.push("text=Verify it")
    it.wait("document.getElementById('verified').innerText.includes('Test hall 2')", 300.0)
    assert it.tab.locator("#verified.problem").count() == 0, it.tab.inner_text("#verified")
    it.look("complete", size)
    link = it.tab.locator("#report-files a[href*='.html']").first
    with it.context.expect_page() as opened:
        link.click()
    page = opened.value
    page.wait_for_load_state()
    assert "B-77" in page.inner_text("body")
    if PICTURES:
        page.screenshot(path=Path(PICTURES) / f"report-{size['viewport']['width']}.png")
    page.close()
    it.push("#to-results")
    it.wait("location.pathname.startsWith('/results')")
    it.says("second")
    it.look("results", size)
