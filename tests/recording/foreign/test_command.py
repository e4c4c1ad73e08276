"""``bufferstand import`` as a user runs it: decisions and warnings on standard error, run files out."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from . import makers


def bufferstand(folder: Path, *words: str, piped: str | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", "import", *words],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=folder,
        input=piped,
    )


def test_what_was_decided_is_shown(tmp_path: Path) -> None:
    makers.csv_units_row(tmp_path / "units.csv")
    makers.tdms(tmp_path / "rig.tdms")
    done = bufferstand(
        tmp_path, "units.csv", "rig.tdms", "--out", "runs", "--invert", "stroke", "--kind", "harmonic"
    )
    assert done.returncode == 0
    assert done.stdout.splitlines() == ["units.csv -> runs/units.h5", "rig.tdms -> runs/rig.h5"]
    said = done.stderr.splitlines()
    assert said[0] == (
        "units.csv: text, UTF-8, separator “;”, decimal sign “.”, headers in line 4, units in line 5, "
        "time from column, 2001 rows"
    )
    assert "  stroke_1      <- “stroke” in mm (unit: units row), sign turned" in said
    assert "warning: units.csv: stroke_1: mostly negative, and compression is positive here" in done.stderr
    assert "rig.tdms: TDMS, groups “Rig”, “Slow”, time from waveform (wf_increment), 2001 rows" in said
    assert "  force         <- “Rig/force” in kN (unit: unit_string)" in said


@pytest.mark.slow
def test_one_bad_file_does_not_stop_the_others(tmp_path: Path) -> None:
    makers.csv_comma(tmp_path / "good.csv")
    (tmp_path / "bad.csv").write_text("time [s],stroke [mm],force [kN]\n0,1,2\n1,x,3\n")
    (tmp_path / "lab.toml").write_text('kind = "harmonic"\n')
    done = bufferstand(tmp_path, "bad.csv", "good.csv", "--out", "runs", "--mapping", "lab.toml")
    assert done.returncode == 2
    assert done.stdout == "good.csv -> runs/good.h5\n"
    assert "bufferstand: bad.csv: line 3, column 2 “stroke [mm]”: “x” is no number" in done.stderr
    assert "1 of 2 files could not be imported" in done.stderr
    assert "Traceback" not in done.stderr
    salvaged = bufferstand(tmp_path, "bad.csv", "--out", "runs", "--mapping", "lab.toml", "--salvage")
    assert salvaged.returncode == 0
    assert "warning: bad.csv: 1 cell(s) that are no number, taken as no value" in salvaged.stderr


@pytest.mark.slow
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path) -> None:
    """A pipe cannot be read twice, and one that nobody writes to would be waited for."""
    os.mkfifo(tmp_path / "pipe.csv")
    table = makers.csv_comma(tmp_path / "good.csv").read_text()
    for name in ("pipe.csv", "/dev/stdin", "/dev/null"):
        done = bufferstand(tmp_path, name, "--out", "runs", piped=table)
        assert done.returncode == 2
        assert done.stderr == f"bufferstand: {name}: is no regular file; save it as a file first\n"
    folder = bufferstand(tmp_path, ".", "--out", "runs")
    assert folder.stderr == "bufferstand: .: cannot be read: Is a directory; check the path\n"
    assert not (tmp_path / "runs").exists()
