"""Several files of one journal: what is acknowledged, when a new one begins, what is said of holes."""

from __future__ import annotations

import errno
import zlib
from pathlib import Path
from typing import Any

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Event
from bufferstand.recording.journal import segments
from bufferstand.recording.journal.file import JournalFile
from bufferstand.recording.journal.records import DataRecord, EndRecord, JournalEnd, JournalReader
from bufferstand.recording.journal.segments import (
    ChainReader,
    SegmentedJournal,
    later_segments,
    segment_path,
)

from . import samples

ROWS = 20
END = EndRecord("complete", "", "2026-03-01T08:00:00+00:00")


def data(number: int, stream: str = "") -> DataRecord:
    name, first, stamps, counts = samples.block(ROWS * number)
    return DataRecord(stream or name, first, 0, stamps, counts)


class Disk:
    """Makes files whose next calls can be told to fail."""

    def __init__(self) -> None:
        self.failing: set[str] = set()
        self.made: list[Path] = []

    def make(self, path: Path, header: bytes) -> JournalFile:
        disk = self
        if "make" in self.failing:
            raise BadInput("cannot record here", file=path)

        class File(JournalFile):
            def append(self, frames: bytes) -> None:
                disk.fail("append")
                super().append(frames)

            def sync(self) -> None:
                disk.fail("sync")

            def finish(self) -> None:
                disk.fail("finish")
                super().finish()

        self.made.append(path)
        return File(path, header)

    def fail(self, what: str) -> None:
        if what in self.failing:
            if f"{what} once" in self.failing:
                self.failing -= {what, f"{what} once"}
            raise OSError(errno.EIO, f"{what} failed")


def journal(folder: Path, disk: Disk, **options: Any) -> SegmentedJournal:
    return SegmentedJournal(
        folder / "run-1.journal", "run-1", samples.metadata(), journal_file=disk.make, **options
    )


