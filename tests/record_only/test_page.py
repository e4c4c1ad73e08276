"""The newcomer's path: the commands of docs/how-to/record-only.md, typed in by a machine."""

from __future__ import annotations

import json
import re
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.recording.runfile.file import open_run
from tests.house.house_page import ROOT

PAGE = ROOT / "docs" / "how-to" / "record-only.md"


def commands() -> list[list[str]]:
    """Return the words of the first block's commands."""
    section = PAGE.read_text(encoding="utf-8").partition("## Try it without a stand\n")[2]
    block = section.partition("```\n")[2].partition("```")[0]
    return [shlex.split(line, comments=True) for line in block.splitlines() if line.strip()]


def typed(words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    assert words[0] == "bufferstand"
    return subprocess.run(
        [sys.executable, "-P", "-m", *words],
        cwd=folder, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@contextmanager
def served(words: list[str], folder: Path) -> Iterator[None]:
    """Have the stand served, as in a second terminal."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-u", "-m", *words],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        said = []
        for line in process.stdout:
            said.append(line)
            if line.startswith("serving at"):
                break
        assert said, process.wait(60)
        assert said[-1].startswith("serving at"), said
        yield
    finally:
        process.terminate()
        process.wait(60)
        if process.stdout is not None:
            process.stdout.close()


def with_free_ports(stand: Path) -> None:
    """Give the twin ports that no other test has."""
    text = stand.read_text(encoding="utf-8")
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
    for key, one in zip(("port", "stream_port"), held, strict=True):
        text, found = re.subn(rf"(?m)^{key} = \d+", f"{key} = {one.getsockname()[1]}", text)
        assert found == 1
        one.close()
    stand.write_text(text, encoding="utf-8")


def test_the_page_leads_from_init_to_a_report(tmp_path: Path) -> None:
    words = commands()
    names = [one[1] for one in words]
    assert names == ["init", "simulate-stand", "check", "stand", "record", "evaluate", "report"]
    first, serve, *rest = words
    done = typed(first, tmp_path)
    assert done.returncode == 0, done.stderr
    with_free_ports(tmp_path / "lab" / "stand.toml")
    outcome = {}
    with served(serve, tmp_path):
        time.sleep(5.0)  # it goes to the mean of its sines
        for one in rest:
            outcome[one[1]] = done = typed(one, tmp_path)
            faults = {line.split()[1] for line in done.stdout.splitlines() if "FAULT" in line}
            # On a busy computer the twin is late for a moment: its rate is then what it is, and said.
            assert faults <= {"rate"}, done.stdout
            assert done.returncode == (4 if faults else 0), f"{one}\n{done.stdout}{done.stderr}"
    for channel in ("force", "stroke_1", "stroke_2", "force_2", "temperature_1"):
        assert channel in outcome["check"].stdout
        assert channel in outcome["stand"].stdout
    assert re.search(r"(?m)^force +-?\d+\.\d{2,6} V ", outcome["stand"].stdout), "what calibrates it is volts"
    assert "bufferstand report runs --out report" in outcome["record"].stderr, "it says what comes next"
    (path,) = (tmp_path / "runs").glob("*.h5")
    run = open_run(path)
    assert run.status == "complete"
    assert run.metadata["run"]["simulated"] is True
    found = json.loads(typed(["bufferstand", "evaluate", "runs", "--json", "-"], tmp_path).stdout)["runs"][0]
    summary = found["summary"]
    assert len(summary["cycles_used"]) >= 20
    damping = summary["damping"]
    assert 0.2 < damping["value"] < 0.4
    if damping["expanded_uncertainty"] is None:  # where a busy computer left holes: then the run says why
        assert any("uncertaint" in one for one in found["warnings"]), found["warnings"]
    else:
        assert 0.0 < damping["expanded_uncertainty"] < 0.05
    assert list((tmp_path / "report").glob("*.pdf"))
    (html,) = (tmp_path / "report").glob("*.html")
    assert "simulated" in html.read_text(encoding="utf-8")
