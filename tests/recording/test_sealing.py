"""Sealing takes the same memory however long the run is, and a failing disk never takes the process down."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import fitting_heads, open_run
from bufferstand.recording.runfile.hdf5_file import TreeFile
from bufferstand.recording.runfile.layout import DatasetColumn, TreeWriter, user_block
from bufferstand.recording.sealing.journal_outline import outline, values_of
from bufferstand.recording.sealing.seal_journal import seal
from bufferstand.recording.sealing.verification import verify
from bufferstand.recording.whole_files import Pwrite

from . import samples
from .test_writer import ROOT, check_rows, record


def peak_memories(folder: Path, megabytes: int) -> tuple[float, float, float]:
    """Seal and verify in a process; return its peak memory [MB] before, after sealing, after both."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.recording.long_child", str(folder), str(megabytes)],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    before, sealed, verified, size, findings = map(float, done.stdout.split())
    assert size > 0.25 * megabytes
    assert findings == 1  # the stream that never delivered
    return before, sealed, verified


@pytest.mark.slow
def test_sealing_does_not_hold_the_run_in_memory(tmp_path: Path) -> None:
    before, sealed, verified = peak_memories(tmp_path, 80)
    assert sealed - before < 90.0
    assert verified - sealed < 20.0


@pytest.mark.long
def test_two_gigabytes_are_sealed_under_500_megabytes(tmp_path: Path) -> None:
    before, sealed, verified = peak_memories(tmp_path, 2100)
    assert max(before, sealed, verified) < 500.0


def journal_of(folder: Path, blocks: int = 40) -> Path:
    recorder = RunRecorder(folder, "run-1", samples.metadata())
    record(recorder, blocks)
    journal = recorder.path
    while recorder.durable < 20 * blocks:
        pass
    content = journal.read_bytes()
    recorder.close("complete").unlink()
    journal.write_bytes(content)
    return journal


def write_through(journal: Path, file: TreeFile) -> None:
    """Do what sealing does, on a given file."""
    content = outline(journal)
    assert content.header is not None
    held = {name: tuple(stream.dtypes) for name, stream in content.streams.items()}
    heads = fitting_heads(content.header["metadata"], held, journal)
    with file:
        with TreeWriter(file, content.columns(heads)) as tree:
            for place, values in values_of(journal, content):
                tree.append(place, values)
            tree.finish(content.header["metadata"], heads)
        file.keep(user_block(file.path))


def failure_of(journal: Path, target: Path, pwrite: Pwrite) -> OSError | None:
    try:
        write_through(journal, TreeFile(target, pwrite=pwrite))
    except OSError as error:
        return error
    return None


@pytest.mark.slow
def test_a_write_that_fails_anywhere_is_told_and_nothing_is_left(tmp_path: Path) -> None:
    """HDF5 itself would crash the interpreter at its end (h5py issue 914)."""
    journal = journal_of(tmp_path)
    target = tmp_path / "run-1.h5.tmp"
    number = 0
    while True:
        calls = [0]

        def failing(
            handle: int, data: bytes | memoryview, offset: int, calls: list[int] = calls, last: int = number
        ) -> int:
            calls[0] += 1
            if calls[0] > last:
                raise OSError(errno.EIO, "Input/output error")
            return os.pwrite(handle, data, offset)

        failure = failure_of(journal, target, failing)
        if failure is None:
            break
        assert failure.errno == errno.EIO
        assert not target.exists()
        number += 1
    assert number > 15
    assert not any(finding.level == "fault" for finding in verify(target))


def test_a_disk_without_room_refuses_before_anything_is_written(tmp_path: Path) -> None:
    journal = journal_of(tmp_path)
    target = tmp_path / "run-1.h5.tmp"

    def full(handle: int, offset: int, length: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        write_through(journal, TreeFile(target, fallocate=full))
    assert not target.exists()


def test_short_writes_under_hdf5_lose_nothing(tmp_path: Path) -> None:
    journal = journal_of(tmp_path)
    target = tmp_path / "short.h5"
    write_through(journal, TreeFile(target, pwrite=lambda h, data, at: os.pwrite(h, bytes(data)[:700], at)))
    assert not any(finding.level == "fault" for finding in verify(target))
    assert open_run(target).series("force").value.tobytes() == (
        open_run(seal(journal)).series("force").value.tobytes()
    )


def test_what_hdf5_would_be_given_wrongly_is_refused(tmp_path: Path) -> None:
    column = DatasetColumn("entry/x", np.dtype("<i4"), (3,), None)
    with (
        TreeFile(tmp_path / "x") as file,
        pytest.raises(ValueError, match="more rows"),
        TreeWriter(file, [column]) as tree,
    ):
        tree.append("entry/x", np.arange(4))
    with TreeFile(tmp_path / "x") as file, TreeWriter(file, [column]) as tree:
        tree.append("entry/x", np.arange(2))
        with pytest.raises(ValueError, match="fewer rows"):
            tree.finish({}, {})
    assert list(tmp_path.iterdir()) == []


def test_a_run_over_many_chunks_and_files_is_sealed_to_the_last_sample(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata(), segment_bytes=1 << 20)
    for first in range(0, 300_000, 3_000):
        recorder.append(*samples.block(first, 3_000))
    path = recorder.close("complete")
    assert check_rows(path, 300_000) == 300_000
    assert [finding.text for finding in verify(path)] == ["not one sample was recorded"]
