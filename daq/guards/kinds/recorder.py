"""The guard of the recording: it must take what comes, keep up with it, and find room on the disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Happening, Recorded, RecorderState, RunBegun, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip


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

    def look(self, recorder: RecorderState, at_s: float) -> list[Trip]:
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

    @property
    def late_s(self) -> float:
        """Return for how long something has waited for the disk [s]."""
        return 0.0 if self._has_all else self._steady_s() - self._moved_s

    @staticmethod
    def _stop(why: str, at_s: float) -> Trip:
        return Trip("recorder", Action.STOP, why, at_s, device_fault=True)


@dataclass(frozen=True)
class DiskGuard(Guard[RecorderGuard]):
    """What was written may wait for the disk so long.

    Parameters
    ----------
    stop_s : float
        Longer stops [s]; a fifth of it is noted.
    """

    kind: ClassVar = "disk_stop_s"
    title: ClassVar = "the recording takes what comes"
    settings: ClassVar = ("guards.disk_stop_s",)
    facts_as: ClassVar = "one"
    docs: ClassVar = ("`recorder`",)
    looks_at: ClassVar = (Recorded,)
    turn: ClassVar = 140
    in_journal: ClassVar = False
    standing: ClassVar = True

    stop_s: float = 10.0

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it for every campaign."""
        yield cls(site.table.disk_stop_s)

    def begin(self, wall_s: float) -> RecorderGuard:
        """Return that nothing waits."""
        return RecorderGuard(self.stop_s)

    def look(self, memory: RecorderGuard, sight: Sight, beside: Beside) -> tuple[RecorderGuard, Found]:
        """Judge the recorder."""
        return memory, memory.look(sight.recorder, beside.at_s) if isinstance(sight, Recorded) else None

    def after(self, memory: RecorderGuard, happening: Happening) -> RecorderGuard:
        """Return its memory; that of another run begins anew."""
        if isinstance(happening, RunBegun):
            memory.begin()
        return memory

    def margin(self, memory: RecorderGuard, beside: Beside) -> Margin:
        """Return for how long something has waited."""
        text = f"{memory.late_s:.1f} s behind, trips after {self.stop_s:g} s"
        return Margin("disk", "disk", text, memory.late_s / self.stop_s, Action.STOP)

    def facts(self) -> float:
        """Return its limit alone."""
        return self.stop_s
