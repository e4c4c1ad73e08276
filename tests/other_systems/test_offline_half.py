"""The offline half where the system lacks what only Linux has (``sitecustomize.py`` beside this)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bufferstand.cli.main import COMMANDS, OF_STAND
from tests.conftest import ROOT

RUNS = ROOT / "sample_runs" / "runs"
STATIC = RUNS / "001-static-5mm_s.h5"
MODEL = ROOT / "sample_runs" / "models" / "category-a-elastomer.toml"
pytestmark = pytest.mark.slow


def command_here(*arguments: object, where: Path, hidden: bool = False) -> subprocess.CompletedProcess[str]:
    folders = [str(Path(__file__).parent)] if hidden else []
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*folders, str(ROOT)])}
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", *map(str, arguments)],
        cwd=where,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


def _done(*arguments: object, where: Path, status: int = 0) -> str:
    done = command_here(*arguments, where=where, hidden=True)
    assert done.returncode == status, (arguments, done.stdout[-500:], done.stderr[-3000:])
    assert "Traceback" not in done.stderr
    return done.stdout


def test_the_hiding_hides(tmp_path: Path) -> None:
    """Else all that follows shows nothing."""
    check = (
        "import os, signal, sys; print(sys.platform, hasattr(os, 'pread'), hasattr(signal, 'SIGHUP'));"
        "import fcntl"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", check],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout.split() == ["win32", "False", "False"]
    assert "ModuleNotFoundError" in done.stderr


def test_figures_are_those_of_linux(tmp_path: Path) -> None:
    here, there = tmp_path / "here.json", tmp_path / "there.json"
    _done("evaluate", "--no-cache", STATIC, "--json", there, where=tmp_path)
    assert command_here("evaluate", "--no-cache", STATIC, "--json", here, where=tmp_path).returncode == 0
    assert json.loads(there.read_text("utf-8")) == json.loads(here.read_text("utf-8"))


def test_record_to_report(tmp_path: Path) -> None:
    """Import a logger's file, look for it, evaluate, compare, report with all that hangs on it, verify."""
    record = ROOT / "sample_runs" / "records" / "harmonic.csv"
    _done("import", record, "--out", "runs", where=tmp_path)
    (tmp_path / "runs" / "static.h5").write_bytes(STATIC.read_bytes())
    (tmp_path / "runs" / "report.toml").write_text(
        'laboratory = "L"\nnumber = "L-{year}-{running:04}"\nnumber_register = "numbers.csv"\n',
        encoding="utf-8",
    )
    assert "harmonic" in _done("runs", "runs", where=tmp_path)
    _done("verify", "runs", where=tmp_path)
    _done("evaluate", "runs", "--json", "one.json", "--jobs", 1, "--cache", "cache", where=tmp_path)
    _done("evaluate", "runs", "--json", "two.json", "--jobs", 1, "--cache", "cache", where=tmp_path)
    _done("compare", "one.json", "two.json", where=tmp_path)
    _done(
        "report", "runs", "--out", "report", "--table", "report.xlsx", "--dtr", "report.xml", where=tmp_path
    )  # fmt: skip
    made = sorted(path.suffix for path in (tmp_path / "report").iterdir())
    assert made == [".html", ".pdf"]
    (pdf,) = (tmp_path / "report").glob("*.pdf")
    _done("verify", pdf, "--runs", "runs", where=tmp_path)


def test_model_is_simulated_compared_and_exported(tmp_path: Path) -> None:
    _done("model", "compare", MODEL, RUNS / "003-harmonic-20mm-20mm-0.318Hz.h5", where=tmp_path)
    _done("model", "export", MODEL, "--c", "c", "--tables", "tables", where=tmp_path)
    assert list((tmp_path / "c").glob("*.h"))


def test_campaign_is_planned_and_published(tmp_path: Path) -> None:
    assert "steps" in _done("plan", ROOT / "sample_runs" / "demo.toml", where=tmp_path)
    runs = tmp_path / "campaign"
    runs.mkdir()
    (runs / "static.h5").write_bytes(STATIC.read_bytes())
    (runs / "publication.toml").write_text(
        'title = "T"\ndescription = "D"\npublished = 2026-11-28\nlicence = "CC-BY-4.0"\n'
        '[[author]]\nname = "N"\naffiliation = "A"\n',
        encoding="utf-8",
    )
    _done("publish", runs, "--out", "crate.zip", where=tmp_path)
    assert (tmp_path / "crate.zip").stat().st_size > 10_000


def test_damaged_run_is_refused(tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.h5"
    content = bytearray(STATIC.read_bytes())
    content[len(content) // 2 :] = bytes(len(content) - len(content) // 2)
    damaged.write_bytes(content)
    refused = command_here("evaluate", damaged, where=tmp_path, hidden=True)
    assert refused.returncode == 2
    assert "damaged" in refused.stderr
    assert "Traceback" not in refused.stderr


@pytest.mark.parametrize("command", OF_STAND)
def test_stand_half_says_in_one_sentence_what_it_needs(tmp_path: Path, command: str) -> None:
    assert command in COMMANDS
    refused = command_here(command, where=tmp_path, hidden=True)
    assert refused.returncode == 2
    (line,) = refused.stderr.splitlines()
    assert f"“{command}” needs Linux" in line
