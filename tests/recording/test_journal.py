"""The journal gives back exactly what was written, or less, never anything else."""

from __future__ import annotations

import random
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Anchor, Event
from bufferstand.recording.journal.records import (
    FRAME,
    DataRecord,
    EndRecord,
    JournalEnd,
    JournalReader,
    JournalWriter,
    Record,
)

from . import samples

HEADER = {"run": {"id": "r"}, "note": "ß"}


def same(one: Record, other: Record) -> bool:
    if isinstance(one, DataRecord) and isinstance(other, DataRecord):
        return (
            (one.stream, one.sequence, one.lost) == (other.stream, other.sequence, other.lost)
            and np.array_equal(one.time_us, other.time_us)
            and list(one.counts) == list(other.counts)
            and all(
                one.counts[name].dtype == other.counts[name].dtype
                and one.counts[name].tobytes() == other.counts[name].tobytes()
                for name in one.counts
            )
        )
    return one == other


def framed(writer: JournalWriter, record: Record) -> bytes:
    if isinstance(record, DataRecord):
        return writer.data(record.stream, record.sequence, record.time_us, record.counts, record.lost)
    if isinstance(record, Anchor):
        return writer.anchor(record)
    if isinstance(record, Event):
        return writer.event(record)
    return writer.end(record)


def journal_of(records: list[Record]) -> tuple[list[bytes], list[Record]]:
    writer = JournalWriter()
    return [writer.header("r", HEADER), *(framed(writer, record) for record in records)], records


def some_records(blocks: int = 6) -> list[Record]:
    records: list[Record] = []
    for number in range(blocks):
        stream, first, stamps, counts = samples.block(number * 20)
        records.append(DataRecord(stream, first, 0, stamps, counts))
        records.append(Anchor(int(stamps[0]), 1.5 + number, "2026-01-01T00:00:00+00:00"))
        records.append(Event(1.0, "note", "größer", {"n": number, "ok": True}))
    return records


def is_prefix(found: list[Record], written: list[Record]) -> bool:
    return len(found) <= len(written) and all(
        same(one, other) for one, other in zip(found, written, strict=False)
    )


values = st.sampled_from(["i1", "u1", "i2", "u2", "i4", "u4", "i8", "f4", "f8"])


@st.composite
def data_records(draw: st.DrawFn) -> DataRecord:
    rows = draw(st.integers(0, 8))
    names = draw(st.lists(st.sampled_from(["force", "stroke_1", "grün"]), min_size=1, unique=True))
    return DataRecord(
        draw(st.sampled_from(["controller", "amplifier", "t"])),
        draw(st.integers(-(2**63), 2**63 - 1)),
        draw(st.integers(0, 2**40)),
        draw(arrays("<i8", rows)),
        {name: draw(arrays(np.dtype(draw(values)).newbyteorder("<"), rows)) for name in names},
    )


finite = st.floats(allow_nan=False, allow_infinity=False)
anything: st.SearchStrategy[Record] = st.one_of(
    data_records(),
    st.builds(Anchor, st.integers(0, 2**62), finite, st.text(max_size=5)),
    st.builds(
        Event,
        finite,
        st.text(max_size=5),
        st.text(max_size=9),
        st.dictionaries(st.text(max_size=3), finite, max_size=2),
    ),
)


@pytest.mark.slow
@given(st.lists(anything, max_size=8), st.booleans())
def test_round_trip_of_anything(records: list[Record], ended: bool) -> None:
    if ended:
        records = [*records, EndRecord("complete", "", "2026-01-01T00:00:00+00:00", {"late_syncs": 0})]
    frames, _ = journal_of(records)
    with temporary(b"".join(frames)) as path:
        found = samples.scan(path)
    assert found.header is not None
    assert found.header["metadata"] == HEADER
    assert len(found.records) == len(records)
    assert is_prefix(list(found.records), records)
    assert found.stop is (JournalEnd.ENDED if ended else JournalEnd.OPEN)
    assert found.valid_bytes == sum(map(len, frames))


class temporary:  # noqa: N801 - hypothesis examples must not share pytest's folder of one test
    def __init__(self, content: bytes) -> None:
        self.content = content

    def __enter__(self) -> Path:
        import tempfile

        self.folder = tempfile.TemporaryDirectory()
        path = Path(self.folder.name) / "r.journal"
        path.write_bytes(self.content)
        return path

    def __exit__(self, *_: Any) -> None:
        self.folder.cleanup()


@pytest.mark.slow
@pytest.mark.parametrize("tail", [b"", b"\0" * 5000], ids=["cut", "cut before reserved space"])
def test_torn_at_every_byte_of_the_last_record(tmp_path: Path, tail: bytes) -> None:
    records = some_records(2)[:4]  # the last one is data, with its layout known
    frames, _ = journal_of(records)
    before, last = b"".join(frames[:-1]), frames[-1]
    path = tmp_path / "r.journal"
    for kept in range(len(last)):
        path.write_bytes(before + last[:kept] + tail)
        found = samples.scan(path)
        # Zeros behind a cut can by chance be the very bytes that were cut off: then nothing was lost.
        expected = records if (last[:kept] + tail).startswith(last) else records[:-1]
        assert len(found.records) == len(expected), kept
        assert is_prefix(list(found.records), records)
        assert found.stop is not JournalEnd.ENDED
        assert not found.more_follows
        if kept == 0 and not tail:
            assert found.why == "no further record"
        if kept and not tail:
            assert f"after {kept} bytes" in found.why or kept < 1


