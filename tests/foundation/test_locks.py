"""The lock on an open file: one holder at a time, or many that only look."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest

from bufferstand.foundation.operating_system import is_lock_taken, locks

pytestmark = pytest.mark.skipif(os.name == "nt", reason="on Windows every lock is an exclusive one")


@contextmanager
def opened(path: Path) -> Iterator[int]:
    handle = os.open(path, os.O_RDWR | os.O_CREAT)
    try:
        yield handle
    finally:
        os.close(handle)


def test_a_lock_keeps_out_every_other_until_its_file_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with opened(path) as other:
        with opened(path) as one:
            assert is_lock_taken(one)
            assert is_lock_taken(one), "its own keeps nobody out"
            assert not is_lock_taken(other)
            assert not is_lock_taken(other, shared=True)
        assert is_lock_taken(other)


def test_those_that_share_keep_out_only_who_wants_it_alone(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with ExitStack() as files:
        one, other, third = (files.enter_context(opened(path)) for _ in range(3))
        assert is_lock_taken(one, shared=True)
        assert is_lock_taken(other, shared=True)
        assert not is_lock_taken(third)


def test_what_cannot_be_locked_is_said(tmp_path: Path) -> None:
    with opened(tmp_path / "lock") as handle:
        pass
    with pytest.raises(OSError, match="Bad file descriptor"):
        is_lock_taken(handle)


class Msvcrt(ModuleType):
    """Windows' locks: bytes from where the file stands, each for one descriptor."""

    LK_NBLCK = 2

    def __init__(self) -> None:
        super().__init__("msvcrt")
        self.taken: dict[int, int] = {}

    def locking(self, handle: int, mode: int, count: int) -> None:
        assert mode == self.LK_NBLCK
        begin = os.lseek(handle, 0, os.SEEK_CUR)
        wanted = range(begin, begin + count)
        if any(self.taken.get(byte, handle) != handle for byte in wanted):
            raise PermissionError(13, "locked by another process")
        self.taken |= dict.fromkeys(wanted, handle)


def test_windows_locks_one_byte_behind_all_that_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run the code for Windows here, on locks as Windows has them: who reads meets no locked byte."""
    windows = Msvcrt()
    monkeypatch.setitem(sys.modules, "msvcrt", windows)
    monkeypatch.setattr(sys, "platform", "win32")
    assert locks.__file__ is not None
    spec = spec_from_file_location("locks_of_windows", locks.__file__)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    with opened(tmp_path / "lock") as one, opened(tmp_path / "lock") as other:
        os.write(one, b"what it holds")
        assert module.is_lock_taken(one)
        assert windows.taken == {1 << 20: one}
        assert os.lseek(one, 0, os.SEEK_CUR) == 0, "its reader begins where it would without"
        assert not module.is_lock_taken(other)
        assert not module.is_lock_taken(other, shared=True), "every lock is an exclusive one"
        assert module.is_lock_taken(one)
