"""Truncated and flipped at random places: nothing altered is taken for good, and all say what they are."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.recordings.verify import command as verify_command
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import MAIN_STREAM, Anchor, Event
from bufferstand.recording.journal.records import DataRecord
from bufferstand.recording.journal.segments import SegmentedJournal, later_segments
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.seal_journal import DAMAGED_SUFFIX, seal
from bufferstand.recording.sealing.verification import verify, verify_journal

from . import samples

BLOCKS = 60


def said_of(*paths: Path) -> tuple[int, str]:
    """Return exit status and output of the command."""
    result = CliRunner().invoke(verify_command, [str(path) for path in paths], standalone_mode=False)
    assert result.exception is None, result.exception
    return int(result.return_value), result.output


def recorded(folder: Path) -> tuple[list[tuple[str, bytes]], bytes]:
    """Record a run of several journal files; return them (name, bytes) and the run file's bytes."""
    folder.mkdir()
    first = folder / "run-1.journal"
    journal = SegmentedJournal(first, "run-1", samples.metadata(), segment_bytes=4000)
    for number in range(BLOCKS):
        stream, sequence, stamps, counts = samples.block(20 * number)
        journal.write([DataRecord(stream, sequence, 0, stamps, counts)])
        if number % 10 == 0:
            journal.write([Anchor(int(stamps[0]), number / 50, "2026-03-01T08:00:00Z")])
            journal.write([Event(number / 50, "note", f"block {number}", {"number": number})])
    slow = np.arange(5)
    warm = {"temperature_1": 20.0 + slow}
    journal.write([DataRecord("temperature_1", 0, 0, 9_000_000_000 + 1_000_000 * slow, warm)])
    journal.sync()
    journal.close()
    held = [(path.name, path.read_bytes()) for path in (first, *later_segments(first))]
    assert len(held) > 5
    return held, seal(first).read_bytes()


def damaged(content: bytes, dice: random.Random) -> tuple[bytes, str]:
    """Turn a bit, or cut the end off, at a random place."""
    at = dice.randrange(len(content))
    if dice.random() < 0.5:
        return content[:at], f"cut off after {at}"
    altered = bytearray(content)
    bit = dice.randrange(8)
    altered[at] ^= 1 << bit
    return bytes(altered), f"bit {bit} of byte {at} turned"


def check_values(path: Path, what: str) -> int:
    """See that every value is the one recorded under its sequence number; return how many there are."""
    run = open_run(path)
    if MAIN_STREAM not in run.streams:
        return 0
    stream = run.streams[MAIN_STREAM]
    sequence = stream.sequence
    assert (np.diff(sequence) > 0).all(), what
    assert sequence[-1] < 20 * BLOCKS, what
    assert stream.time.tolist() == samples.time_us(sequence).tolist(), what
    for channel, expected in samples.counts(sequence).items():
        assert stream.counts[channel].tolist() == expected.tolist(), what
    gaps = sum(lost for _, lost in run.gaps(MAIN_STREAM))
    assert len(sequence) + gaps == sequence[-1] - sequence[0] + 1, what
    for event in run.events:
        assert event.text == f"block {event.data['number']}", what
    return len(sequence)


def journals_damaged(folder: Path, places: int, seed: int) -> dict[str, int]:
    """Damage the journal of a run at that many places, one after the other; return what came of it."""
    files, _ = recorded(folder / "source")
    dice = random.Random(seed)
    tally = dict.fromkeys(("whole", "part", "damage kept"), 0)
    for number in range(places):
        out = folder / f"{number}"
        out.mkdir()
        struck = dice.randrange(len(files))
        what = ""
        for index, (name, content) in enumerate(files):
            altered, how = damaged(content, dice) if index == struck else (content, "")
            what += f"{name} {how}" if how else ""
            (out / name).write_bytes(altered)
        journal = out / files[0][0]
        findings = verify_journal(journal)
        assert findings, what
        assert findings[0].text in said_of(out)[1], what
        path = seal(journal)
        rows = check_values(path, what)
        assert not [finding for finding in verify(path) if finding.level == "fault"], what
        assert open_run(path).status == "recovered", what
        tally["whole" if rows == 20 * BLOCKS else "part"] += 1
        tally["damage kept"] += bool(list(out.glob(f"*{DAMAGED_SUFFIX}*")))
        shutil.rmtree(out)
    return tally


