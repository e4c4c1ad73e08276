"""The README, followed to the letter: every command of it works, in its order, in an empty folder."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"


def commands() -> list[list[str]]:
    """Return the lines that begin with ``bufferstand`` in the page's consoles, without their comments."""
    blocks = re.findall(r"^```\n(.*?)^```$", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return [
        shlex.split(line, comments=True)
        for block in blocks
        for line in block.splitlines()
        if line.startswith("bufferstand ")
    ]


def test_it_is_short_and_its_pictures_are_there() -> None:
    text = README.read_text(encoding="utf-8")
    assert text.count("\n") < 120
    pictures = re.findall(r'<img src="([^"]+)"', text)
    assert len(pictures) == 2
    for picture in pictures:
        assert 10_000 < (ROOT / picture).stat().st_size < 200_000


def test_every_command_works_as_written(tmp_path: Path) -> None:
    shutil.copy(ROOT / "sample_runs" / "records" / "harmonic.csv", tmp_path / "record.csv")
    for program, *words in commands():
        assert program == "bufferstand"
        done = subprocess.run(
            [sys.executable, "-P", "-m", "bufferstand", *words],
            cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    for made in ("evaluation.json", "cycles.xlsx", "spring.toml", "buffer.fmu", "report/campaign-report.pdf"):
        assert (tmp_path / made).stat().st_size > 1000, made
