"""What the pages of evaluation and of archives have their reader type does what they say."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
RUNS = ROOT / "sample_runs" / "runs"
MODULE = re.compile(r"python -m (tests[\w.]+|benchmarks)")
PLACE = re.compile(r"`(tests/[\w/]+(?:\.py)?)`")
PAGES = (
    *(DOCS / "evaluation").glob("*.md"),
    *(
        DOCS / f"{name}.md"
        for name in ("evaluation", "plausibility", "imperfect-records", "stroke", "archives")
    ),
)


def blocks(page: str, language: str) -> list[str]:
    """Return the code blocks of a page in one language ('' for commands)."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_example_in_python_evaluates_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = blocks("evaluation.md", "python")
    (tmp_path / "campaign").mkdir()
    shutil.copy(next(RUNS.glob("003-*.h5")), tmp_path / "campaign")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(example, names)
    document = names["document"]
    assert isinstance(document, dict)
    (run,) = document["runs"]
    assert 0.2 < run["summary"]["damping"]["value"] < 0.25
    assert run["summary"]["damping"]["expanded_uncertainty"] > 0.0


@pytest.mark.slow
def test_the_commands_of_the_page_of_archives_run_in_their_order(tmp_path: Path) -> None:
    folder = tmp_path / "archive" / "2026-11" / "first"
    folder.mkdir(parents=True)
    for number in ("001", "003", "007"):
        shutil.copy(next(RUNS.glob(f"{number}-*.h5")), folder)
    (tmp_path / "last").touch()
    os.utime(tmp_path / "last", (0, 0))
    environment = {
        **os.environ,
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "PYTHONPATH": str(ROOT),
        "PYTHON": sys.executable,
    }
    ran = {}
    for line in "".join(blocks("archives.md", "")).splitlines():
        command = f'bufferstand() {{ "$PYTHON" -P -m bufferstand "$@"; }}; {line}'
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, (line, done.stderr)
        ran[line] = done.stdout
    assert len(ran) == 9
    for name in ("cycles.csv", "runs.csv", "cycles.parquet", "before.json", "after.json", "moves.csv"):
        assert (tmp_path / name).stat().st_size > 0, name
    for name in ("evaluations-3.sqlite", "runs-3.sqlite"):
        assert (tmp_path / "cache" / "bufferstand" / name).exists()
        assert f"`{name}`" in (DOCS / "archives.md").read_text(encoding="utf-8")
    compared = next(out for line, out in ran.items() if line.startswith("bufferstand compare"))
    assert "moving_mass_kg: none → 150.0" in compared
    found = json.loads(next(out for line, out in ran.items() if line.endswith("--json -")))
    assert "003" in json.dumps(found)
    assert "001-static" not in json.dumps(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_test_and_study_that_a_page_names_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = {name.replace(".", "/") for name in MODULE.findall(text)} | set(PLACE.findall(text))
    missing = [name for name in named if not ((ROOT / name).exists() or (ROOT / f"{name}.py").exists())]
    assert missing == []
