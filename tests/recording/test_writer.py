"""Recording: nothing acknowledged is lost, whatever ends it, and nothing makes the acquisition wait."""

from __future__ import annotations

import errno
import os
import random
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import RecordingFault
from bufferstand.recording.journal.file import JournalFile
from bufferstand.recording.journal.records import DataRecord, JournalReader
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.seal_journal import is_in_use, seal, seal_orphans
from bufferstand.recording.sealing.verification import verify

from . import samples

ROOT = Path(__file__).parents[2]


def record(recorder: RunRecorder, blocks: int, first: int = 0) -> None:
    for number in range(blocks):
        recorder.append(*samples.block(first + 20 * number))


def check_rows(path: Path, at_least: int) -> int:
    """Compare every sample with what was sent; return how many there are."""
    run = open_run(path)
    if "controller" not in run.streams:
        assert at_least == 0
        return 0
    stream = run.streams["controller"]
    sequence = np.arange(stream.rows)
    assert stream.rows >= at_least
    assert np.array_equal(stream.sequence, sequence)
    assert np.array_equal(stream.time, samples.time_us(sequence))
    for name, values in samples.counts(sequence).items():
        assert stream.counts[name].dtype == values.dtype
        assert np.array_equal(stream.counts[name], values)
    return stream.rows


def test_a_run_from_start_to_seal(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata(), sync_interval_s=0.001)
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.journal"]
    assert is_in_use(recorder.path)
    record(recorder, 30)
    recorder.append("temperature_1", 0, np.array([7_000_000]), {"temperature_1": np.array([21.5])})
    recorder.anchor(5_000_000_000, 7.0, "2026-03-01T08:00:00+00:00")
    recorder.event(7.5, "guard", "wärmer", limit_C=40.0)
    path = recorder.close("stopped", "40 °C")
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.h5"]
    assert (recorder.written, recorder.durable, recorder.failure) == (600, 600, None)
    assert check_rows(path, 600) == 600
    run = open_run(path)
    assert (run.status, run.reason) == ("stopped", "40 °C")
    assert run.metadata["run"]["ended_utc"].endswith("+00:00")
    assert run.metadata["recorder"]["late_syncs"] >= 0
    assert run.metadata["sealed_from"]["stop"] == "end record"
    assert run.series("temperature_1").time_s == pytest.approx([0.0])
    assert run.events[0].data == {"limit_C": 40.0}
    assert run.events[0].time_s == pytest.approx(0.5)
    assert recorder.close("complete") == path  # once closed, it stays as it was
    with pytest.raises(RuntimeError, match="closed"):
        recorder.append(*samples.block(600))


