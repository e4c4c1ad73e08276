"""Frames of the journal at their edges: numbers of the format, layouts, bounds, and where reading pauses."""

from __future__ import annotations

import json
import math
import os
import struct
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Anchor, Event
from bufferstand.recording.journal import records
from bufferstand.recording.journal.records import (
    DataRecord,
    EndRecord,
    FrameKind,
    JournalEnd,
    JournalReader,
    JournalWriter,
    more_records_behind,
)

FRAME_BYTES = 24
TIMES = np.array([1000, 2000], dtype=np.int64)


def counts(kind: str = "<i4") -> dict[str, Any]:
    return {"force": np.array([5, -6]).astype(kind)}


def write(folder: Path, *frames: bytes) -> Path:
    path = folder / "r.journal"
    path.write_bytes(b"".join(frames))
    return path


def read(path: Path) -> tuple[list[Any], JournalReader]:
    with JournalReader(path) as reader:
        return reader.poll(), reader


def kinds(frames: bytes) -> list[tuple[int, int, int]]:
    """Return kind, stream and number of each frame."""
    found = []
    while frames:
        magic, _, length, kind, nothing, stream, number = struct.unpack_from("<4sIIBBHQ", frames)
        assert (magic, nothing) == (b"BSJ1", 0)
        found.append((kind, stream, number))
        frames = frames[FRAME_BYTES + length :]
    return found


def test_numbers_of_the_format_are_as_they_were() -> None:
    """Journals are read years later: none of these may change without a new version."""
    assert (records.MAGIC, records.JOURNAL_FORMAT, records.JOURNAL_VERSION) == (
        b"BSJ1",
        "bufferstand/journal",
        1,
    )
    assert {one.name: one.value for one in FrameKind} == {
        "HEADER": 1, "LAYOUT": 2, "DATA": 3, "ANCHOR": 4, "EVENT": 5, "END": 6,
    }  # fmt: skip
    assert (records.MAX_PAYLOAD, records.LONGEST_NAME, records.FRAME.size) == (
        256 * 1024 * 1024,
        200,
        FRAME_BYTES,
    )
    assert records._READ_AT_ONCE == 1024 * 1024


def test_a_header_counts_from_the_first_file_and_record_unless_it_is_told() -> None:
    first = JournalWriter().header("r", {"a": 1})
    assert json.loads(first[FRAME_BYTES:]) == {
        "format": "bufferstand/journal", "format_version": 1, "run_id": "r", "segment": 0, "first_record": 0,
        "metadata": {"a": 1},
    }  # fmt: skip
    later = json.loads(JournalWriter().header("r", {}, segment=2, first_record=7)[FRAME_BYTES:])
    assert (later["segment"], later["first_record"]) == (2, 7)


def test_the_check_sum_covers_all_behind_itself_and_continues_that_before() -> None:
    writer = JournalWriter()
    before = 0
    for frame in (writer.header("r", {}), writer.anchor(Anchor(1, 2.0, "t"))):
        (crc,) = struct.unpack_from("<I", frame, 4)
        assert crc == zlib.crc32(frame[8:], before)
        before = crc


def test_what_belongs_to_no_stream_has_number_0_and_spare_bytes_are_0() -> None:
    writer = JournalWriter()
    assert kinds(writer.header("r", {})) == [(1, 0, 0)]
    assert kinds(writer.anchor(Anchor(1, 2.0, "t"))) == [(4, 0, 1)]
    block = writer.data("a", 3, TIMES, counts(), 4)
    (length,) = struct.unpack_from("<I", block, 8)
    assert struct.unpack_from("<qqII", block, 2 * FRAME_BYTES + length) == (3, 4, 2, 0)


def test_a_reader_lets_go_of_its_file(tmp_path: Path) -> None:
    with JournalReader(write(tmp_path)) as reader:
        handle = reader._handle
        os.fstat(handle)
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(handle)


def test_a_layout_is_written_once_and_again_where_it_has_changed() -> None:
    writer = JournalWriter()

    def block(stream: str, kind: str = "<i4") -> list[tuple[int, int, int]]:
        return kinds(writer.data(stream, 0, TIMES, counts(kind), 0))

    assert block("a") == [(2, 0, 0), (3, 0, 1)]
    assert block("a") == [(3, 0, 2)]
    assert block("b") == [(2, 1, 3), (3, 1, 4)]
    assert block("a", "<i2") == [(2, 0, 5), (3, 0, 6)], "under the stream's own number"
    assert block("b") == [(3, 1, 7)]
    assert block("c") == [(2, 2, 8), (3, 2, 9)]