@given(st.integers(0, 2**32))
def test_a_flipped_bit_never_gives_other_values(seed: int) -> None:
    records = some_records(3)
    frames, _ = journal_of([*records, EndRecord("complete", "", "t")])
    data = bytearray(b"".join(frames))
    dice = random.Random(seed)
    for _ in range(dice.choice([1, 1, 1, 3])):
        bit = dice.randrange(8 * len(data))
        data[bit // 8] ^= 1 << (bit % 8)
    with temporary(bytes(data)) as path:
        found = samples.scan(path)
    assert found.stop is not JournalEnd.ENDED or bytes(data) == b"".join(frames)
    assert is_prefix(list(found.records), records)
    assert str(found.valid_bytes) in found.why or "record" in found.why


def test_a_flipped_bit_in_the_middle_is_told_from_a_torn_end(tmp_path: Path) -> None:
    frames, records = journal_of(some_records(3))
    data = bytearray(b"".join(frames))
    data[len(b"".join(frames[:4])) + 40] ^= 1
    path = tmp_path / "r.journal"
    path.write_bytes(bytes(data))
    found = samples.scan(path)
    assert len(found.records) == 3
    assert found.more_follows
    assert is_prefix(list(found.records), records)


def test_a_record_of_another_place_is_no_continuation(tmp_path: Path) -> None:
    frames, records = journal_of(some_records(4))
    path = tmp_path / "r.journal"
    for order in ([0, 1, 3, 2, 4], [0, 1, 1, 2], [0, 2, 3]):
        path.write_bytes(b"".join(frames[i] for i in order))
        assert is_prefix(samples.scan(path).records, records)
        assert samples.scan(path).stop is JournalEnd.INVALID


def test_reading_while_it_grows_byte_by_byte(tmp_path: Path) -> None:
    records = some_records(2)
    frames, _ = journal_of([*records, EndRecord("stopped", "operator", "t")])
    data = b"".join(frames)
    path = tmp_path / "r.journal"
    path.write_bytes(b"")
    found: list[Record] = []
    with JournalReader(path) as reader, path.open("r+b") as growing:
        growing.truncate(len(data) + 4096)  # reserved ahead, as the recorder does
        for start in range(0, len(data), 7):
            growing.write(data[start : start + 7])
            growing.flush()
            found += reader.poll()
            assert is_prefix(found, [*records, EndRecord("stopped", "operator", "t")])
        assert reader.stop is JournalEnd.ENDED
        assert len(found) == len(records) + 1
        assert reader.poll() == []


def test_a_newer_journal_is_refused_by_name(tmp_path: Path) -> None:
    writer = JournalWriter()
    path = tmp_path / "r.journal"
    path.write_bytes(
        writer._json(1, {"format": "bufferstand/journal", "format_version": 2, "run_id": "r"})  # type: ignore[arg-type]
    )
    with pytest.raises(BadInput, match=r"r\.journal: journal version 2 is newer .*update"):
        samples.scan(path)


def test_a_length_beyond_reason_is_not_read(tmp_path: Path) -> None:
    frames, _ = journal_of([])
    path = tmp_path / "r.journal"
    path.write_bytes(frames[0] + FRAME.pack(b"BSJ1", 0, 2**32 - 1, 3, 0, 0, 1))
    assert samples.scan(path).stop is JournalEnd.INVALID


def test_an_unknown_kind_ends_reading(tmp_path: Path) -> None:
    writer = JournalWriter()
    first = writer.header("r", HEADER)
    path = tmp_path / "r.journal"
    path.write_bytes(first + writer._json(9, {}))  # type: ignore[arg-type]
    found = samples.scan(path)
    assert found.stop is JournalEnd.INVALID
    assert "unknown kind 9" in found.why


def test_no_journal_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No such file"):
        samples.scan(tmp_path / "none.journal")


def test_layout_is_as_documented(tmp_path: Path) -> None:
    """Read one data record with nothing but struct, by the text of the module."""
    frames, records = journal_of(some_records(1))
    layout_and_data = frames[1]
    magic, _, length, kind, _, stream, number = struct.unpack_from("<4sIIBBHQ", layout_and_data)
    assert (magic, kind, stream, number) == (b"BSJ1", 2, 0, 1)
    data = layout_and_data[24 + length :]
    magic, _, length, kind, _, stream, number = struct.unpack_from("<4sIIBBHQ", data)
    assert (magic, kind, stream, number, length) == (b"BSJ1", 3, 0, 2, len(data) - 24)
    sequence, lost, rows, _ = struct.unpack_from("<qqII", data, 24)
    assert (sequence, lost, rows) == (0, 0, 20)
    first = records[0]
    assert isinstance(first, DataRecord)
    assert struct.unpack_from("<20q", data, 48) == tuple(first.time_us.tolist())
    assert struct.unpack_from("<20i", data, 48 + 160) == tuple(first.counts["force"].tolist())
