"""A job of Windows: a process in it ends with this one, and takes no more memory than it may.

Microsoft, Win32 API: ``CreateJobObjectW``, ``SetInformationJobObject`` with
``JOBOBJECT_EXTENDED_LIMIT_INFORMATION``, ``AssignProcessToJobObject``.
"""

from __future__ import annotations

import ctypes
import subprocess
from typing import Any, ClassVar

_EXTENDED_LIMIT_INFORMATION = 9
_LIMIT_PROCESS_MEMORY = 0x100
_LIMIT_KILL_ON_JOB_CLOSE = 0x2000


class _BasicLimits(ctypes.Structure):
    _fields_: ClassVar = [
        ("per_process_user_time_limit", ctypes.c_int64),
        ("per_job_user_time_limit", ctypes.c_int64),
        ("limit_flags", ctypes.c_uint32),
        ("minimum_working_set_size", ctypes.c_size_t),
        ("maximum_working_set_size", ctypes.c_size_t),
        ("active_process_limit", ctypes.c_uint32),
        ("affinity", ctypes.c_size_t),
        ("priority_class", ctypes.c_uint32),
        ("scheduling_class", ctypes.c_uint32),
    ]


class _ExtendedLimits(ctypes.Structure):
    _fields_: ClassVar = [
        ("basic", _BasicLimits),
        ("io_counters", ctypes.c_uint64 * 6),
        ("process_memory_limit", ctypes.c_size_t),
        ("job_memory_limit", ctypes.c_size_t),
        ("peak_process_memory_used", ctypes.c_size_t),
        ("peak_job_memory_used", ctypes.c_size_t),
    ]


class Job:
    """A job with one process; it ends when the job is closed, or this process ends.

    Parameters
    ----------
    process : subprocess.Popen
        A process that was just started.
    memory_bytes : int
        What it may take.

    Raises
    ------
    OSError
        If there can be no such job.
    """

    def __init__(self, process: subprocess.Popen[bytes], memory_bytes: int) -> None:
        self._kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
        self._kernel.CreateJobObjectW.restype = ctypes.c_void_p
        self._handle: ctypes.c_void_p | None = ctypes.c_void_p(self._kernel.CreateJobObjectW(None, None))
        limits = _ExtendedLimits()
        limits.basic.limit_flags = _LIMIT_KILL_ON_JOB_CLOSE | _LIMIT_PROCESS_MEMORY
        limits.process_memory_limit = memory_bytes
        self._check(
            self._kernel.SetInformationJobObject(
                self._handle, _EXTENDED_LIMIT_INFORMATION, ctypes.byref(limits), ctypes.sizeof(limits)
            )
        )
        of_process = ctypes.c_void_p(int(process._handle))  # type: ignore[attr-defined]
        self._check(self._kernel.AssignProcessToJobObject(self._handle, of_process))

    def close(self) -> None:
        """Let go of the job, which ends its process if it still runs."""
        handle, self._handle = self._handle, None
        if handle:
            self._kernel.CloseHandle(handle)

    def _check(self, done: int) -> None:
        if not done:
            error = ctypes.get_last_error()  # type: ignore[attr-defined]
            self.close()
            raise ctypes.WinError(error)  # type: ignore[attr-defined]
