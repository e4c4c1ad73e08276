"""The guard of the recording: it must take what comes, keep up with it, and find room on the disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from bufferstand.daq.guards import Action, Trip


class Recording(Protocol):
    """What is looked at of a recorder (:class:`bufferstand.recording.writer.RunRecorder`)."""

    @property
    def written(self) -> int:
        """Samples of the controller handed to the file."""
        ...

    @property
    def durable(self) -> int:
        """Samples of the controller known to be on the disk."""
        ...

    @property
    def failure(self) -> Exception | None:
        """Why it can no longer record, None while it can."""
        ...

    @property
    def disk_warning(self) -> str | None:
        """Why the disk will soon be full, None while it will not."""
        ...

    @property
    def renewals(self) -> Sequence[str]:
        """Why a journal file was given up for a new one."""
        ...


class RecorderGuard:
    """Looks at the recorder of one run, pass by pass.

    Parameters
    ----------
    stop_s : float
        What was written may wait for the disk so long [s]; a fifth of it is noted.
    steady_s : callable
        Monotonic time of the computer [s]: a disk does not know of stand time.
    """

    def __init__(self, stop_s: float, steady_s: Callable[[], float] = time.monotonic) -> None:
        self._stop_s = stop_s
        self._steady_s = steady_s
        self._renewals = 0
        self._durable = -1
        self._moved_s = steady_s()
        self._late_said, self._has_all = False, True

    def begin(self) -> None:
        """Forget the run before."""
        self._renewals, self._durable, self._late_said, self._has_all = 0, -1, False, True
        self._moved_s = self._steady_s()

    def look(self, recorder: Recording, at_s: float) -> list[Trip]:
        """Return what is to be said of it."""
        said: list[Trip] = []
        if recorder.failure is not None:
            why = f"recording failed: {recorder.failure}; what was on the disk before is kept"
            said.append(self._stop(why, at_s))
        elif recorder.disk_warning:
            said.append(self._stop(f"the disk is nearly full: {recorder.disk_warning}", at_s))
        for why in recorder.renewals[self._renewals :]:
            text = f"the disk refused a journal file, another was begun and nothing is lost: {why}"
            said.append(Trip("recorder", Action.NOTE, text, at_s))
        self._renewals = len(recorder.renewals)
        said += self._lateness(recorder.written, recorder.durable, at_s)
        return said

    def _lateness(self, written: int, durable: int, at_s: float) -> list[Trip]:
        now_s, had_all, self._has_all = self._steady_s(), self._has_all, durable >= written
        if durable != self._durable or had_all or self._has_all:  # what is written now has waited since now
            self._durable, self._moved_s, self._late_said = durable, now_s, False
            return []
        late_s = now_s - self._moved_s
        if late_s <= 0.2 * self._stop_s or (self._late_said and late_s <= self._stop_s):
            return []
        self._late_said = True
        text = (
            f"the disk is slow: {written - durable} samples have waited for it for {late_s:.1f} s "
            f"(stop at {self._stop_s:g} s); nothing is lost yet"
        )
        if late_s > self._stop_s:
            return [self._stop(text, at_s)]
        return [Trip("recorder", Action.NOTE, text, at_s, value=late_s, limit=self._stop_s, unit="s")]

    @staticmethod
    def _stop(why: str, at_s: float) -> Trip:
        return Trip("recorder", Action.STOP, why, at_s, device_fault=True)
