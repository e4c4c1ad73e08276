"""Verifying finds every altered bit and says what a recording lacks; the catalogue lists what there is."""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import h5py
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Segment, StreamContent
from bufferstand.recording.finding.run_facts import list_runs
from bufferstand.recording.runfile import reading_apart as apart
from bufferstand.recording.runfile.file import open_run, write_run
from bufferstand.recording.sealing.verification import verify

from . import samples


def written(path: Path, **run: str) -> Path:
    metadata = samples.metadata(path.stem, **({"status": "complete"} | run))
    return write_run(path, metadata, samples.content(), samples.EVENTS, samples.ANCHORS)


def test_a_whole_run_has_no_findings(tmp_path: Path) -> None:
    assert verify(written(tmp_path / "run-1.h5")) == []


@pytest.mark.slow
def test_every_flipped_bit_is_found_and_none_gives_other_values(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    good = path.read_bytes()
    force = open_run(path).series("force").value.tobytes()
    dice = random.Random(20)
    bits = [*(dice.randrange(8 * len(good)) for _ in range(6)), *range(0, 8 * 90, 183)]
    for bit in bits:
        path.chmod(0o644)
        path.write_bytes(good)
        samples.flipped(path, bit)
        if 8 * good.index(b"check:") <= bit < 8 * 512:
            continue  # the remark in the user block, and its padding, say nothing
        findings = verify(path)
        assert any(finding.level == "fault" for finding in findings), bit
        with contextlib.suppress(BadInput):
            assert open_run(path).series("force").value.tobytes() == force, bit
    path.write_bytes(good)
    assert verify(path) == []


def test_an_altered_dataset_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "run-1.h5")
    path.chmod(0o644)
    with h5py.File(path, "r+") as tree:
        tree["entry/controller/stroke_1"][3] = 9
        tree["entry/more"] = [1.0]
    places = {finding.place for finding in verify(path)}
    assert places == {"entry/controller/stroke_1", "entry/more", "file"}


def test_what_a_recording_lacks_is_a_note(tmp_path: Path) -> None:
    full = samples.content()["controller"]
    stamps = full.time.copy()
    stamps[50] = stamps[49]
    stream = StreamContent(stamps, full.counts, (Segment(0, 0, 0), Segment(40, 43, 3)))
    metadata = samples.metadata(status="recovered", reason="power cut")
    path = write_run(tmp_path / "run-1.h5", metadata, {"controller": stream})
    findings = verify(path)
    assert {finding.level for finding in findings} == {"note"}
    assert [finding.text for finding in findings] == [
        "recovered: power cut",
        "1 gap(s), 3 sample(s) lost; the first after row 39",
        "1 time stamp(s) do not advance, the first after row 49",
        "not one sample was recorded",
    ]


@pytest.mark.slow
def test_verify_refuses_what_is_no_run(tmp_path: Path) -> None:
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as tree:
        tree["x"] = 1
    with pytest.raises(BadInput, match="not a run file"):
        verify(path)
    with pytest.raises(BadInput, match="cannot be read: No such file"):
        verify(tmp_path / "none.h5")
    path.write_bytes(b"rubbish")
    assert [finding.level for finding in verify(path)] == ["fault"]


def test_catalogue_lists_all_and_says_which_are_damaged(tmp_path: Path) -> None:
    (tmp_path / "deep" / "er").mkdir(parents=True)
    written(tmp_path / "a.h5", status="stopped")
    written(tmp_path / "deep" / "er" / "b.h5")
    (tmp_path / "deep" / "c.h5").write_bytes(b"rubbish")
    a, b, c = list_runs(tmp_path)
    assert (a.id, a.status, a.kind, a.specimen_id, a.step) == ("a", "stopped", "harmonic", "B-17", "sine")
    assert (a.prestress_mm, a.amplitude_mm, a.frequency_Hz) == (40.0, 10.0, 1.5)
    assert a.started_utc == "2026-03-01T08:00:00+00:00"
    assert (b.path.name, b.problem) == ("c.h5", c.problem) or b.path.name == "c.h5"
    assert b.problem is not None
    assert "no HDF5 file" in b.problem
    assert c.id == "b"
    assert list_runs(tmp_path / "a.h5") == [a]
    with pytest.raises(BadInput, match="no such file or folder"):
        list_runs(tmp_path / "none")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match="no run file"):
        list_runs(tmp_path / "empty")


@pytest.mark.slow
def test_damage_on_which_hdf5_never_ends_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Texts of attributes lie in a heap without check sum: the length of its last is wrong in a bit."""
    path = written(tmp_path / "run-1.h5")
    data = bytearray(path.read_bytes())
    data[data.rindex(b"NXcollection") - 8] ^= 4
    path.chmod(0o644)
    path.write_bytes(data)
    monkeypatch.setattr(apart, "LEAST_S", 1.0)
    monkeypatch.setattr(apart, "WALL_RATIO", 100)  # where others keep the processors busy
    (finding,) = verify(path)
    assert finding.level == "fault"
    assert "damaged: HDF5 does not come to an end with it" in finding.text
    with pytest.raises(BadInput, match=r"run-1\.h5: damaged: HDF5 does not come.*; restore the file"):
        open_run(path)


def test_a_file_whose_reading_crashes_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that looks into it dies; this one, and the evaluation of the other files, does not."""
    path = written(tmp_path / "run-1.h5")
    site = tmp_path / "sitecustomize.py"
    only_there = "import os, sys\nif 'bufferstand.recording.runfile.reader_process' in sys.orig_argv: "
    site.write_text(f"{only_there}os.kill(os.getpid(), 11)\n")
    monkeypatch.syspath_prepend(tmp_path)
    reader = apart.ReaderProcess()
    monkeypatch.setattr(apart, "READER", reader)
    with pytest.raises(BadInput, match=r"damaged: HDF5 crashes on it \(SIGSEGV\)"):
        open_run(path)
    site.write_text(f"{only_there}os._exit(9)\n")
    with pytest.raises(BadInput, match=r"damaged: it cannot be looked into \(status 9\)"):
        open_run(path)
    site.unlink()
    assert open_run(path).id == "run-1"
    reader.close()


def test_one_process_reads_all_files_and_one_that_was_killed_is_replaced(tmp_path: Path) -> None:
    reader = apart.READER
    path = written(tmp_path / "run-1.h5")
    assert open_run(path).id == "run-1"
    first = reader._process
    assert first is not None
    assert open_run(written(tmp_path / "run-2.h5")).id == "run-2"
    assert reader._process is first
    first.kill()
    assert open_run(path).id == "run-1"
    assert reader._process is not first


def test_a_path_is_that_of_the_process_that_asks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for place in ("a", "b"):
        (tmp_path / place).mkdir()
        written(tmp_path / place / "run.h5", operator=place)
        monkeypatch.chdir(tmp_path / place)
        for path in (Path("run.h5"), Path("/proc/self/cwd/run.h5")):
            assert open_run(path).metadata["run"]["operator"] == place


@pytest.mark.slow
def test_a_rewritten_file_with_the_same_contents_opens(tmp_path: Path) -> None:
    """As h5repack does it, from another folder than that of the code."""
    path = written(tmp_path / "run-1.h5")
    with h5py.File(path) as old, h5py.File(tmp_path / "new.h5", "w") as new:
        new.attrs.update(old.attrs)
        old.copy("entry", new)
    assert open_run(tmp_path / "new.h5").series("force").value.tolist() == (
        open_run(path).series("force").value.tolist()
    )
    assert [finding.place for finding in verify(tmp_path / "new.h5")] == ["file"]
