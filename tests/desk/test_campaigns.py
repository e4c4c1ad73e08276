"""A campaign that the desk has started is not the desk's: it outlives it, and the next desk finds it."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.operator import is_running
from tests.cli.processes import bufferstand
from tests.desk.served import HACK, Served, laboratory, served, until

LONG = """
[[step]]
kind = "harmonic"
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 2000
"""


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    laboratory(tmp_path)
    demo = tmp_path / "demo.toml"
    text = demo.read_text()
    demo.write_text(
        text[: text.index("# First, while")].replace('title = "', f"title = '{HACK}' # \"") + LONG
    )
    yield tmp_path
    if is_running(tmp_path / "out"):
        bufferstand("stop", tmp_path / "out")
        until(lambda: not is_running(tmp_path / "out"))


def start(desk: Served) -> None:
    """Start the campaign on a simulated stand."""
    desk.enter()
    content = {
        "campaign": "demo.toml",
        "out": "out",
        "specimen": "A-105-E-01",
        "operator": HACK,
        "simulate": True,
        "speed": "5",
    }
    status, said = desk.post("/start", content)
    assert (status, said) == (200, {"folder": "out"})


def state(desk: Served) -> dict[str, Any]:
    """Return what the campaign's page asks for."""
    found: dict[str, Any] = json.loads(desk.request("GET", "/campaign/state?folder=out")[2])
    return found


def children_of(pid: int) -> list[int]:
    """Return the processes that a process has started."""
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def ended(pid: int) -> bool:
    """Return whether a process is over."""
    try:
        return " Z " in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return True


def test_it_outlives_the_desk_and_the_next_desk_finds_and_stops_it(folder: Path) -> None:
    with served(folder) as first:
        start(first)
        assert state(first)["status"] == "running"
        status, live = first.post("/campaign/live", {"folder": "out"})
        assert status == 200
        assert "#" in live["link"]
        status, said = first.post("/start", {"campaign": "demo.toml", "out": "out", "specimen": "A-105-E-01"})
        assert (status, "is there already" in said["problem"]) == (409, True)
        pages = [
            pid
            for pid in children_of(first.process.pid)
            if b"monitor" in Path(f"/proc/{pid}/cmdline").read_bytes()
        ]
        assert len(pages) == 1
    until(lambda: ended(pages[0]))
    assert is_running(folder / "out"), "the campaign goes on without the desk"

    with served(folder) as second:
        page = second.request("GET", "/")[2]
        assert "running" in page
        assert "<img" not in page
        second.enter()
        assert state(second)["status"] == "running"
        whole = second.request("GET", "/campaign?folder=out")[2]
        assert "<img" not in whole
        assert "&lt;img src=x" in whole
        status, said = second.post(
            "/campaign/note", {"folder": "out", "text": f"--help {HACK}", "who": "A. Smith"}
        )
        assert (status, said["said"]) == (200, "noted")
        status, said = second.post("/campaign/stop", {"folder": "out", "after": "cycle"})
        assert status == 200
        until(lambda: state(second)["status"] == "stopped")
        assert "--help" in (folder / "out" / "notes.jsonl").read_text()
        status, said = second.post("/campaign/stop", {"folder": "out", "after": "now"})
        assert (status, "no campaign runs" in said["problem"]) == (409, True)
        status, said = second.post("/campaign/resume", {"folder": "out", "specimen": "other"})
        assert (status, "“other” was given" in said["problem"]) == (409, True)
        # What the command says of this start, not what it wrote of the stop before.
        status, said = second.post(
            "/campaign/resume", {"folder": "out", "specimen": "other", "edits": "take"}
        )
        assert (status, "“other” was given" in said["problem"]) == (409, True)
        assert "stopped by" not in said["problem"]
        (folder / "checklist.toml").write_text('items = ["hall clear"]\n')
        assert "hall clear" in second.request("GET", "/campaign?folder=out")[2]
        status, said = second.post("/campaign/resume", {"folder": "out", "specimen": "A-105-E-01"})
        assert (status, "is not ticked: hall clear" in said["problem"]) == (409, True)
        (folder / "checklist.toml").write_text("items = 3\n")
        status, _, page = second.request("GET", "/campaign?folder=out")
        assert (status, "checklist.toml" in page) == (200, True)
        assert (folder / "out" / "desk.log").stat().st_mode & 0o077 == 0


def test_a_desk_that_is_killed_takes_its_own_pages_with_it_and_no_campaign(folder: Path) -> None:
    with served(folder) as desk:
        start(desk)
        desk.post("/campaign/live", {"folder": "out"})
        page = next(
            pid
            for pid in children_of(desk.process.pid)
            if b"monitor" in Path(f"/proc/{pid}/cmdline").read_bytes()
        )
        desk.process.send_signal(signal.SIGKILL)
        desk.process.wait()
        until(lambda: ended(page))
    assert is_running(folder / "out")


def test_a_campaign_that_was_killed_is_said_to_be_broken_off(folder: Path) -> None:
    with served(folder) as desk:
        start(desk)
        (run,) = [
            pid
            for pid in children_of(desk.process.pid)
            if b"run" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        ]
        os.kill(run, signal.SIGKILL)
        until(lambda: state(desk)["status"] == "killed")
        assert "broken off" in desk.request("GET", "/")[2]
        assert "look at the stand" in state(desk)["state"]


@pytest.mark.parametrize("name", ["../demo.toml", "demo.toml", "", "specimens", "/"])
def test_a_folder_without_a_campaign_has_no_page(folder: Path, name: str) -> None:
    with served(folder) as desk:
        desk.enter()
        status, _, text = desk.request("GET", f"/campaign/state?folder={name}")
        assert status == 404
        assert "This cannot be shown" in text
        assert desk.post("/report", {"folder": [name]})[0] == 409
