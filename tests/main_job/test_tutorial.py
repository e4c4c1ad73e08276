"""The tutorial, typed in by a machine: every command works, and prints what the page shows."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from tests.docs.console import Change, Command, Write, differs, steps_of

ROOT = Path(__file__).resolve().parents[2]


def typed(line: str, folder: Path, last_status: int) -> subprocess.CompletedProcess[str]:
    """Do what a shell does with a line of the tutorial."""
    if line == "echo $?":
        return subprocess.CompletedProcess(line, 0, f"{last_status}\n")
    program, *words = shlex.split(line)
    assert program == "bufferstand", line
    return subprocess.run(
        [sys.executable, "-P", "-m", "bufferstand", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        check=False,
    )


def test_the_tutorial_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "sample_runs", tmp_path / "sample_runs")
    steps = steps_of(ROOT / "docs" / "tutorial.md")
    status, asked, done = 0, False, 0
    for number, step in enumerate(steps):
        if isinstance(step, Write):
            (tmp_path / step.file).write_text(step.text, encoding="utf-8")
        elif isinstance(step, Change):
            text = (tmp_path / step.file).read_text(encoding="utf-8")
            assert text.count(step.old) == 1, step
            (tmp_path / step.file).write_text(text.replace(step.old, step.new), encoding="utf-8")
        else:
            result = typed(step.line, tmp_path, status)
            status = result.returncode
            following = steps[number + 1] if number + 1 < len(steps) else None
            asked = isinstance(following, Command) and following.line == "echo $?"
            assert status == 0 or asked, f"{step.line}\n{result.stdout}"
            problem = differs(step.shows, result.stdout.splitlines())
            assert problem is None, f"{step.line}: {problem}\n{result.stdout}"
            done += 1
    assert done >= 7, "the page has lost its consoles"
    assert (tmp_path / "first" / "report" / "first-report.pdf").stat().st_size > 10_000