def test_big_endian_numbers_are_stored_as_all_others(tmp_path: Path) -> None:
    writer = JournalWriter()
    (found,), _ = read(write(tmp_path, writer.data("a", 3, TIMES.astype(">i8"), counts(">i4"), 4)))
    assert (found.stream, found.sequence, found.lost) == ("a", 3, 4)
    assert found.time_us.tolist() == [1000, 2000]
    assert found.counts["force"].tolist() == [5, -6]
    assert found.counts["force"].dtype == np.dtype("<i4")


def test_a_mark_goes_on_as_if_nothing_had_been_framed_since() -> None:
    writer = JournalWriter()
    writer.header("r", {})
    mark = writer.mark()
    for frames in (writer, mark):
        assert kinds(frames.data("a", 0, TIMES, counts(), 0)) == [(2, 0, 1), (3, 0, 2)]
    assert writer.anchor(Anchor(1, 2.0, "t")) == mark.anchor(Anchor(1, 2.0, "t"))


def test_every_record_is_framed_as_what_it_is() -> None:
    made = (
        DataRecord("a", 0, 0, TIMES, counts()),
        Anchor(1, 2.0, "t"),
        Event(1.0, "k", "t"),
        EndRecord("s", "", "t"),
    )
    for record, kind in zip(made, ([2, 3], [4], [5], [6]), strict=True):
        assert [one[0] for one in kinds(JournalWriter().record(record))] == kind


def test_a_record_larger_than_a_journal_takes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(records, "MAX_PAYLOAD", 100)
    writer = JournalWriter()
    assert len(writer._frame(FrameKind.EVENT, 0, b"x" * 100)) == FRAME_BYTES + 100
    with pytest.raises(ValueError, match="a record of 101 bytes is larger than the journal takes"):
        writer._frame(FrameKind.EVENT, 0, b"x" * 101)
    assert kinds(writer._frame(FrameKind.EVENT, 0, b"")) == [(5, 0, 1)], "what was refused has no number"


def test_the_largest_record_is_read_and_a_larger_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = JournalWriter()
    header, event = writer.header("r", {}), writer.event(Event(1.0, "k", "x" * 300))
    path = write(tmp_path, header, event)
    monkeypatch.setattr(records, "MAX_PAYLOAD", len(event) - FRAME_BYTES)
    found, reader = read(path)
    assert (len(found), reader.stop) == (1, JournalEnd.OPEN)
    monkeypatch.setattr(records, "MAX_PAYLOAD", len(event) - FRAME_BYTES - 1)
    found, reader = read(path)
    assert (found, reader.stop) == ([], JournalEnd.INVALID)
    assert reader.why == f"the record at byte {len(header)} does not continue those before"


def test_a_new_reader_has_read_nothing(tmp_path: Path) -> None:
    with JournalReader(write(tmp_path)) as reader:
        assert (reader.header, reader.offset, reader.frames, reader.crc) == (None, 0, 0, 0)
        assert (reader.stop, reader.why, reader.drained) == (JournalEnd.OPEN, "nothing was read yet", False)
        assert reader.poll() == []
        assert (reader.stop, reader.why, reader.drained) == (JournalEnd.OPEN, "no further record", True)


def journal() -> list[bytes]:
    writer = JournalWriter()
    events = [writer.event(Event(float(number), "k", "t")) for number in range(3)]
    return [*events, writer.end(EndRecord("complete", "", "t"))]


