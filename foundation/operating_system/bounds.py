"""Bounds of memory and time for what reads files from anywhere, and the share of the processor."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bufferstand.foundation.operating_system.windows_jobs import Job

if sys.platform != "win32":
    import fcntl
    import resource

_PIPE_BYTES = 1 << 20
_STATM = Path("/proc/self/statm")


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def bounded_memory(more_bytes: int) -> Iterator[None]:
    """While inside, this process may take only so much memory beyond what it has: more is a ``MemoryError``.

    Linux keeps the bound. macOS and Windows have none that a process could set for a while.

    Parameters
    ----------
    more_bytes : int
        Bytes beyond those that it has now.
    """
    if sys.platform == "win32" or not _STATM.exists():
        yield
        return
    before, hard = resource.getrlimit(resource.RLIMIT_AS)
    ends = [limit for limit in (before, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([_memory_bytes() + more_bytes, *ends]), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (before, hard))


class ReaderBounds:
    """How a process that reads for this one is started, bounded, and ended with this one.

    On Linux it bounds itself (:func:`bound_reader`) and is told by a pipe when this process ends. On macOS
    only the processor time is bounded. On Windows the process belongs to a job, which has the bound of memory
    and ends with this process; there is no bound of processor time, only that of waiting.

    Parameters
    ----------
    memory_bytes : int
        Memory that the other process may take (Windows).
    """

    def __init__(self, memory_bytes: int) -> None:
        self._memory_bytes = memory_bytes
        self._alive = -1
        self._job: Job | None = None

    def start(self, command: list[str], environment: dict[str, str], told: int) -> subprocess.Popen[bytes]:
        """Start the process with pipes for its input and output.

        Parameters
        ----------
        command : list of str
            Its last argument will be the descriptor for :func:`bound_reader`.
        environment : dict of str to str
        told : int
            Descriptor that takes its errors.

        Raises
        ------
        OSError
            If it cannot be started.
        """
        if sys.platform == "win32":
            process = subprocess.Popen(
                [*command, "-1"],
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=told,
                bufsize=0,
            )
            self._job = Job(process, self._memory_bytes)
            return process
        watched, self._alive = os.pipe()
        try:
            process = subprocess.Popen(
                [*command, str(watched)],
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=told,
                pass_fds=(watched,),
                start_new_session=True,  # an interrupt from the terminal is for this process alone
            )
            assert process.stdout is not None
            if hasattr(fcntl, "F_SETPIPE_SZ"):
                fcntl.fcntl(process.stdout, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
            return process
        finally:
            os.close(watched)

    def fill(self, process: subprocess.Popen[bytes], view: memoryview, patience_s: float) -> None:
        """Fill a buffer from the output of the process.

        Parameters
        ----------
        process : subprocess.Popen
            What :meth:`start` returned.
        view : memoryview of bytes
        patience_s : float
            How long to wait for the next byte.

        Raises
        ------
        TimeoutError
            If nothing came for so long.
        EOFError
            If the process has ended.
        """
        assert process.stdout is not None
        if sys.platform == "win32":
            _fill_by_waiting(process, view, patience_s)
            return
        handle = process.stdout.fileno()
        waiting = select.poll()
        waiting.register(handle, select.POLLIN)
        waited_s = 0
        while view:
            if not waiting.poll(1000):  # counted so, a process that was halted for hours has waited a second
                waited_s += 1
                if waited_s > patience_s:
                    raise TimeoutError
                continue
            taken = os.readv(handle, [view])
            if not taken:
                raise EOFError
            view = view[taken:]

    def close(self) -> None:
        """Let go of what held the process."""
        if self._job is not None:
            self._job.close()
            self._job = None
        if self._alive >= 0:
            os.close(self._alive)
            self._alive = -1


def _fill_by_waiting(process: subprocess.Popen[bytes], view: memoryview, patience_s: float) -> None:
    """Fill a buffer where a pipe cannot be asked what is there: too long a wait ends the process."""
    assert process.stdout is not None
    late = threading.Event()

    def end() -> None:
        late.set()
        process.kill()

    while view:
        timer = threading.Timer(patience_s, end)
        timer.daemon = True
        timer.start()
        try:
            taken = process.stdout.readinto(view)  # type: ignore[attr-defined]  # not buffered: a raw file
        finally:
            timer.cancel()
        if late.is_set():
            raise TimeoutError
        if not taken:
            raise EOFError
        view = view[taken:]


def bound_reader(alive: int, memory_bytes: int) -> None:
    """Bound this process, which reads for another one, and have it end with that.

    Parameters
    ----------
    alive : int
        Descriptor of a pipe whose other end closes when the other process ends.
    memory_bytes : int
        Memory that it may take beyond what it has now (Linux).
    """
    if sys.platform == "win32":  # the job does all of it
        return
    for number in (signal.SIGINT, signal.SIGHUP):  # of the terminal: for the process that asks
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    _die_with(alive)
    if _STATM.exists():
        most = _memory_bytes() + memory_bytes
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(
            resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
        )
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def bound_processor_time(seconds: float) -> None:
    """End this process after so much processor time; 0 takes the bound away. Windows has no such bound."""
    if sys.platform != "win32":
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _memory_bytes() -> int:
    pages = int(_STATM.read_text(encoding="ascii").split()[0])
    return pages * resource.getpagesize()


def _die_with(alive: int) -> None:
    """Have the system end this process when the other end of a pipe is closed, whatever runs then."""
    signal.signal(signal.SIGIO, signal.SIG_DFL)  # whose default is the end
    fcntl.fcntl(alive, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(alive, fcntl.F_SETFL, fcntl.fcntl(alive, fcntl.F_GETFL) | os.O_ASYNC | os.O_NONBLOCK)
    try:
        if not os.read(alive, 1):  # it was closed before that
            os._exit(1)
    except BlockingIOError:
        pass
