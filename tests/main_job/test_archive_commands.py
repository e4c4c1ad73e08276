"""Archives as a user meets them: evaluate twice, compare, find; what is printed where, and the status."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from tests.evaluation_archive.samples import archive, damaged
from tests.main_job.conftest import bufferstand, here


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[2]))
    return [path.relative_to(tmp_path) for path in archive(tmp_path / "archive")[:4]]


def test_an_archive_with_a_bad_file(runs: list[Path], tmp_path: Path) -> None:
    bad = runs[1]
    damaged(bad)
    options = (
        "--draws",
        "100",
        "--jobs",
        "2",
        "--json",
        "e.json",
        "--table",
        "c.csv",
        "--run-table",
        "r.csv",
    )
    tables = []
    for _ in range(2):
        done = bufferstand("evaluate", "archive/**/0[1-4]-*.h5", *options)
        assert done.returncode == 2, done.stderr
        first, last = done.stderr.splitlines()
        assert first.startswith(f"bufferstand: {bad}: ")
        assert last == "bufferstand: 1 of 4 runs could not be evaluated"
        document = json.loads(Path("e.json").read_text())
        assert [entry["run"]["path"] for entry in document["runs"]] == [str(p) for p in runs if p != bad]
        assert [failure["path"] for failure in document["failures"]] == [str(bad)]
        table = Path("c.csv").read_text()
        assert table.count("\n") == 1 + sum(len(entry["cycles"]) for entry in document["runs"])
        assert (tmp_path / "cache" / "bufferstand").is_dir()
        tables.append(table)
    assert tables[0] == tables[1]
    alone = bufferstand("evaluate", bad, "--json", "-")
    assert (alone.returncode, alone.stdout) == (2, "")
    assert alone.stderr == first + "\n"  # as of any other command


def test_compare(runs: list[Path]) -> None:
    common = ("--draws", "200", "--jobs", "1", "--no-cache")
    bufferstand("evaluate", *runs[:2], *common, "--json", "old.json")
    bufferstand("evaluate", *runs[1:3], *common, "--moving-mass", "2000", "--json", "new.json")
    assert not Path("cache").exists()
    done = bufferstand("compare", "old.json", "new.json", "--json", "-", "--table", "moves.csv", "--cycles")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["changed"] == {"moving_mass_kg": {"old": None, "new": 2000.0}}
    assert (found["runs_compared"], found["only_old"], found["only_new"]) == (1, ["h-30-1"], ["h-30-2"])
    means = {move["quantity"]: move for move in found["moves"] if move["cycle"] is None}
    # K′ grows by m ω² = 2000 kg (2 π 1.5 Hz)² = 0.178 kN/mm; the loop keeps its area.
    assert means["storage_stiffness_kN_per_mm"]["difference"] == pytest.approx(0.1777, rel=0.02)
    assert means["storage_stiffness_kN_per_mm"]["beyond_uncertainty"] is True
    assert means["absorbed_energy_J"]["beyond_uncertainty"] is False
    assert Path("moves.csv").read_text().count("\n") == 1 + len(found["moves"])
    shown = bufferstand("compare", "old.json", "new.json").stdout
    assert "moving_mass_kg: none → 2000.0" in shown
    assert "only in the old evaluation: h-30-1" in shown
    same = bufferstand("compare", "old.json", "old.json")
    assert same.stdout.splitlines() == ["2 runs compared", "no figure moved"]
    for name, said in (("nothing.json", "no such file"), ("moves.csv", "not valid JSON")):
        refused = bufferstand("compare", "old.json", name)
        assert refused.returncode == 2
        assert f"bufferstand: {name}: {said}" in refused.stderr


def test_runs_that_match(runs: list[Path]) -> None:
    Path("archive/foreign.h5").write_text("x")
    done = bufferstand("runs", "archive", "--where", "prestress == 30 and frequency > 1.2", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert "foreign.h5: no HDF5 file" in done.stderr
    found = json.loads(done.stdout)
    assert [run["frequency_Hz"] for run in found["runs"]] == [1.5, 2.0, 2.5]
    assert found["problems"] == [{"path": "archive/foreign.h5", "problem": "no HDF5 file"}]
    by_result = bufferstand("runs", "archive", "--where", "damping > 0.05 and measured_prestress < 45")
    assert by_result.returncode == 0, by_result.stderr
    assert "4 of 8 runs match" in by_result.stdout
    assert "measured_prestress_mm" in by_result.stdout
    plain = bufferstand("runs", "archive", "--no-cache")
    assert plain.stdout.count(".h5") == 8
    wrong = bufferstand("runs", "archive", "--where", "dampin > 0.05")
    assert wrong.returncode == 2
    assert wrong.stderr == "bufferstand: --where: column 1: unknown name “dampin”; did you mean “damping”?\n"


def test_no_uncertainty_is_said(runs: list[Path]) -> None:
    done = bufferstand("evaluate", runs[0], "--draws", "0", "--json", "-")
    (entry,) = json.loads(done.stdout)["runs"]
    assert entry["summary"]["damping"]["expanded_uncertainty"] is None
    assert entry["budget"] == []
    assert any("asked for none (0 draws)" in warning for warning in entry["warnings"])
    assert done.stderr == ""


def test_a_bar_on_a_terminal_only(runs: list[Path]) -> None:
    ours, its = pty.openpty()
    command = [
        sys.executable,
        "-P",
        "-m",
        "bufferstand",
        "evaluate",
        *map(str, runs),
        "--draws",
        "0",
        "--jobs",
        "1",
    ]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=its, env={**os.environ, "TERM": "xterm"}
    ) as process:
        os.close(its)
        shown = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            shown += part
        assert process.wait() == 0
    os.close(ours)
    assert "4/4" in shown.decode()
    assert bufferstand("evaluate", *runs, "--draws", "0").stderr == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["archive/*.xyz"], "the pattern matches no run file"),
        (["nowhere"], "nowhere: no such file or folder"),
        ([], "PATH: no run is named"),
        (["archive", "--table", "x.ods"], "x.ods: a table of kind “.ods” is not known"),
        (["archive", "--cluster", "tcp://127.0.0.1:9", "--jobs", "2"], "--jobs is for this machine"),
    ],
)
def test_refused_before_anything_starts(runs: list[Path], words: list[str], said: str) -> None:
    done = here("evaluate", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert said in done.stderr
