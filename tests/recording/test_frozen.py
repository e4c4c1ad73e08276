"""Run files of every format version so far open, verify and evaluate as on the day they were frozen.

``frozen/README.md`` says how each was made. A new format version gets a folder of its own; nothing in the
others is ever changed.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.recording.runfile.document_format import FORMAT_VERSION
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify

FROZEN = Path(__file__).parent / "frozen"
FILES = sorted(FROZEN.rglob("*.h5"))
FIGURES = (
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
    "secant_stiffness_kN_per_mm",
    "loss_factor",
    "stroke_min_mm",
    "stroke_max_mm",
    "force_max_kN",
    "frequency_Hz",
)
ESTIMATOR = 2e-3
"""By how much a better estimator may move a figure; a delay or a scale misread moves it by more."""


def reading_of(path: Path) -> dict[str, Any]:
    """Return what reading a file must give for ever: identity, every channel's numbers, gaps, events."""
    run = open_run(path)
    channels = {}
    for stream in run.streams.values():
        for name in stream.channels:
            series = run.series(name)
            known = series.value[np.isfinite(series.value)]
            channels[name] = {
                "unit": series.unit,
                "rows": len(series.value),
                "missing": len(series.value) - len(known),
                "first": float(known[0]),
                "last": float(known[-1]),
                "sum": float(known.sum()),
                "sum_of_squares": float((known**2).sum()),
                "first_time_s": float(series.time_s[0]),
                "last_time_s": float(series.time_s[-1]),
            }
    return {
        "format_version": run.metadata["format_version"],
        "sha256": run.sha256,
        "kind": run.kind,
        "status": run.status,
        "operator": run.metadata["run"]["operator"],
        "specimen": run.specimen.get("id"),
        "channels": channels,
        "gaps": {name: run.gaps(name) for name in run.streams},
        "events": [[event.kind, event.text, event.time_s] for event in run.events],
    }


def evaluation_of(path: Path) -> list[dict[str, Any]]:
    """Return the frozen figures of every cycle."""
    (entry,) = evaluate_paths([path], Options(draws=50))["runs"]
    return [
        {"complete": cycle["complete"], **{name: cycle[name] for name in FIGURES}}
        for cycle in entry["cycles"]
    ]


def assert_same(found: Any, wanted: Any, relative: float, place: str) -> None:
    """Compare like with like, numbers within a relative tolerance."""
    if isinstance(wanted, dict):
        assert found.keys() == wanted.keys(), place
        for key, value in wanted.items():
            assert_same(found[key], value, relative, f"{place}.{key}")
    elif isinstance(wanted, list):
        assert len(found) == len(wanted), place
        for number, value in enumerate(wanted):
            assert_same(found[number], value, relative, f"{place}[{number}]")
    elif isinstance(wanted, float):
        assert found == pytest.approx(wanted, rel=relative, abs=1e-9), place
    else:
        assert found == wanted, place


@pytest.fixture(params=FILES, ids=[f"{path.parent.name}/{path.stem}" for path in FILES])
def frozen(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, dict[str, Any]]:
    path: Path = request.param
    copy = Path(shutil.copy(path, tmp_path / path.name))
    return copy, json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))


def test_every_format_version_is_frozen() -> None:
    versions = {path.parent.name for path in FILES}
    assert versions == {f"format-{number}" for number in range(1, FORMAT_VERSION + 1)}
    assert sum(path.stat().st_size for path in FILES) < 400_000
    notes = (FROZEN / "README.md").read_text(encoding="utf-8")
    assert all(f"{path.parent.name}/{path.name}" in notes for path in FILES)


def test_it_is_read_as_on_its_first_day(frozen: tuple[Path, dict[str, Any]]) -> None:
    path, wanted = frozen
    assert [finding.text for finding in verify(path) if finding.level == "fault"] == []
    assert_same(json.loads(json.dumps(reading_of(path))), wanted["reading"], 1e-12, path.stem)


def test_it_is_evaluated_as_on_its_first_day(frozen: tuple[Path, dict[str, Any]]) -> None:
    path, wanted = frozen
    assert_same(evaluation_of(path), wanted["evaluation"], ESTIMATOR, path.stem)


@pytest.mark.slow
def test_a_repacked_copy_is_read_alike(frozen: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    if shutil.which("h5repack") is None:
        pytest.skip("h5repack is not installed (Debian: hdf5-tools)")
    path, wanted = frozen
    copy = tmp_path / "repacked.h5"
    subprocess.run(["h5repack", str(path), str(copy)], check=True, capture_output=True)
    reading = json.loads(json.dumps(reading_of(copy)))
    assert_same(reading, wanted["reading"], 1e-12, path.stem)


def test_plain_h5py_and_the_document_suffice(frozen: tuple[Path, dict[str, Any]]) -> None:
    """The recipe of docs/run-file.md, without this software: polynomial of the raw numbers."""
    path, wanted = frozen
    with h5py.File(path) as tree:
        document = json.loads(tree.attrs["metadata"])
        for name, stream in document["streams"].items():
            for channel in stream["channels"]:
                counts = tree[f"entry/{name}/{channel['name']}"][()].astype(float)
                coefficients = channel["calibration"]["coefficients"]
                value = np.polynomial.polynomial.polyval(counts, coefficients)
                total = float(np.nansum(value))
                expected = wanted["reading"]["channels"][channel["name"]]["sum"]
                assert total == pytest.approx(expected, rel=1e-9), channel["name"]
