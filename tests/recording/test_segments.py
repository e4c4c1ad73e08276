"""A journal of several files reads as one, whatever happened to them."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.journal.file import JournalFile
from bufferstand.recording.journal.records import DataRecord, EndRecord, JournalEnd, Record
from bufferstand.recording.journal.segments import (
    ChainReader,
    SegmentedJournal,
    later_segments,
    segment_path,
)
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.seal_journal import DAMAGED_SUFFIX, seal, seal_orphans

from . import samples
from .test_writer import check_rows, record

SMALL = 4000
"""Bytes after which these tests begin a new file: one of five blocks or so."""


def data(number: int) -> DataRecord:
    stream, first, stamps, counts = samples.block(20 * number)
    return DataRecord(stream, first, 0, stamps, counts)


def sequences(records: list[Record]) -> list[int]:
    return [record.sequence for record in records if isinstance(record, DataRecord)]


def chain(directory: Path, blocks: int, *, ended: bool = True) -> Path:
    """Write a journal of small files, each block by itself; return its first file."""
    journal = SegmentedJournal(directory / "run-1.journal", "run-1", samples.metadata(), segment_bytes=SMALL)
    for number in range(blocks):
        journal.write([data(number)])
    if ended:
        journal.finish(EndRecord("complete", "", "2026-03-01T08:00:00+00:00"))
    journal.close()
    return directory / "run-1.journal"


def test_a_long_run_lies_in_several_files_and_is_sealed_as_one(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata(), sync_interval_s=0.001, segment_bytes=SMALL)
    written = 0
    with ChainReader(recorder.path) as viewer:
        seen: list[int] = []
        for number in range(60):
            record(recorder, 1, 20 * number)
            written += 20
            while recorder.written < written:
                pass
            seen += sequences(viewer.poll())
        assert seen == list(range(0, 1200, 20))  # each block once, across the files
        assert viewer.missing == 0
    assert len(later_segments(recorder.path)) > 5
    assert recorder.renewals == ()
    assert check_rows(recorder.close("complete"), 1200) == 1200
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.h5"]


def test_the_chain_says_how_it_ends(tmp_path: Path) -> None:
    found = samples.scan(chain(tmp_path, 23))
    assert sequences(found.records) == list(range(0, 460, 20))
    assert (found.stop, found.missing, found.more_follows) == (JournalEnd.ENDED, 0, False)


def test_records_written_again_count_once_wherever_the_first_file_breaks_off(tmp_path: Path) -> None:
    """The first file is given up with 4 blocks waiting; the kernel kept any part of them."""
    calls: list[int] = []

    def sync(handle: int) -> None:
        calls.append(handle)
        if len(calls) == 2:
            raise OSError(5, "Input/output error")
        os.fdatasync(handle)

    journal = SegmentedJournal(
        tmp_path / "run-1.journal",
        "run-1",
        samples.metadata(),
        journal_file=lambda path, header: JournalFile(path, header, fdatasync=sync),
    )
    journal.write([data(0), data(1)])
    journal.sync()
    acknowledged = journal.durable
    safe_bytes = journal._files[0].size
    for number in range(2, 6):
        journal.write([data(number)])
    whole_bytes = journal._files[0].size
    journal.sync()
    assert (journal.durable, len(journal.renewals)) == (120, 1)
    assert acknowledged == 40
    journal.write([data(6)])
    journal.finish(EndRecord("complete", "", "2026-03-01T08:00:00+00:00"))
    journal.close()
    first = tmp_path / "run-1.journal"
    content = first.read_bytes()
    dice = random.Random(7)
    for kept in [safe_bytes, whole_bytes, *(dice.randint(safe_bytes, whole_bytes) for _ in range(40))]:
        rest = dice.choice([b"", b"\0" * 100, dice.randbytes(100)])
        first.write_bytes(content[:kept] + rest)
        found = samples.scan(first)
        assert sequences(found.records) == list(range(0, 140, 20)), kept
        assert (found.stop, found.missing, found.more_follows) == (JournalEnd.ENDED, 0, False)


def test_a_damaged_file_in_the_middle_is_a_gap_that_is_said(tmp_path: Path) -> None:
    first = chain(tmp_path, 30)
    second = segment_path(first, 1)
    content = bytearray(second.read_bytes())
    content[len(content) // 2] ^= 1
    second.write_bytes(content)
    run = open_run(seal(first))
    assert run.status == "recovered"
    assert "run-1.journal.1: the record at byte" in run.reason
    assert "records are missing" in run.reason
    ((_, lost),) = run.gaps("controller")
    assert lost > 0
    assert run.streams["controller"].rows == 600 - lost
    assert sorted(path.name for path in tmp_path.iterdir() if DAMAGED_SUFFIX in path.name)[0] == (
        f"run-1{DAMAGED_SUFFIX}"
    )


@pytest.mark.parametrize("without_end", [False, True])
def test_cut_off_anywhere_the_chain_gives_a_beginning(tmp_path: Path, without_end: bool) -> None:
    first = chain(tmp_path, 30, ended=not without_end)
    files = [first, *later_segments(first)]
    contents = [path.read_bytes() for path in files]
    total = sum(map(len, contents))
    dice = random.Random(11)
    for cut in (dice.randint(len(contents[0]), total) for _ in range(60)):
        left = cut
        for path, content in zip(files, contents, strict=True):
            path.unlink(missing_ok=True)
            if left > 0:
                path.write_bytes(content[:left])
            left -= len(content)
        found = sequences(samples.scan(first).records)
        assert found == list(range(0, 20 * len(found), 20))


def test_killed_between_dropping_the_files_the_rest_is_cleared_away(tmp_path: Path) -> None:
    first = chain(tmp_path, 30)
    late = {path: path.read_bytes() for path in later_segments(first)[2:]}
    run_file = seal(first)
    sealed = run_file.read_bytes()
    for path, content in late.items():
        path.write_bytes(content)
    assert seal_orphans(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.h5"]
    assert run_file.read_bytes() == sealed


def test_a_foreign_file_in_the_chain_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    other = SegmentedJournal(
        tmp_path / "other" / "run-2.journal", "run-2", samples.metadata(), segment_bytes=SMALL
    )
    for number in range(10):
        other.write([data(number)])
    other.close()
    first = chain(tmp_path, 3, ended=False)
    segment_path(tmp_path / "other" / "run-2.journal", 1).rename(segment_path(first, 1))
    with pytest.raises(BadInput, match=r"run-1\.journal\.1.*no part of this run's journal"):
        seal(first)
