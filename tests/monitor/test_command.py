"""``bufferstand monitor`` and ``run --monitor`` as a user types them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.main import bufferstand
from bufferstand.daq.monitor.results import describe
from bufferstand.foundation.errors import BadInput
from tests.daq.test_runner import Case
from tests.monitor.served import HACK, Page, hear

RUNS = Path(__file__).parents[2] / "sample_runs" / "runs"


def test_a_folder_without_a_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"no campaign\.json in this folder; give the --out folder"):
        CliRunner().invoke(bufferstand, ["monitor", str(tmp_path)], catch_exceptions=False)


@pytest.mark.parametrize("command", ["run", "resume"])
def test_a_file_name_that_the_option_has_taken_is_told_so(command: str) -> None:
    with pytest.raises(BadInput, match=r"--monitor: “demo:toml” is no HOST:PORT; write e\.g\."):
        CliRunner().invoke(bufferstand, [command, "--monitor", "demo:toml", __file__], catch_exceptions=False)


@pytest.mark.slow
def test_a_finished_campaign_shows_its_runs_and_ctrl_c_ends_the_page(tmp_path: Path) -> None:
    case = Case(tmp_path)
    assert case.run().status == "complete"
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", "monitor", str(case.out), "--address", "127.0.0.1:0"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stderr is not None
        links = [process.stderr.readline().strip() for _ in range(3)]
        assert links[2] == "Ctrl-C ends the page."
        page = Page(None, links[:2])  # type: ignore[arg-type]
        with page.live() as wire:
            known = hear(wire, lambda k: k.get("runs", {}).get("evaluating") is False)
        assert known["source"] == {"kind": "finished"}
        assert known["campaign"]["status"] == "complete"
        (run,) = known["runs"]["runs"]
        assert run["summary"]["amplitude_mm"]["value"] == pytest.approx(5.0, rel=0.1)
        assert run["summary"]["damping"]["value"] == pytest.approx(0.0, abs=1e-3), "this stand is elastic"
        assert len(run["loop"]["t"]) == len(run["loop"]["s"]) == len(run["loop"]["f"]) > 500
        assert page.enter(links[1].split("#")[1]) == 200
        assert page.request("POST", "/note", {"text": "seen afterwards"})[0] == 200
        assert "seen afterwards" in (case.out / "notes.jsonl").read_text()
        status, _, body = page.request("POST", "/stop", {"after": "now"})
        assert status == 409
        assert "no campaign can be reached" in json.loads(body)["problem"]
    finally:
        os.kill(process.pid, signal.SIGINT)
        _, stderr = process.communicate(timeout=180)
    assert process.returncode == 0
    assert stderr.strip().splitlines() == ["the page is closed"]


@pytest.mark.slow
def test_a_running_campaign_that_cannot_be_heard_is_read_from_its_journal(tmp_path: Path) -> None:
    from tests.monitor.served import TOKENS, running, served

    with running(tmp_path) as going:
        (going.case.out / "live").unlink()  # as on a network drive
        (going.case.out / "control").unlink()
        with served(going.case.out) as page:
            page.enter(TOKENS.control)
            with page.live() as wire:
                known = hear(wire, lambda k: k["rows"] and "guards" in k and "events" in k)
            assert known["source"] == {"kind": "journal"}
            assert known["now"]["durable"] is None
            assert known["now"]["name"] == HACK
            assert page.request("POST", "/stop", {"after": "now"})[0] == 409
            assert going.thread.is_alive()


def test_runs_that_cannot_be_evaluated_are_listed_with_the_reason(tmp_path: Path) -> None:
    broken = tmp_path / "broken.h5"
    broken.write_bytes(b"no HDF5")
    assert describe(broken, tmp_path)["problem"]
    content = describe(RUNS / "003-harmonic-20mm-20mm-0.318Hz.h5", RUNS)
    json.dumps(content, allow_nan=False)
    assert content["problem"] is None
    assert 0.1 < content["summary"]["damping"]["value"] < 0.6
    assert max(content["loop"]["s"]) == pytest.approx(40.0, abs=2.0)
