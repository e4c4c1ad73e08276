"""What docs/run-file.md says is what is written."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bufferstand.recording.recorder import PROMISED_S, QUEUE_BLOCKS
from bufferstand.recording.runfile.document_format import FORMAT, FORMAT_VERSION
from bufferstand.recording.runfile.file import open_run, write_run

from . import samples

TEXT = (Path(__file__).parents[2] / "docs" / "run-file.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)


@pytest.fixture
def run_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    metadata = samples.metadata("run", status="complete")
    return write_run(tmp_path / "run.h5", metadata, samples.content(), samples.EVENTS, samples.ANCHORS)


def test_the_examples_run_and_agree(run_file: Path) -> None:
    with_software, with_h5py = BLOCKS
    ours: dict[str, Any] = {}
    plain: dict[str, Any] = {}
    exec(with_software, ours)
    exec(with_h5py, plain)
    assert ours["gaps"] == []
    assert len(ours["stroke"].value) == 100
    assert plain["force_kN"] == pytest.approx(ours["force"].value, rel=1e-14)
    assert plain["time_s"] == pytest.approx(ours["force"].time_s, abs=1e-12)


def test_every_object_and_key_is_documented(run_file: Path) -> None:
    names: set[str] = set()

    def note(name: str, item: Any) -> None:
        names.update(item.attrs)
        if isinstance(item, h5py.Dataset):
            names.add(name.rsplit("/", 1)[1])

    with h5py.File(run_file) as tree:
        names.update(tree.attrs)
        tree.visititems(note)
    document = open_run(run_file).metadata
    names |= set(document) | set(document["run"]) | set(document["streams"]["controller"])
    names |= set(document["streams"]["controller"]["channels"][0])
    names |= set(document["streams"]["controller"]["channels"][0]["uncertainty"])
    names |= set(document["datasets"]["entry/controller/force"])
    missing = {name for name in names if not re.search(rf"\b{name}\b", TEXT)}
    assert missing == set()


def test_figures_of_the_text(run_file: Path) -> None:
    assert f"**`{FORMAT}`, version {FORMAT_VERSION}**" in TEXT
    assert f"at most **{PROMISED_S * 1000:.0f} ms**" in TEXT
    assert f"beyond {QUEUE_BLOCKS} waiting ones" in TEXT
    head, hashed, *_ = run_file.read_bytes()[:512].decode().splitlines()
    assert head == "bufferstand/run 1"
    assert hashed.endswith(hashlib.sha256(run_file.read_bytes()[512:]).hexdigest())
    assert np.frombuffer(run_file.read_bytes()[512:520], "S8")[0] == b"\x89HDF\r\n\x1a\n"