@pytest.mark.parametrize("at_once", [1, 24, 30, 1 << 20])
def test_however_much_is_read_at_once_the_records_are_the_same(
    tmp_path: Path, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(records, "_READ_AT_ONCE", at_once)
    frames = journal()
    found, reader = read(write(tmp_path, *frames))
    assert [one.at_s for one in found[:3]] == [0.0, 1.0, 2.0]
    assert (reader.offset, reader.frames, reader.stop) == (len(b"".join(frames)), 4, JournalEnd.ENDED)
    assert (reader.why, reader.drained) == ("end record", True)
    assert reader.crc == struct.unpack_from("<I", frames[3], 4)[0]


def test_reading_pauses_behind_the_record_that_has_reached_the_size_asked_for(tmp_path: Path) -> None:
    frames = journal()
    size = len(frames[0])
    with JournalReader(write(tmp_path, *frames)) as reader:
        assert len(reader.poll(at_most=size)) == 1
        assert (reader.drained, reader.offset) == (False, size)
        assert len(reader.poll(at_most=size + 1)) == 2
        assert not reader.drained
        assert len(reader.poll(at_most=10_000)) == 1
        assert reader.drained
        assert (reader.poll(at_most=1), reader.drained) == ([], True)


def test_reserved_space_is_no_record_and_something_else_is_an_invalid_one(tmp_path: Path) -> None:
    frames = journal()[:1]
    size = len(frames[0])
    for tail, stop, why in (
        (bytes(24), JournalEnd.OPEN, "no further record, only reserved space"),
        (bytes(23), JournalEnd.OPEN, "no further record"),
        (bytes(23) + b"\1", JournalEnd.INVALID, f"no record begins at byte {size}"),
        (bytes(24) + b"\1", JournalEnd.OPEN, "no further record, only reserved space"),
        (b"BS", JournalEnd.TORN, f"the record at byte {size} is cut short after 2 bytes"),
    ):
        found, reader = read(write(tmp_path, *frames, tail))
        assert (len(found), reader.stop, reader.why) == (1, stop, why)


def test_a_torn_or_altered_record_is_told_from_one_of_another_place(tmp_path: Path) -> None:
    frames = journal()
    size = len(frames[0])
    altered = bytearray(frames[1])
    altered[-1] ^= 1
    _, reader = read(write(tmp_path, frames[0], bytes(altered)))
    assert (reader.stop, reader.why) == (
        JournalEnd.TORN,
        f"the record at byte {size} is torn or altered (CRC)",
    )
    _, reader = read(write(tmp_path, frames[0], frames[2]))
    assert (reader.stop, reader.why) == (
        JournalEnd.INVALID,
        f"the record at byte {size} does not continue those before",
    )


def altogether(folder: Path, *payloads: tuple[int, int, bytes]) -> tuple[list[Any], JournalReader]:
    writer = JournalWriter()
    return read(
        write(folder, *(writer._frame(FrameKind(kind), stream, what) for kind, stream, what in payloads))
    )


def layout(*channels: Iterable[Any], stream: str = "a") -> bytes:
    return json.dumps({"stream": stream, "channels": channels}).encode()


BLOCK = struct.pack("<qqII", 7, 2, 2, 0) + TIMES.tobytes() + np.array([5, -6], "<i4").tobytes()


def test_a_block_is_as_long_as_its_layout_says(tmp_path: Path) -> None:
    (found,), _ = altogether(tmp_path, (2, 3, layout(("force", "<i4"))), (3, 3, BLOCK))
    assert (found.stream, found.sequence, found.lost, found.counts["force"].tolist()) == ("a", 7, 2, [5, -6])
    for block in (BLOCK + b"\0", BLOCK[:-1], BLOCK[:20]):
        found, reader = altogether(tmp_path, (2, 0, layout(("force", "<i4"))), (3, 0, block))
        assert (found, reader.stop) == ([], JournalEnd.INVALID)
        assert reader.why.startswith("record 1 makes no sense (")
    _, reader = altogether(tmp_path, (2, 0, layout(("force", "<i4"))), (3, 0, BLOCK + b"\0"))
    assert reader.why == f"record 1 makes no sense ({len(BLOCK) + 1} bytes where {len(BLOCK)} belong)"


def test_channels_of_a_block_stand_one_behind_the_other(tmp_path: Path) -> None:
    two = layout(("a", "<i4"), ("b", "<f8"), ("c", "|i1"))
    block = BLOCK + np.array([0.5, 1.5]).tobytes() + np.array([1, 2], "i1").tobytes()
    (found,), _ = altogether(tmp_path, (2, 0, two), (3, 0, block))
    assert {name: column.tolist() for name, column in found.counts.items()} == {
        "a": [5, -6], "b": [0.5, 1.5], "c": [1, 2],
    }  # fmt: skip


def test_a_block_without_its_layout_makes_no_sense(tmp_path: Path) -> None:
    found, reader = altogether(tmp_path, (2, 0, layout(("force", "<i4"))), (3, 1, BLOCK))
    assert (found, reader.stop, reader.frames) == ([], JournalEnd.INVALID, 1)


@pytest.mark.parametrize("name", ["x" * 200, "grün", "a.b", ".a"])
def test_a_name_may_be_that_of_a_dataset(tmp_path: Path, name: str) -> None:
    (found,), _ = altogether(tmp_path, (2, 0, layout((name, "<i4"), stream=name)), (3, 0, BLOCK))
    assert (found.stream, list(found.counts)) == (name, [name])


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "x" * 201, "a\x1bb", "a\x07b"])
def test_a_name_that_cannot_be_that_of_a_dataset_makes_no_sense(tmp_path: Path, name: str) -> None:
    for what in (layout((name, "<i4")), layout(("force", "<i4"), stream=name)):
        found, reader = altogether(tmp_path, (2, 0, what), (3, 0, BLOCK))
        assert (found, reader.stop, reader.frames) == ([], JournalEnd.INVALID, 0)
        assert "is no name of a channel" in reader.why


