"""Run files in other programs' hands: HDF5's own tools, old libraries, NeXus readers."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run, write_run
from bufferstand.recording.runfile.layout import USER_BLOCK_BYTES
from bufferstand.recording.runfile.run import Run

from . import samples

NEEDS_TOOLS = pytest.mark.skipif(
    shutil.which("h5dump") is None, reason="h5dump is not installed (Debian: hdf5-tools)"
)
FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
SUPERBLOCK_OF_1_8 = 2


@pytest.fixture
def run(tmp_path: Path) -> Run:
    document = samples.metadata("run", status="complete") | {"notes": "Ω" * 200_000}  # beyond 64 KiB
    return open_run(
        write_run(tmp_path / "run.h5", document, samples.content(), samples.EVENTS, samples.ANCHORS)
    )


def items(path: Path) -> dict[str, Any]:
    """Return what is stored of every dataset, by its place."""
    found: dict[str, Any] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            plan = item.id.get_create_plist()
            filters = {plan.get_filter(number)[0] for number in range(plan.get_nfilters())}
            found[name] = (item.dtype, item.shape, filters)

    with h5py.File(path) as tree:
        tree.visititems(note)
    return found


def test_nothing_is_used_that_hdf5_1_8_cannot_read(run: Run) -> None:
    raw = run.path.read_bytes()
    assert raw[USER_BLOCK_BYTES : USER_BLOCK_BYTES + 8] == b"\x89HDF\r\n\x1a\n"
    assert raw[USER_BLOCK_BYTES + 8] == SUPERBLOCK_OF_1_8
    stored = items(run.path)
    assert len(stored) == 15
    for name, (dtype, shape, filters) in stored.items():
        assert dtype.kind in "iufS", name
        assert dtype.byteorder in "<|=", name
        assert len(shape) in (1, 2), name
        assert filters <= FILTERS, name


def test_texts_are_ascii_where_they_can_be(run: Run, tmp_path: Path) -> None:
    """Octave reads no file that labels a fixed-length text UTF-8."""
    with h5py.File(run.path) as tree:
        types = [h5py.check_string_dtype(tree[f"entry/events/{name}"].dtype) for name in ("kind", "text")]
    assert [label.encoding for label in types] == ["ascii", "utf-8"]
    again = open_run(run.path)
    assert [event.text for event in again.events] == ["waveform", "Überschreitung"]


@NEEDS_TOOLS
def test_hdf5s_own_tools_read_the_same_bytes(run: Run, tmp_path: Path) -> None:
    """h5dump of Debian is built on another version of the library than h5py."""
    dumped = subprocess.run(
        ["h5dump", "-d", "/entry/anchors/utc", str(run.path)], check=True, capture_output=True, text=True
    ).stdout
    assert all(f'"{anchor.utc}"' in dumped for anchor in samples.ANCHORS)
    numbers = {name: facts for name, facts in items(run.path).items() if facts[0].kind != "S"}
    assert len(numbers) == 11
    for name, (dtype, shape, _) in numbers.items():
        raw = tmp_path / "raw"
        raw.unlink(missing_ok=True)
        command = ["h5dump", "-d", f"/{name}", "-b", "LE", "-o", str(raw), str(run.path)]
        subprocess.run(command, check=True, capture_output=True)
        with h5py.File(run.path) as tree:
            ours = np.asarray(tree[name][()])
        assert np.array_equal(np.frombuffer(raw.read_bytes(), dtype).reshape(shape), ours), name


@NEEDS_TOOLS
def test_the_metadata_document_is_there_for_other_tools(run: Run) -> None:
    dumped = subprocess.run(
        ["h5dump", "-a", "/entry/controller/force/units", "-a", "/metadata", str(run.path)],
        check=True,
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
    ).stdout
    assert '(0): "count"' in dumped
    assert '"content_sha256":"' + run.sha256 in dumped.replace("\\", "")
    listed = subprocess.run(["h5ls", "-r", str(run.path)], check=True, capture_output=True, text=True).stdout
    assert "/entry/controller/force  Dataset {100}" in listed


def test_a_nexus_reader_finds_the_default_plot(run: Run) -> None:
    """NeXus: the chain of ``default`` ends at an NXdata whose signals and axes fit each other."""
    with h5py.File(run.path) as tree:
        assert tree.attrs["NX_class"] == "NXroot"
        entry = tree[tree.attrs["default"]]
        assert entry.attrs["NX_class"] == "NXentry"
        assert entry.attrs["default"] == "controller"
        for name in ("controller", "temperature_1"):
            data = entry[name]
            assert data.attrs["NX_class"] == "NXdata"
            axis = data.attrs["axes"]
            assert data.attrs[f"{axis}_indices"] == 0
            signals = [data.attrs["signal"], *data.attrs.get("auxiliary_signals", ())]
            document = json.loads(tree.attrs["metadata"])["streams"][name]
            assert signals == [channel["name"] for channel in document["channels"]]
            for signal in signals:
                assert data[signal].shape == data[axis].shape
                assert data[signal].attrs["units"]
        for item in (entry["events"], entry["anchors"]):
            assert item.attrs["NX_class"] == "NXcollection"
