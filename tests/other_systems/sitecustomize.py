"""Makes a Python process lack what Windows lacks; each that finds this folder on PYTHONPATH loads it.

What is loaded here first chose its code by the real system and keeps it: only bufferstand takes the other
way. The lock of files is kept by POSIX; a job of Windows is one that does nothing.
"""

from __future__ import annotations

import asyncio  # noqa: F401 - loaded while the system is still itself
import ctypes.util  # noqa: F401
import importlib
import logging.handlers  # noqa: F401
import multiprocessing.connection
import multiprocessing.pool
import multiprocessing.popen_spawn_posix
import multiprocessing.resource_tracker
import multiprocessing.spawn
import multiprocessing.synchronize  # noqa: F401
import os
import select
import shutil  # noqa: F401
import signal
import ssl
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
import types
import uuid  # noqa: F401
from concurrent.futures import process as _pool  # noqa: F401
from contextlib import suppress

LOADED_BEFORE = (
    *("numpy", "scipy.optimize", "scipy.linalg", "h5py", "pandas", "matplotlib.figure"),
    *("matplotlib.font_manager", "matplotlib.backends.backend_svg", "click", "rich.console", "serial"),
    *("pymodbus.client", "mimetypes", "tzlocal"),
)
for _name in LOADED_BEFORE:
    with suppress(ImportError):  # some come with extras
        importlib.import_module(_name)

LACKING = ("fcntl", "resource", "termios", "tty", "pty", "pwd", "grp")
NO_SYSTEM_CALLS = (
    *("fork", "pread", "pwrite", "preadv", "readv", "fdatasync", "posix_fallocate", "fchmod", "memfd_create"),
    *("sched_getaffinity", "nice", "getuid", "geteuid", "killpg", "setsid", "mkfifo", "O_NOFOLLOW"),
    *("O_DIRECTORY", "O_NONBLOCK", "O_CLOEXEC", "fchown", "chown", "sysconf"),
)
NO_SIGNALS = (
    "SIGHUP",
    "SIGUSR1",
    "SIGUSR2",
    "SIGPROF",
    "SIGIO",
    "SIGALRM",
    "setitimer",
    "ITIMER_PROF",
    "alarm",
)


def _locked(handle: int, mode: int, size: int) -> None:
    try:
        os.lockf(handle, os.F_TLOCK, size)
    except OSError:
        raise PermissionError(13, "Permission denied") from None


class Job:
    """Does nothing."""

    def __init__(self, process: object, memory_bytes: int) -> None: ...

    def close(self) -> None: ...


def _hide() -> None:
    for name in LACKING:
        sys.modules[name] = None  # type: ignore[assignment]  # importing it fails
    for name in NO_SYSTEM_CALLS:
        if hasattr(os, name):
            delattr(os, name)
    for name in NO_SIGNALS:
        if hasattr(signal, name):
            delattr(signal, name)
    del select.poll
    sys.modules["msvcrt"] = types.SimpleNamespace(locking=_locked, LK_NBLCK=2)  # type: ignore[assignment]
    jobs = types.ModuleType("bufferstand.foundation.operating_system.windows_jobs")
    jobs.Job = Job  # type: ignore[attr-defined]
    sys.modules[jobs.__name__] = jobs
    ssl.enum_certificates = lambda _: []  # type: ignore[attr-defined]  # the store of Windows
    sys.platform = "win32"


_hide()
