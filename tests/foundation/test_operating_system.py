"""What differs between systems, with each system's way tried here."""

from __future__ import annotations

import ctypes
import os
import runpy
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.foundation import BadInput
from bufferstand.foundation.operating_system import (
    ENDING_SIGNALS,
    ReaderBounds,
    bounded_memory,
    bounds,
    is_lock_taken,
    let_signals_come,
    make_read_only,
    nameless_file,
    need_linux,
    read_at,
    reserve_space,
    signals_held,
    sync_data,
    sync_folder,
    usable_cores,
    write_at,
)
from bufferstand.foundation.operating_system import windows_jobs as jobs
from bufferstand.foundation.operating_system.bounds import _fill_by_waiting

CALLS = (
    "pread",
    "pwrite",
    "posix_fallocate",
    "fdatasync",
    "fchmod",
    "memfd_create",
    "sched_getaffinity",
)


@pytest.fixture(params=["all calls", "only common calls"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Linux, and a system that has what all have."""
    if request.param == "only common calls":
        for name in CALLS:
            monkeypatch.delattr(os, name)
        monkeypatch.delattr(signal, "pthread_sigmask")
    return str(request.param)


@pytest.mark.usefixtures("system")
def test_places_of_a_file_are_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    handle = os.open(path, os.O_RDWR | os.O_CREAT)
    reserve_space(handle, 0, 1000)
    assert write_at(handle, b"stroke\n", 3) == 7
    assert write_at(handle, memoryview(b"abc"), 0) == 3
    assert read_at(handle, 7, 3) == b"stroke\n"
    sync_data(handle)
    sync_folder(tmp_path)
    make_read_only(handle, path)
    os.close(handle)
    assert path.stat().st_mode & 0o222 == 0


def test_space_that_is_not_there_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "posix_fallocate")
    with (tmp_path / "file").open("wb") as stream:
        reserve_space(stream.fileno(), 0, 1)
        with pytest.raises(OSError, match="No space left"):
            reserve_space(stream.fileno(), 0, 1 << 62)


def test_a_folder_is_not_synchronised_where_that_is_no_call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "O_DIRECTORY")
    sync_folder(tmp_path / "is not looked for")


@pytest.mark.usefixtures("system")
def test_a_nameless_file_takes_what_is_written() -> None:
    handle = nameless_file()
    os.write(handle, b"told")
    assert (os.fstat(handle).st_size, read_at(handle, 10, 0)) == (4, b"told")
    os.close(handle)


@pytest.mark.usefixtures("system")
def test_cores_and_signals() -> None:
    assert 1 <= usable_cores() <= 4096
    assert signal.SIGINT in ENDING_SIGNALS
    with signals_held():
        pass
    let_signals_come([signal.SIGTERM])


def test_signals_wait_while_they_are_held() -> None:
    came = []
    before = signal.signal(signal.SIGTERM, lambda *_: came.append(1))
    try:
        with signals_held():
            signal.pthread_kill(threading.get_ident(), signal.SIGTERM)  # to this thread: others hold nothing
            assert came == []
        assert came == [1]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_lock_is_held_by_one(tmp_path: Path) -> None:
    one, other = (os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT) for _ in range(2))
    assert is_lock_taken(one)
    assert not is_lock_taken(other)
    assert not is_lock_taken(other, shared=True)
    os.close(one)
    assert is_lock_taken(other)
    os.close(other)


def test_memory_is_bounded_here_and_not_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    with bounded_memory(100 << 20), pytest.raises(MemoryError):
        bytearray(1 << 30)
    monkeypatch.setattr(sys, "platform", "win32")
    with bounded_memory(1 << 20):
        assert len(bytearray(200 << 20)) == 200 << 20


def _child(code: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, bufsize=0)


Fill = Callable[[subprocess.Popen[bytes], memoryview, float], None]


@pytest.mark.parametrize("fill", [ReaderBounds(1 << 30).fill, _fill_by_waiting], ids=["poll", "wait"])
def test_output_is_taken_in_until_it_ends_or_is_late(fill: Fill) -> None:
    taken = bytearray(6)
    with _child("import os; os.write(1, b'abc'); os.write(1, b'def')") as child:
        fill(child, memoryview(taken), 60.0)
        with pytest.raises(EOFError):
            fill(child, memoryview(bytearray(1)), 60.0)
    assert taken == b"abcdef"
    with _child("import time; time.sleep(600)") as silent:
        with pytest.raises(TimeoutError):
            fill(silent, memoryview(bytearray(1)), 0.5)
        silent.kill()


def test_stand_half_needs_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    need_linux("run")
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(BadInput, match="“run” needs Linux"):
        need_linux("run")


class _Kernel:
    """What :class:`Job` calls of Windows, as Microsoft describes it."""

    def __init__(self, *, refuses: str = "") -> None:
        self.calls: list[tuple[str, Any]] = []
        self.refuses = refuses
        self.CreateJobObjectW = self._named("CreateJobObjectW", 77)
        for name in ("AssignProcessToJobObject", "CloseHandle"):
            setattr(self, name, self._named(name, 0 if name == refuses else 1))

    def _named(self, name: str, answer: int) -> Any:
        def call(*arguments: Any) -> int:
            self.calls.append((name, arguments))
            return answer

        return call

    def SetInformationJobObject(self, job: Any, kind: int, limits: Any, size: int) -> int:  # noqa: N802
        held = limits._obj
        self.calls.append(
            ("limits", (job.value, kind, size, held.basic.limit_flags, held.process_memory_limit))
        )
        return 1


def _process() -> Any:
    return SimpleNamespace(_handle=55)


def test_job_of_windows_bounds_memory_and_ends_with_its_holder(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = _Kernel()
    monkeypatch.setattr(ctypes, "WinDLL", lambda *_, **__: kernel, raising=False)
    job = jobs.Job(_process(), 1 << 30)
    job.close()
    job.close()
    names = [name for name, _ in kernel.calls]
    assert names == ["CreateJobObjectW", "limits", "AssignProcessToJobObject", "CloseHandle"]
    handle, kind, size, flags, memory = kernel.calls[1][1]
    # JobObjectExtendedLimitInformation is 9, 144 bytes; KILL_ON_JOB_CLOSE 0x2000, PROCESS_MEMORY 0x100
    assert (handle, kind, size, flags, memory) == (77, 9, 144, 0x2100, 1 << 30)
    assert kernel.calls[2][1][1].value == 55


def test_job_that_is_refused_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = _Kernel(refuses="AssignProcessToJobObject")
    monkeypatch.setattr(ctypes, "WinDLL", lambda *_, **__: kernel, raising=False)
    monkeypatch.setattr(ctypes, "get_last_error", lambda: 5, raising=False)
    monkeypatch.setattr(ctypes, "WinError", lambda code: PermissionError(code, "denied"), raising=False)
    with pytest.raises(PermissionError):
        jobs.Job(_process(), 1 << 30)
    assert kernel.calls[-1][0] == "CloseHandle"


def test_reader_of_windows_is_in_a_job_and_is_told_no_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[tuple[object, int]] = []

    class Job:
        def __init__(self, process: object, memory_bytes: int) -> None:
            held.append((process, memory_bytes))

        def close(self) -> None:
            held.append((None, 0))

    monkeypatch.setattr(bounds, "Job", Job)
    monkeypatch.setattr(sys, "platform", "win32")
    reader = ReaderBounds(1 << 30)
    told = nameless_file()
    code = "import os, sys; os.write(1, sys.argv[1].encode())"
    with reader.start([sys.executable, "-c", code], dict(os.environ), told) as process:
        taken = bytearray(2)
        reader.fill(process, memoryview(taken), 60.0)
        reader.close()
    os.close(told)
    assert taken == b"-1"
    assert held == [(process, 1 << 30), (None, 0)]
    bounds.bound_reader(-1, 1)  # the job does it: nothing is asked of the system
    bounds.bound_processor_time(5.0)
    assert signal.getitimer(signal.ITIMER_PROF)[0] == 0.0


def test_lock_of_windows_is_on_a_byte_behind_the_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at: list[tuple[int, int]] = []

    def locking(handle: int, mode: int, size: int) -> None:
        if at:
            raise PermissionError
        at.append((os.lseek(handle, 0, os.SEEK_CUR), size))
        assert mode == 2

    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))  # type: ignore[arg-type]
    monkeypatch.setattr(sys, "platform", "win32")
    take = runpy.run_path(str(Path(bounds.__file__).with_name("locks.py")))["is_lock_taken"]
    handle = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)
    assert take(handle)
    assert os.lseek(handle, 0, os.SEEK_CUR) == 0
    assert not take(handle)
    os.close(handle)
    assert at == [(1 << 20, 1)]
