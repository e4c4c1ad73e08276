"""The lock on an open file: one holder at a time, or many that only look."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from bufferstand.foundation.operating_system import is_lock_taken

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