def read(folder: Path) -> tuple[list[int], ChainReader]:
    """Return the numbers of the blocks that are read, and the reader."""
    with ChainReader(folder / "run-1.journal") as reader:
        found = reader.poll()
    return [one.sequence // ROWS for one in found if isinstance(one, DataRecord)], reader


def test_files_of_a_run_are_counted_behind_its_name(tmp_path: Path) -> None:
    first = tmp_path / "r.journal"
    assert [segment_path(first, number).name for number in (0, 1, 12)] == [
        "r.journal",
        "r.journal.1",
        "r.journal.12",
    ]
    for name in ("r.journal", "r.journal.10", "r.journal.9", "r.journal.x", "r.journal.²", "r.journal.1.tmp"):
        (tmp_path / name).touch()
    assert [path.name for path in later_segments(first)] == ["r.journal.9", "r.journal.10"]
    assert (segments.SEGMENT_BYTES, segments.BATCH_BYTES) == (1024**3, 4 * 1024**2)


def test_only_samples_of_the_leading_stream_are_counted(tmp_path: Path) -> None:
    written = journal(tmp_path, Disk())
    assert (written.written, written.durable, written.renewals) == (0, 0, [])
    written.write([data(0), data(0, "temperature_1"), Event(1.0, "note", "t")])
    assert (written.written, written.durable) == (ROWS, 0)
    written.sync()
    assert (written.written, written.durable) == (ROWS, ROWS)
    written.sync()
    assert written.durable == ROWS
    written.close()


def test_a_record_that_cannot_be_framed_leaves_none_of_those_with_it(tmp_path: Path) -> None:
    written = journal(tmp_path, Disk())
    written.write([data(0)])
    with pytest.raises(TypeError):
        written.write([data(1), Event(1.0, "note", "t", {"x": object()})])
    written.write([data(2)])
    assert written.written == 2 * ROWS
    written.finish(END)
    written.close()
    assert read(tmp_path)[0] == [0, 2]


def test_a_write_that_fails_counts_nothing_and_the_next_goes_on(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk)
    disk.failing = {"append", "append once"}
    with pytest.raises(OSError, match="append failed"):
        written.write([data(0)])
    assert written.written == 0
    written.write([data(1)])
    written.write([])
    written.finish(END)
    assert (written.written, written.durable) == (ROWS, ROWS)
    written.close()
    found, reader = read(tmp_path)
    assert (found, reader.stop, reader.missing) == ([1], JournalEnd.ENDED, 0)


def test_a_file_that_has_reached_its_size_is_followed_by_another(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk, segment_bytes=1)
    written.write([data(0)])
    assert [path.name for path in disk.made] == ["run-1.journal", "run-1.journal.1"]
    assert written.durable == ROWS, "the file before was ended on the disk"
    written.close()
    exact = Disk()
    size = disk.made[0].stat().st_size
    (tmp_path / "b").mkdir()
    other = journal(tmp_path / "b", exact, segment_bytes=size)
    other.write([data(0)])
    assert len(exact.made) == 2, "just that size is enough"
    other.close()
    (tmp_path / "c").mkdir()
    larger = Disk()
    other = journal(tmp_path / "c", larger, segment_bytes=size + 1)
    other.write([data(0)])
    assert len(larger.made) == 1
    other.close()


def test_where_no_next_file_can_be_made_the_present_one_grows_to_twice_the_size(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk, segment_bytes=3000)
    disk.failing = {"make"}
    number = 0
    while written.durable == 0:
        written.write([data(number)])
        number += 1
    disk.failing = set()
    size = (tmp_path / "run-1.journal").stat().st_size
    while len(disk.made) == 1:
        written.write([data(number)])
        number += 1
    grown = (tmp_path / "run-1.journal").stat().st_size
    assert 3000 <= size < 4000
    assert 6000 <= grown < 7000
    written.finish(END)
    written.close()
    assert read(tmp_path)[0] == list(range(number))


def test_a_file_that_cannot_be_ended_is_given_up_for_the_next(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk, segment_bytes=1)
    disk.failing = {"finish", "finish once"}
    written.write([data(0)])
    assert written.renewals == ["[Errno 5] finish failed"]
    assert written.durable == ROWS
    assert len(disk.made) == 2
    written.finish(END)
    written.close()
    found, reader = read(tmp_path)
    assert (found, reader.missing, reader.stop) == ([0], 0, JournalEnd.ENDED)


def test_after_a_failed_sync_what_is_not_acknowledged_is_written_again(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk)
    written.write([data(0)])
    written.sync()
    written.write([data(1), data(2)])
    disk.failing = {"sync", "sync once"}
    written.sync()
    assert written.renewals == ["[Errno 5] sync failed"]
    assert written.durable == 3 * ROWS
    with JournalReader(tmp_path / "run-1.journal.1") as second:
        again = second.poll()
        assert second.header is not None
        assert (second.header["segment"], second.header["first_record"]) == (1, 1)
    assert [one.sequence // ROWS for one in again if isinstance(one, DataRecord)] == [1, 2]
    written.write([data(3)])
    written.finish(END)
    assert written.durable == 4 * ROWS
    written.close()
    found, reader = read(tmp_path)
    assert (found, reader.missing, reader.breaks) == ([0, 1, 2, 3], 0, [])


def test_a_disk_that_takes_no_new_file_acknowledges_nothing(tmp_path: Path) -> None:
    for failing in ({"sync"}, {"sync", "make"}):
        folder = tmp_path / "-".join(sorted(failing))
        folder.mkdir()
        disk = Disk()
        written = journal(folder, disk)
        written.write([data(0)])
        disk.failing = set(failing)
        with pytest.raises(OSError, match="sync failed"):
            written.sync()
        assert (written.durable, written.renewals) == (0, [])
        assert [path.name for path in folder.iterdir()] == ["run-1.journal"], "no half of a file is left"
        disk.failing = set()
        written.finish(END)
        assert written.durable == ROWS
        written.close()
        assert read(folder)[0] == [0]


def test_the_end_that_is_refused_is_said_and_what_was_written_is_on_the_disk(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk)
    written.write([data(0)])
    disk.failing = {"append", "append once"}
    with pytest.raises(OSError, match="append failed"):
        written.finish(END)
    assert written.durable == ROWS
    written.close()
    found, reader = read(tmp_path)
    assert (found, reader.stop) == ([0], JournalEnd.OPEN)


def test_an_end_that_does_not_reach_the_disk_is_written_in_a_new_file(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk)
    written.write([data(0)])
    disk.failing = {"finish", "finish once"}
    written.finish(END)
    assert (written.durable, len(disk.made)) == (ROWS, 2)
    written.close()
    found, reader = read(tmp_path)
    assert (found, reader.stop) == ([0], JournalEnd.ENDED)


def test_the_warning_of_the_disk_is_that_of_the_present_file(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk, segment_bytes=1)
    written._files[0].disk_warning = "nearly full"
    assert written.disk_warning == "nearly full"
    written.write([data(0)])
    assert written.disk_warning is None
    written.close()


# --- reading ----------------------------------------------------------------------------------------------


def chain(folder: Path, blocks: int = 3) -> list[Path]:
    """Write a block to each file, and an end; return the files."""
    disk = Disk()
    written = journal(folder, disk, segment_bytes=1)
    for number in range(blocks):
        written.write([data(number)])
    written.finish(END)
    written.close()
    return disk.made


def test_a_new_reader_knows_nothing_and_reads_each_record_once(tmp_path: Path) -> None:
    files = chain(tmp_path)
    with ChainReader(files[0]) as reader:
        assert (reader.header, reader.missing, reader.breaks) == (None, 0, [])
        assert (reader.stop, reader.drained, reader.read_so_far) == (JournalEnd.OPEN, False, (0, 0, 0))
        assert len(reader.poll()) == 4
        assert reader.poll() == []
        assert (reader.stop, reader.drained, reader.why) == (JournalEnd.ENDED, True, "end record")
        assert not reader.more_lies_behind()
        assert reader.header is not None
        assert (reader.header["run_id"], reader.header["segment"]) == ("run-1", 0)


def test_what_was_read_is_counted_over_all_files_and_has_one_fingerprint(tmp_path: Path) -> None:
    files = chain(tmp_path)
    _, reader = read(tmp_path)
    frames, size, fingerprint = reader.read_so_far
    assert frames == 4 * 1 + 3 * 2 + 1
    assert size == sum(path.stat().st_size for path in files)
    folds = []
    for path in files:
        with JournalReader(path) as one:
            one.poll()
            folds.append(one.crc)
    expected = folds[0]
    for crc in folds[1:]:
        expected = segments._fold(expected, crc)
    assert fingerprint == expected
    assert segments._fold(1, 2) == zlib.crc32(b"\2\0\0\0", 1), "sealed runs keep it"
    with JournalReader(files[0]) as first:
        first.poll()
        (tmp_path / "alone").mkdir()
        alone = tmp_path / "alone" / "run-1.journal"
        alone.write_bytes(files[0].read_bytes())
        assert read(tmp_path / "alone")[1].read_so_far == (first.frames, first.offset, first.crc)


def test_a_journal_is_read_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chain(tmp_path)
    monkeypatch.setattr(segments, "BATCH_BYTES", 1)
    with ChainReader(tmp_path / "run-1.journal") as reader:
        parts = list(reader.batches())
    assert sum(len(part) for part in parts) == 4
    assert max(len(part) for part in parts) == 1
    with ChainReader(tmp_path / "run-1.journal") as reader:
        assert reader.poll(at_most=1) == []
        assert not reader.drained


@pytest.mark.parametrize("lost", [1, 2])
def test_a_file_that_is_gone_is_a_hole_of_so_many_records(tmp_path: Path, lost: int) -> None:
    files = chain(tmp_path)
    files[lost].unlink()
    found, reader = read(tmp_path)
    assert found == [number for number in range(3) if number != lost]
    assert (reader.missing, reader.stop) == (1, JournalEnd.ENDED)
    before = files[lost - 1].name
    assert reader.breaks == [f"{before}: no further record, 1 records are missing"]
    assert reader.why == f"{reader.breaks[0]}; end record"
    assert not reader.more_lies_behind()


def test_a_file_without_a_whole_header_is_passed_over_and_said_once(tmp_path: Path) -> None:
    files = chain(tmp_path)
    files[1].write_bytes(b"rubbish that begins no record at all")
    with ChainReader(files[0]) as reader:
        found = reader.poll()
        reader.poll()
    assert [one.sequence // ROWS for one in found if isinstance(one, DataRecord)] == [0, 2]
    assert reader.missing == 1
    assert len(reader.breaks) == 2
    assert reader.breaks[0].startswith("run-1.journal.1: ")
    assert reader.more_lies_behind()


def test_a_damaged_last_file_is_said_while_nothing_follows(tmp_path: Path) -> None:
    files = chain(tmp_path)
    files[3].write_bytes(b"rubbish that begins no record at all")
    with ChainReader(files[0]) as reader:
        assert len(reader.poll()) == 3
        assert reader.poll() == []
        assert len(reader.breaks) == 1
        assert reader.more_lies_behind()


def test_records_behind_an_invalid_one_are_told_of(tmp_path: Path) -> None:
    files = chain(tmp_path, 1)
    whole = files[0].read_bytes()
    with JournalReader(files[0]) as one:
        one.poll(at_most=1)
        begins = one.offset
    damaged = bytearray(whole)
    damaged[begins + 30] ^= 1
    files[1].unlink()
    files[0].write_bytes(bytes(damaged))
    with ChainReader(files[0]) as reader:
        assert reader.poll() == []
        assert reader.more_lies_behind(), "the block behind its damaged layout"
    files[0].write_bytes(whole[: begins + 30])
    with ChainReader(files[0]) as reader:
        assert reader.poll() == []
        assert not reader.more_lies_behind(), "cut short, and nothing behind"


def test_a_hole_behind_which_more_lies_is_told_of(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk, segment_bytes=2500)
    for number in range(8):
        written.write([data(number)])
    written.finish(END)
    written.close()
    first = disk.made[0]
    content = bytearray(first.read_bytes())
    with JournalReader(first) as one:
        one.poll(at_most=1)
        content[one.offset + 30] ^= 1
    first.write_bytes(bytes(content))
    found, reader = read(tmp_path)
    assert reader.missing > 1
    assert found == list(range(reader.missing, 8))
    assert f"{reader.missing} records are missing" in reader.breaks[0]
    assert reader.more_lies_behind()


def test_a_file_of_another_run_is_refused(tmp_path: Path) -> None:
    files = chain(tmp_path, 1)
    text = files[1].read_bytes()
    other = SegmentedJournal(tmp_path / "x.journal", "run-2", samples.metadata("run-2"))
    other.close()
    files[1].write_bytes((tmp_path / "x.journal").read_bytes())
    with (
        ChainReader(files[0]) as reader,
        pytest.raises(BadInput, match="is no part of this run's journal; move it away"),
    ):
        reader.poll()
    files[1].write_bytes(text)
    files[0].write_bytes(b"")
    found, reader = read(tmp_path)
    assert (found, reader.missing) == ([], 1), "without a first header the file's name says which run it is"
    (tmp_path / "run-1.journal").rename(tmp_path / "run-3.journal")
    files[1].rename(tmp_path / "run-3.journal.1")
    with (
        ChainReader(tmp_path / "run-3.journal") as reader,
        pytest.raises(BadInput, match="no part of this run"),
    ):
        reader.poll()


def test_a_growing_journal_is_followed_into_its_next_file(tmp_path: Path) -> None:
    disk = Disk()
    written = journal(tmp_path, disk)
    with ChainReader(tmp_path / "run-1.journal") as reader:
        written.write([data(0)])
        assert len(reader.poll()) == 1
        assert reader.drained
        written.write([data(1)])
        disk.failing = {"sync", "sync once"}
        written.sync()
        written.write([data(2)])
        assert [one.sequence // ROWS for one in reader.poll() if isinstance(one, DataRecord)] == [1, 2]
        written.finish(END)
        assert len(reader.poll()) == 1
        assert reader.stop is JournalEnd.ENDED
        assert (reader.missing, reader.breaks) == (0, [])
    written.close()
