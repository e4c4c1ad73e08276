"""``evaluate``, ``report``, ``runs`` and ``verify`` by a Python for Windows, under Wine."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.other_systems.test_offline_half import MODEL, STATIC, command_here
from tests.other_systems.wine import WindowsPython, lacking, windows_path

pytestmark = [
    pytest.mark.long,
    pytest.mark.slow,
    pytest.mark.skipif(bool(lacking()), reason=f"needs {', '.join(lacking())}: Windows is not tried"),
]
ROUNDED = 1e-9
"""Libraries of two systems round sums in another order."""


@pytest.fixture(scope="module")
def windows(tmp_path_factory: pytest.TempPathFactory) -> WindowsPython:
    python = WindowsPython(tmp_path_factory.mktemp("windows"))
    python.make()
    return python


def _unlike(here: Any, there: Any, place: str = "") -> Iterator[str]:
    """Yield the places where two documents differ by more than rounding."""
    if isinstance(here, dict) and isinstance(there, dict):
        for key in sorted({*here, *there}):
            yield from _unlike(here.get(key), there.get(key), f"{place}/{key}")
    elif isinstance(here, list) and isinstance(there, list) and len(here) == len(there):
        for number, (one, other) in enumerate(zip(here, there, strict=True)):
            yield from _unlike(one, other, f"{place}/{number}")
    elif isinstance(here, float) and isinstance(there, float):
        if not math.isclose(here, there, rel_tol=ROUNDED, abs_tol=1e-15):
            yield f"{place}: {here} {there}"
    elif here != there:
        yield f"{place}: {here} {there}"


def test_figures_and_reports_of_windows_are_those_of_linux(windows: WindowsPython, tmp_path: Path) -> None:
    folder = tmp_path / "a folder"
    folder.mkdir()
    (folder / "static.h5").write_bytes(STATIC.read_bytes())
    done = windows.run("evaluate", "--no-cache", "static.h5", "--json", "windows.json", where=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    command_here("evaluate", "--no-cache", "static.h5", "--json", "linux.json", where=folder)
    documents = [json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ("linux", "windows")]
    for document in documents:
        del document["software"]
    assert list(_unlike(*documents)) == []
    done = windows.run("report", "static.h5", "--out", "report", "--table", "report.xlsx", where=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    (pdf,) = (folder / "report").glob("*.pdf")
    assert command_here("verify", pdf, "--runs", folder, where=folder).returncode == 0
    assert windows.run("verify", "static.h5", where=folder).returncode == 0


def test_foreign_record_is_imported_evaluated_and_compared_with_a_model(
    windows: WindowsPython, tmp_path: Path
) -> None:
    record = windows_path(ROOT / "sample_runs" / "records" / "harmonic.csv")
    assert windows.run("import", record, "--out", "runs", where=tmp_path).returncode == 0
    (tmp_path / "runs" / "static.h5").write_bytes(STATIC.read_bytes())
    # One process: a pool of Python's own does not come to an end under Wine 8, whatever it is to do.
    done = windows.run("evaluate", "runs", "--jobs", 1, "--no-cache", where=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    done = windows.run("model", "compare", windows_path(MODEL), "runs", where=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]


def test_stand_half_is_refused(windows: WindowsPython, tmp_path: Path) -> None:
    refused = windows.run("run", "x.toml", "--out", "y", where=tmp_path)
    assert refused.returncode == 2
    assert "“run” needs Linux" in refused.stderr
