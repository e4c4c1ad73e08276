"""One file of the journal: how it appears, what a failing disk leaves, what is reserved, who may use it."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.journal import file as module
from bufferstand.recording.journal.file import (
    RESERVE_BYTES,
    STARTING_PATTERN,
    JournalFile,
    lock_or_refuse,
    remove_journal,
)

MIB = 1024 * 1024
OPEN = Path("/proc/self/fd")


class Disk:
    """The system calls, each noted; those that are told to, fail."""

    def __init__(self, *, failing: str = "") -> None:
        self.failing = failing
        self.reserved: list[tuple[int, int]] = []
        self.synced = 0

    def pwrite(self, handle: int, data: bytes | memoryview, offset: int) -> int:
        if self.failing == "write" and offset:
            os.pwrite(handle, bytes(data)[:1], offset)
            raise OSError(errno.ENOSPC, "full")
        return os.pwrite(handle, data, offset)

    def fdatasync(self, handle: int) -> None:  # noqa: ARG002
        self.synced += 1
        if self.failing == "sync":
            raise OSError(errno.EIO, "broken")

    def fallocate(self, handle: int, offset: int, length: int) -> None:  # noqa: ARG002
        self.reserved.append((offset, length))
        if self.failing.startswith("reserve"):
            raise OSError(errno.ENOSPC, self.failing)


def journal(folder: Path, disk: Disk, header: bytes = b"header") -> JournalFile:
    return JournalFile(
        folder / "r.journal", header, pwrite=disk.pwrite, fdatasync=disk.fdatasync, fallocate=disk.fallocate
    )


def test_the_file_appears_with_its_header_and_grows_by_whole_frames(tmp_path: Path) -> None:
    file = journal(tmp_path, Disk())
    assert [path.name for path in tmp_path.iterdir()] == ["r.journal"]
    assert file.path.read_bytes() == b"header"
    assert file.size == 6
    file.append(b"more")
    assert (file.size, file.path.read_bytes()) == (10, b"headermore")
    assert file.disk_warning is None
    file.close()
    assert module.RESERVE_BYTES == 4 * MIB
    assert STARTING_PATTERN == "*.journal*.tmp"


def test_header_and_name_are_on_the_disk_before_anything_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    monkeypatch.setattr(os, "fsync", lambda handle: done.append("fsync"))  # noqa: ARG005
    rename = module.give_final_name
    monkeypatch.setattr(module, "give_final_name", lambda *paths: (done.append("name"), rename(*paths)))
    file = journal(tmp_path, Disk())
    assert done[:2] == ["fsync", "name"]
    done.clear()
    file.finish()
    assert done == ["fsync"]
    file.close()


def test_space_is_reserved_ahead_and_again_only_where_it_runs_out(tmp_path: Path) -> None:
    disk = Disk()
    file = journal(tmp_path, disk)
    reserved = 6 + 2 * RESERVE_BYTES
    assert disk.reserved == [(0, reserved)]
    file.append(b"x" * (RESERVE_BYTES - 1))
    file.append(b"x")
    assert len(disk.reserved) == 1, "just so much is still ahead"
    file.append(b"x")
    assert disk.reserved[1:] == [(reserved, 7 + 3 * RESERVE_BYTES - reserved)]
    file.append(b"x" * RESERVE_BYTES)
    assert len(disk.reserved) == 2
    file.append(b"x")
    assert len(disk.reserved) == 3
    file.close()


def test_space_that_cannot_be_reserved_is_said_once_and_asked_for_again(tmp_path: Path) -> None:
    disk = Disk(failing="reserve: first")
    file = journal(tmp_path, disk)
    said = "no 4 MiB could be reserved ahead of r.journal: reserve: first"
    assert file.disk_warning == said
    disk.failing = "reserve: second"
    file.append(b"x")
    assert len(disk.reserved) == 2
    assert file.disk_warning == said
    file.close()


def test_what_a_full_disk_took_of_a_frame_is_cut_off_again(tmp_path: Path) -> None:
    disk = Disk()
    file = journal(tmp_path, disk)
    disk.failing = "write"
    with pytest.raises(OSError, match="full"):
        file.append(b"torn")
    assert (file.size, file.path.read_bytes()) == (6, b"header")
    disk.failing = ""
    disk.reserved.clear()
    file.append(b"more")
    assert file.path.read_bytes() == b"headermore"
    assert disk.reserved == [(6, 4 + 2 * RESERVE_BYTES)], "the reserved space went with the torn frame"
    file.close()


def test_a_sync_reaches_the_disk_or_says_so(tmp_path: Path) -> None:
    disk = Disk()
    file = journal(tmp_path, disk)
    file.sync()
    assert disk.synced == 1
    disk.failing = "sync"
    with pytest.raises(OSError, match="broken"):
        file.sync()
    file.close()


def test_reserved_space_is_cut_off_at_the_end(tmp_path: Path) -> None:
    file = JournalFile(tmp_path / "r.journal", b"header")
    assert file.path.stat().st_size > 6
    file.finish()
    assert file.path.read_bytes() == b"header"
    file.close()


def test_a_run_that_has_a_journal_gets_no_second_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "r.journal").write_bytes(b"there")
    before = len(list(OPEN.iterdir()))
    with pytest.raises(
        BadInput, match=r"r\.journal: a journal of this run is there already; use another run id"
    ):
        journal(tmp_path, Disk())
    assert len(list(OPEN.iterdir())) == before, "nothing stays open"
    assert [path.name for path in tmp_path.iterdir()] == ["r.journal"]
    assert (tmp_path / "r.journal").read_bytes() == b"there"


def test_a_folder_that_takes_no_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"none: cannot record here: No such file or directory"):
        journal(tmp_path / "none", Disk())


def test_a_header_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    class Full(Disk):
        def pwrite(self, handle: int, data: bytes | memoryview, offset: int) -> int:  # noqa: ARG002
            raise OSError(errno.ENOSPC, "No space left on device")

    before = len(list(OPEN.iterdir()))
    with pytest.raises(BadInput, match="cannot record here: No space left on device"):
        journal(tmp_path, Full())
    assert list(tmp_path.iterdir()) == []
    assert len(list(OPEN.iterdir())) == before


def test_a_name_that_does_not_reach_the_disk_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def renamed(temporary: Path, final: Path) -> None:
        temporary.replace(final)
        raise OSError(errno.EIO, "the folder cannot be synchronised")

    monkeypatch.setattr(module, "give_final_name", renamed)
    with pytest.raises(BadInput, match="cannot record here: the folder cannot be synchronised"):
        journal(tmp_path, Disk())


def test_everybody_may_read_a_journal_and_only_its_owner_write_it(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        file = journal(tmp_path, Disk())
    finally:
        os.umask(before)
    assert file.path.stat().st_mode & 0o777 == 0o644
    file.close()


def test_what_an_earlier_attempt_left_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "r.journal.tmp").write_bytes(b"a much longer beginning than this one")
    file = journal(tmp_path, Disk())
    assert file.path.read_bytes() == b"header"
    file.close()


def test_a_journal_that_is_written_is_nobody_elses(tmp_path: Path) -> None:
    file = journal(tmp_path, Disk())
    handle = os.open(file.path, os.O_RDWR)
    with pytest.raises(BadInput, match=r"in use: it is being recorded or sealed; wait until that has ended"):
        lock_or_refuse(handle, file.path)
    file.close()
    lock_or_refuse(handle, file.path)
    (tmp_path / "r.journal").rename(tmp_path / "r.journal.tmp")
    with pytest.raises(BadInput, match="in use"):
        journal(tmp_path, Disk())
    os.close(handle)


def test_a_dropped_journal_stays_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(module, "sync_folder", synced.append)
    path = tmp_path / "r.journal"
    path.write_bytes(b"")
    remove_journal(path)
    remove_journal(path)
    assert not path.exists()
    assert synced == [tmp_path, tmp_path]