def test_gaps_are_counted(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    for first, lost in ((0, 0), (20, 0), (45, 5), (65, 2)):
        name, sequence, stamps, counts = samples.block(first)
        recorder.append(name, sequence, stamps, counts, lost)
    run = open_run(recorder.close("complete"))
    assert run.gaps("controller") == [(39, 5), (59, 2)]


def test_a_viewer_reads_along(tmp_path: Path) -> None:
    with RunRecorder(tmp_path, "run-1", samples.metadata(), sync_interval_s=0.001) as recorder:
        seen = 0
        with JournalReader(recorder.path) as reader:
            for number in range(200):
                recorder.append(*samples.block(20 * number))
                for item in reader.poll():
                    assert isinstance(item, DataRecord)
                    assert item.sequence == seen
                    assert item.counts["force"].tolist() == samples.block(seen)[3]["force"].tolist()
                    seen += len(item.time_us)
            while seen < 4000:  # the last ones are on their way
                assert recorder.failure is None
                seen += sum(len(item.time_us) for item in reader.poll() if isinstance(item, DataRecord))
            assert reader.header is not None
            assert reader.header["metadata"]["specimen"]["id"] == "B-17"
    assert check_rows(tmp_path / "run-1.h5", 4000) == 4000


def test_an_exception_ends_the_run_as_failed(tmp_path: Path) -> None:
    def acquire() -> None:
        with RunRecorder(tmp_path, "run-1", samples.metadata()) as recorder:
            record(recorder, 2)
            raise ZeroDivisionError("in the acquisition")

    with pytest.raises(ZeroDivisionError):
        acquire()
    run = open_run(tmp_path / "run-1.h5")
    assert (run.status, run.reason) == ("failed", "ZeroDivisionError: in the acquisition")
    assert check_rows(run.path, 40) == 40


def test_the_buffers_may_be_used_again_at_once(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    for number in range(5):
        name, first, stamps, counts = samples.block(20 * number)
        recorder.append(name, first, stamps, counts)
        stamps[:] = 0
        for column in counts.values():
            column[:] = 0
    assert check_rows(recorder.close("complete"), 100) == 100


def test_what_does_not_fit_the_metadata_is_refused_at_once(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    name, first, stamps, counts = samples.block(0)
    with pytest.raises(ValueError, match="stream other is not in the run's metadata"):
        recorder.append("other", first, stamps, counts)
    with pytest.raises(ValueError, match="its metadata says"):
        recorder.append(name, first, stamps, {"force": counts["force"]})
    with pytest.raises(ValueError, match="stroke_1"):
        recorder.append(name, first, stamps, {**counts, "stroke_1": counts["stroke_1"][:5]})
    for at_s, text in ((float("nan"), "fine"), (1.0, "\ud800")):
        with pytest.raises(ValueError, match=r"JSON|surrogates"):
            recorder.event(at_s, "note", text)
    with pytest.raises(TypeError):
        recorder.event(1.0, "note", "text", path=tmp_path)
    with pytest.raises(ValueError, match="JSON"):
        recorder.anchor(0, float("inf"), "")
    recorder.anchor(np.int64(5), np.float64(1.0), "")  # type: ignore[arg-type]
    assert recorder.failure is None
    with pytest.raises(ValueError, match="status 'recovered' is none of"):
        recorder.close("recovered")
    assert verify(recorder.close("complete"))[0].text == "not one sample was recorded"


def test_names_that_are_taken_are_refused(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    with pytest.raises(BadInput, match="a journal of this run is there already"):
        RunRecorder(tmp_path, "run-1", samples.metadata())
    recorder.close("complete")
    with pytest.raises(BadInput, match="this run is recorded already"):
        RunRecorder(tmp_path, "run-1", samples.metadata())
    with pytest.raises(BadInput, match="cannot record here: No such file or directory"):
        RunRecorder(tmp_path / "none", "run-1", samples.metadata())
    with pytest.raises(BadInput, match=r"run\.id is not"):
        RunRecorder(tmp_path, "run-2", samples.metadata())
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.h5"]


# --- disks that misbehave ------------------------------------------------------------------------------


def failing(**calls: Callable[..., object]) -> Callable[[Path, bytes], JournalFile]:
    return partial(JournalFile, **calls)  # type: ignore[arg-type]


def test_short_writes_lose_nothing(tmp_path: Path) -> None:
    dice = random.Random(3)

    def short(handle: int, data: memoryview, offset: int) -> int:
        return os.pwrite(handle, data[: dice.randint(1, 100)], offset)

    recorder = RunRecorder(tmp_path, "run-1", samples.metadata(), journal_file=failing(pwrite=short))
    record(recorder, 20)
    assert check_rows(recorder.close("complete"), 400) == 400


def test_a_full_disk_keeps_what_was_written_and_cuts_off_the_torn_record(tmp_path: Path) -> None:
    room = 12_000

    def full(handle: int, data: memoryview, offset: int) -> int:
        taken = os.pwrite(handle, data[: max(0, room - offset)], offset)
        if not taken:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return taken

    def refused(handle: int, offset: int, length: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    recorder = RunRecorder(
        tmp_path, "run-1", samples.metadata(), journal_file=failing(pwrite=full, fallocate=refused)
    )
    assert (
        recorder.disk_warning == "no 4 MiB could be reserved ahead of run-1.journal: No space left on device"
    )
    first = 0
    while recorder.failure is None:
        recorder.append(*samples.block(first))
        first += 20
    assert isinstance(recorder.failure, OSError)
    record(recorder, 5, first)  # must not raise, must not block
    room = 20_000  # somebody makes room; the end record finds it, and continues what is there
    run = open_run(recorder.close("complete"))
    assert run.status == "failed"
    assert run.reason == "recording failed: [Errno 28] No space left on device"
    assert recorder.written == recorder.durable == check_rows(run.path, 20)


def test_what_still_fits_on_a_full_disk_is_kept(tmp_path: Path) -> None:
    """Blocks that wait together are written together; where one no longer fits, those before it do."""
    free, room = threading.Event(), 20_000
    free.set()

    def full(handle: int, data: memoryview, offset: int) -> int:
        free.wait()
        if offset + len(data) > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return os.pwrite(handle, data, offset)

    recorder = RunRecorder(tmp_path, "run-1", samples.metadata(), journal_file=failing(pwrite=full))
    free.clear()
    record(recorder, 100)
    free.set()
    path = recorder.close("complete")
    assert check_rows(path, 20) == recorder.durable == recorder.written
    a_block = 24 + 24 + 20 * (8 + 4 + 2 + 2)
    sealed_from = open_run(path).metadata["sealed_from"]
    assert sealed_from["bytes"] > room - a_block


def refuse(calls: list[int], refused: set[int]) -> Callable[[int], None]:
    """Return an fdatasync that fails at the calls of these numbers; ``calls`` gets a number a call."""

    def sync(handle: int) -> None:
        calls.append(len(calls))
        if calls[-1] in refused:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        os.fdatasync(handle)

    return sync


def record_until(recorder: RunRecorder, done: Callable[[], bool]) -> int:
    """Record block after block, each written before the next, until something has happened."""
    first = 0
    while not done():
        recorder.append(*samples.block(first))
        first += 20
        while recorder.written < first:
            pass
    return first


def test_a_failed_sync_begins_a_new_file_and_loses_nothing(tmp_path: Path) -> None:
    """After a failed fdatasync a second one may succeed and mean nothing (“fsyncgate”)."""
    calls: list[int] = []
    recorder = RunRecorder(
        tmp_path,
        "run-1",
        samples.metadata(),
        sync_interval_s=0.001,
        journal_file=failing(fdatasync=refuse(calls, {1, 5})),
    )
    first = record_until(recorder, lambda: len(calls) > 8)
    assert {"run-1.journal", "run-1.journal.1", "run-1.journal.2"} == {p.name for p in tmp_path.iterdir()}
    assert recorder.renewals == ("[Errno 5] Input/output error",) * 2
    assert recorder.failure is None
    record(recorder, 3, first)
    run = open_run(recorder.close("complete"))
    assert [path.name for path in tmp_path.iterdir()] == ["run-1.h5"]
    assert run.status == "complete"
    assert run.metadata["recorder"]["renewals"] == ["[Errno 5] Input/output error"] * 2
    assert check_rows(run.path, first + 60) == recorder.written == recorder.durable


def test_a_disk_that_takes_no_new_file_either_ends_the_recording(tmp_path: Path) -> None:
    calls: list[int] = []
    recorder = RunRecorder(
        tmp_path,
        "run-1",
        samples.metadata(),
        sync_interval_s=0.001,
        journal_file=failing(fdatasync=refuse(calls, set(range(1, 1000)))),
    )
    first = record_until(recorder, lambda: recorder.failure is not None)
    durable = recorder.durable
    record(recorder, 10, first)
    run = open_run(recorder.close("complete"))
    assert recorder.renewals == ()
    assert run.status == "failed"
    assert "Input/output error" in run.reason
    assert check_rows(run.path, durable) == recorder.written


def test_a_slow_disk_never_blocks_the_acquisition(tmp_path: Path) -> None:
    free = threading.Event()
    free.set()

    def slow(handle: int, data: memoryview, offset: int) -> int:
        free.wait()
        return os.pwrite(handle, data, offset)

    recorder = RunRecorder(
        tmp_path, "run-1", samples.metadata(), queue_blocks=4, journal_file=failing(pwrite=slow)
    )
    free.clear()
    record(recorder, 50)  # returns, although not one of them can be written
    assert isinstance(recorder.failure, RecordingFault)
    assert "the disk is too slow, 4 blocks waited" in str(recorder.failure)
    free.set()
    run = open_run(recorder.close("complete"))
    assert run.status == "failed"
    kept = run.streams["controller"]
    assert 80 <= kept.rows < 1000
    assert np.array_equal(kept.counts["force"], samples.counts(kept.sequence)["force"])


def test_a_journal_that_cannot_be_sealed_stays(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    record(recorder, 3)
    (tmp_path / "run-1.h5.tmp").mkdir()  # nothing can be written under this name
    with pytest.raises(RecordingFault, match=r"run-1\.journal: recorded, but not sealed"):
        recorder.close("complete")
    with pytest.raises(RecordingFault, match="not sealed"):
        recorder.close("complete")
    (tmp_path / "run-1.h5.tmp").rmdir()
    (path,) = seal_orphans(tmp_path)
    assert check_rows(path, 60) == 60
    assert open_run(path).status == "complete"


# --- processes that die -------------------------------------------------------------------------------


def kill_and_recover(directory: Path, acknowledgements: list[int]) -> None:
    """Kill recordings -9 after so many acknowledgements each; nothing acknowledged may be lost."""
    folders = [directory / str(number) for number in range(len(acknowledgements))]
    for folder in folders:
        folder.mkdir()
    orders = [f"{folder}={number}" for folder, number in zip(folders, acknowledgements, strict=True)]
    done = subprocess.run(
        [sys.executable, "-m", "tests.recording.record_child", "kill", *orders],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    acknowledged = [int(line) for line in done.stdout.splitlines()]
    assert len(acknowledged) == len(folders)
    for folder, samples_safe in zip(folders, acknowledged, strict=True):
        (path,) = seal_orphans(folder)
        rows = check_rows(path, samples_safe)
        run = open_run(path)
        assert rows % 20 == 0
        assert run.status == "recovered"
        assert "no end record" in run.reason
        assert run.metadata["run"]["ended_utc"] == ("2026-03-01T08:00:00+00:00" if run.anchors else None)
        assert [path.name for path in folder.iterdir()] == ["run-1.h5"]
    assert max(acknowledged) > 0


@pytest.mark.slow
def test_kill_9_loses_nothing_acknowledged(tmp_path: Path) -> None:
    kill_and_recover(tmp_path, [0, 1, 2, 5, 17, 40, 70, 100])


@pytest.mark.long
def test_kill_9_two_hundred_times(tmp_path: Path) -> None:
    dice = random.Random(200)
    kill_and_recover(tmp_path, [dice.randrange(300) for _ in range(200)])


def test_a_file_size_limit_ends_the_recording_with_a_warning_before(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.recording.record_child", "limit", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    first, final = done.stdout.splitlines()
    warned_at, acknowledged, *failure = first.split()
    assert 0 <= int(warned_at) < int(acknowledged) or int(warned_at) < int(final)
    assert "File too large" in " ".join(failure)
    run = open_run(tmp_path / "run-1.h5")
    assert run.status in ("failed", "recovered")
    assert check_rows(run.path, int(acknowledged)) == int(final)


# --- sealing ------------------------------------------------------------------------------------------


def journal_without_end(directory: Path) -> Path:
    """Return a journal as a crash leaves it, reserved space and all."""
    recorder = RunRecorder(directory, "run-1", samples.metadata(), sync_interval_s=0.001)
    record(recorder, 40)
    recorder.anchor(5_000_000_000, 7.0, "2026-03-01T08:00:00+00:00")
    while recorder.durable < 800:
        pass
    content = recorder.path.read_bytes()
    recorder.close("complete").unlink()
    recorder.path.write_bytes(content)
    return recorder.path


@pytest.mark.slow
@pytest.mark.parametrize("stride", [11, pytest.param(1, marks=pytest.mark.long)])
def test_sealing_killed_at_every_system_call(tmp_path: Path, stride: int) -> None:
    (tmp_path / "source").mkdir()
    (tmp_path / "killed").mkdir()
    journal = journal_without_end(tmp_path / "source")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "tests.recording.seal_child",
            str(journal),
            str(tmp_path / "killed"),
            str(stride),
        ],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    reference = seal(journal).read_bytes()
    folders = sorted((tmp_path / "killed").iterdir())
    assert len(folders) == int(done.stdout) // stride + 1
    assert len(folders) > 100 // stride
    for folder in folders:
        seal_orphans(folder)
        assert [path.name for path in folder.iterdir()] == ["run-1.h5"], folder.name
        assert (folder / "run-1.h5").read_bytes() == reference, folder.name


def test_sealing_again_changes_nothing(tmp_path: Path) -> None:
    journal = journal_without_end(tmp_path)
    content = journal.read_bytes()
    path = seal(journal)
    sealed = path.read_bytes()
    assert seal(journal) == path  # the journal is gone, the run is there
    journal.write_bytes(content)  # a crash between renaming and dropping the journal
    inode = path.stat().st_ino
    assert seal(journal) == path
    assert not journal.exists()
    assert path.read_bytes() == sealed
    assert path.stat().st_ino == inode
    assert check_rows(path, 800) == 800


def test_a_damaged_run_file_is_made_anew_from_its_journal(tmp_path: Path) -> None:
    journal = journal_without_end(tmp_path)
    content = journal.read_bytes()
    path = seal(journal)
    sealed = path.read_bytes()
    journal.write_bytes(content)
    samples.flipped(path, 8 * 3000)
    assert seal(journal).read_bytes() == sealed


def test_another_run_of_the_name_is_not_replaced(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    record(recorder, 3)
    other = recorder.close("complete")
    kept = other.read_bytes()
    (tmp_path / "second").mkdir()
    journal = journal_without_end(tmp_path / "second")
    journal.replace(tmp_path / "run-1.journal")
    with pytest.raises(BadInput, match="another run has this name"):
        seal_orphans(tmp_path)
    assert other.read_bytes() == kept
    assert (tmp_path / "run-1.journal").exists()


def test_journals_in_use_are_left_alone(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    record(recorder, 3)
    assert seal_orphans(tmp_path) == []
    with pytest.raises(BadInput, match="in use"):
        seal(recorder.path)
    assert check_rows(recorder.close("complete"), 60) == 60


def test_left_overs_of_starting_and_sealing_are_removed(tmp_path: Path) -> None:
    (tmp_path / "run-9.journal.tmp").write_bytes(b"BSJ1")
    (tmp_path / "run-8.h5.tmp").write_bytes(b"half a file")
    assert seal_orphans(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_a_journal_damaged_in_the_middle_is_not_thrown_away(tmp_path: Path) -> None:
    journal = journal_without_end(tmp_path)
    samples.flipped(journal, 8 * 10_000)
    damaged = journal.read_bytes()
    run = open_run(seal(journal))
    assert run.status == "recovered"
    assert "CRC" in run.reason
    assert "further records lie behind it" in run.reason
    assert 0 < check_rows(run.path, 1) < 800
    assert (tmp_path / "run-1.journal-damaged").read_bytes() == damaged
    assert seal_orphans(tmp_path) == []


def test_one_bad_journal_does_not_keep_the_others_from_being_sealed(tmp_path: Path) -> None:
    journal_without_end(tmp_path)
    (tmp_path / "a.journal").write_bytes(b"no journal at all")
    with pytest.raises(BadInput, match=r"a\.journal: the journal has no header"):
        seal_orphans(tmp_path)
    assert check_rows(tmp_path / "run-1.h5", 800) == 800


def test_an_empty_recording_becomes_a_run(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path, "run-1", samples.metadata())
    run = open_run(recorder.close("stopped", "nothing came"))
    assert dict(run.streams) == {}
    assert run.status == "stopped"