@pytest.mark.parametrize("kind", ["O", "<i3", "<c16", "<i4,<i4", "S3", "<M8", "x" * 300])
def test_a_type_that_is_none_of_plain_numbers_makes_no_sense(tmp_path: Path, kind: str) -> None:
    found, reader = altogether(tmp_path, (2, 0, layout(("force", kind))), (3, 0, BLOCK))
    assert (found, reader.stop) == ([], JournalEnd.INVALID)
    assert "is no type of numbers" in reader.why


@pytest.mark.parametrize("kind", [4, 5, 6])
def test_what_is_no_record_of_its_kind_makes_no_sense(tmp_path: Path, kind: int) -> None:
    found, reader = altogether(tmp_path, (kind, 0, b"[]"))
    assert (found, reader.stop) == ([], JournalEnd.INVALID)


def test_numbers_of_any_size_that_a_record_may_hold_are_read(tmp_path: Path) -> None:
    """The bound on numbers of files that people write is not one of what was measured."""
    writer = JournalWriter()
    big = (
        Anchor(2**62, 1e17, "t"),
        Event(1e17, "k", "t", {"n": 1e17}),
        EndRecord("complete", "", "t", {"n": 1e17}),
    )
    found, _ = read(write(tmp_path, writer.header("r", {"n": 1e17}), *(writer.record(one) for one in big)))
    assert found == list(big)
    assert all(math.isfinite(one) for one in (found[0].host_s, found[1].at_s))


def test_only_a_newer_journal_of_ours_is_refused(tmp_path: Path) -> None:
    def header(**changes: Any) -> bytes:
        whole = json.loads(JournalWriter().header("r", {})[FRAME_BYTES:]) | changes
        return json.dumps(whole).encode()

    _, reader = altogether(tmp_path, (1, 0, header()))
    assert reader.header is not None
    assert reader.header["run_id"] == "r"
    with pytest.raises(BadInput, match=r"journal version 2 is newer than this software understands \(1\)"):
        altogether(tmp_path, (1, 0, header(format_version=2)))
    for other in (header(format_version=2, format="theirs"), header(format_version="2"), b"[]"):
        _, reader = altogether(tmp_path, (1, 0, other))
        if b"theirs" not in other:
            assert (reader.header, reader.stop) == (None, JournalEnd.INVALID)


@pytest.mark.parametrize("at_once", [4, 5, 7, 1 << 20])
def test_a_record_behind_is_found_wherever_blocks_of_the_file_end(
    tmp_path: Path, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(records, "_READ_AT_ONCE", at_once)
    for before in range(12):
        path = write(tmp_path, b"x" * before, b"BSJ1", b"yy")
        assert more_records_behind(path, 0)
        assert more_records_behind(path, before)
        assert not more_records_behind(path, before + 1)
    assert not more_records_behind(write(tmp_path, b"BSJ" * 9), 0)
    assert not more_records_behind(write(tmp_path, b"BSxJ1BSJxx1"), 0)