def run_files_damaged(folder: Path, places: int, seed: int) -> dict[str, int]:
    """Damage a run file at that many places, one after the other; return what came of it."""
    _, content = recorded(folder / "source")
    path = folder / "run-1.h5"
    path.write_bytes(content)
    assert check_values(path, "whole") == 20 * BLOCKS
    dice = random.Random(seed)
    tally = dict.fromkeys(("found", "in the remark", "opened all the same"), 0)
    for _ in range(places):
        altered, what = damaged(content, dice)
        path.write_bytes(altered)
        code, output = said_of(path)
        remark = content.index(b"check:") <= altered_at(content, altered) < 512 <= len(altered)
        if remark:
            assert code == 0, what
            tally["in the remark"] += 1
        else:
            assert code == 2, what
            assert "fault:" in output, what
            tally["found"] += 1
        try:
            rows = check_values(path, what)
        except BadInput:
            continue
        assert rows == 20 * BLOCKS, what  # its bytes are not those sealed, all its contents are
        tally["opened all the same"] += not remark
    return tally


def altered_at(content: bytes, altered: bytes) -> int:
    """Return the first byte that differs."""
    differ = [i for i, (a, b) in enumerate(zip(content, altered, strict=False)) if a != b]
    return differ[0] if differ else len(altered)


@pytest.mark.slow
def test_a_damaged_journal_gives_true_values_or_none(tmp_path: Path) -> None:
    tally = journals_damaged(tmp_path, 25, seed=1)
    assert tally["part"] > 5


@pytest.mark.slow
def test_a_damaged_run_file_is_found(tmp_path: Path) -> None:
    tally = run_files_damaged(tmp_path, 10, seed=2)
    assert tally["found"] > 5


@pytest.mark.long
def test_two_hundred_damaged_places_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for folder in ("journal", "run"):
        (tmp_path / folder).mkdir()
    journals = journals_damaged(tmp_path / "journal", 200, seed=3)
    runs = run_files_damaged(tmp_path / "run", 200, seed=4)
    with capsys.disabled():
        print(f"\njournals: {journals}\nrun files: {runs}")
    assert journals["whole"] + journals["part"] == 200
    assert runs["found"] + runs["in the remark"] == 200


def test_verify_tells_of_journals_and_of_what_was_kept(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    recorder.append(*samples.block(0))
    assert said_of(tmp_path) == (
        0,
        f"{recorder.path}: whole\n    note: journal: is being recorded, or sealed\n",
    )
    while not recorder.durable:
        pass
    left = recorder.path.read_bytes()
    recorder.close("complete").unlink()
    recorder.path.write_bytes(left)
    code, text = said_of(recorder.path)
    assert code == 0
    assert "the recording broke off" in text
    assert "not sealed yet, holds 20 sample(s) of the controller" in text
    recorder.path.write_bytes(b"rubbish")
    code, text = said_of(tmp_path)
    assert code == 2
    assert "nothing can be recovered: no record begins at byte 0" in text or "cut short" in text
    recorder.path.rename(tmp_path / f"run-1{DAMAGED_SUFFIX}")
    code, text = said_of(tmp_path)
    assert code == 2
    assert "records behind the damage were not recovered" in text


def test_a_journal_without_its_first_header_is_recovered_from_the_next_file(tmp_path: Path) -> None:
    files, _ = recorded(tmp_path / "source")
    out = tmp_path / "out"
    out.mkdir()
    for name, content in files:
        (out / name).write_bytes(content)
    samples.flipped(out / files[0][0], 8 * 40)
    samples.flipped(out / files[2][0], 8 * 40)
    samples.flipped(out / files[-1][0], 8 * 40)
    path = seal(out / files[0][0])
    rows = check_values(path, "three headers")
    assert 20 * BLOCKS * (len(files) - 4) / len(files) < rows < 20 * BLOCKS
    run = open_run(path)
    assert f"{files[2][0]}: record" in run.reason or f"{files[2][0]}: the record" in run.reason
    assert "further records lie behind it" in run.reason
    assert len(list(out.glob(f"*{DAMAGED_SUFFIX}*"))) == len(files)


def test_a_journal_without_any_header_is_refused_with_what_to_do(tmp_path: Path) -> None:
    files, _ = recorded(tmp_path / "source")
    journal = tmp_path / files[0][0]
    journal.write_bytes(files[0][1])
    samples.flipped(journal, 8 * 40)
    with pytest.raises(BadInput, match=r"no header .*CRC.*nothing can be recovered from it; move it out"):
        seal(journal)
