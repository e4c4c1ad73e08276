"""A computer in virtual time: its clocks, its disk and its memory, which a world can let fail.

The recorder is the real one. Its two threads end at once, and their work is done by whoever hands a block
over, when stand time says that they would: so a seed writes the same bytes in the same order every time.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty
from typing import Any

import numpy as np

from bufferstand.foundation import Clock
from bufferstand.recording.journal import JournalFile
from bufferstand.recording.recorder import RunRecorder

WRITE_S, SYNC_S = 0.02, 0.1
"""How often the recorder's threads write, and bring to the disk [s]."""
PASS_S = 0.02
"""Of the passes that are made while a thread seals [s of stand time]."""
_BATCH = 256


@dataclass
class Disk:
    """A disk, and what ails it."""

    full: bool = False
    slow_s: float = 0.0
    """So much later everything comes to the disk [s]."""
    _reserved: dict[int, int] = field(default_factory=dict)

    def journal_file(self, path: Path, header: bytes) -> JournalFile:
        """Make a journal on this disk."""
        return JournalFile(path, header, pwrite=self._pwrite, fallocate=self._fallocate)

    def demand_room(self) -> None:
        """Refuse what needs room that was not reserved.

        Raises
        ------
        OSError
            If it is full.
        """
        if self.full:
            raise OSError(errno.ENOSPC, "No space left on device")

    def _pwrite(self, handle: int, data: bytes | memoryview, offset: int) -> int:
        if self.full and offset + len(data) > self._reserved.get(handle, 0):
            self.demand_room()
        return os.pwrite(handle, data, offset)

    def _fallocate(self, handle: int, offset: int, size: int) -> None:
        self.demand_room()
        os.posix_fallocate(handle, offset, size)
        self._reserved[handle] = offset + size


@dataclass
class Memory:
    """The computer's memory: where the next demand for some is refused."""

    short_at: str = ""

    def demand(self, place: str) -> None:
        """Refuse, once, where it is short.

        Raises
        ------
        MemoryError
            If it is short here.
        """
        if place == self.short_at:
            self.short_at = ""
            raise MemoryError(f"no memory left (in {place})")


@dataclass
class Evidence:
    """What a recorder was given and what it acknowledged, as nobody can alter it afterwards."""

    run_id: str
    start: int
    given: dict[str, list[tuple[Any, Any, dict[str, Any]]]] = field(default_factory=dict)
    acknowledged: int = 0
    handed_over: int = 0
    closed: str = ""

    def of(self, stream: str) -> tuple[Any, Any, dict[str, Any]]:
        """Return sequence numbers, time stamps and counts of a stream."""
        blocks = self.given[stream]
        names = blocks[0][2]
        return (
            np.concatenate([block[0] for block in blocks]),
            np.concatenate([block[1] for block in blocks]),
            {name: np.concatenate([block[2][name] for block in blocks]) for name in names},
        )


@dataclass
class Computer:
    """What a start of the campaign runs on."""

    clock: Clock
    disk: Disk = field(default_factory=Disk)
    memory: Memory = field(default_factory=Memory)
    set_by_s: float = 0.0
    """By how much its civil time was set [s]."""
    evidence: list[Evidence] = field(default_factory=list)
    start: int = 0
    seals_in_s: float = 0.1
    """So much stand time passes while a run is sealed [s]."""

    def recorder(self, folder: Path, run_id: str, metadata: Mapping[str, Any]) -> RunRecorder:
        """Make the recorder of a run."""
        return VirtualRecorder(folder, run_id, metadata, self)

    def take_over(self) -> None:
        """Let the program go by this computer's clocks and disk, for the rest of this process' life."""
        from bufferstand.daq.acquisition import loop
        from bufferstand.daq.campaign.loop_passes import LoopPasses
        from bufferstand.daq.campaign_folder import folder as record
        from bufferstand.daq.guards.kinds.recorder import RecorderGuard
        from bufferstand.daq.strokes.knowledge_file import StrokeKeeper
        from bufferstand.recording.sealing import seal_journal

        loop.steady_s = self.clock.now_s  # type: ignore[attr-defined]
        _with_defaults(loop.Acquisition, civil_s=lambda: 1.8e9 + self.clock.now_s() + self.set_by_s)
        _with_defaults(RecorderGuard, steady_s=self.clock.now_s)
        _with_defaults(StrokeKeeper, clock=self.clock.now_s)
        LoopPasses.meanwhile = _bound(self)  # type: ignore[method-assign, assignment]
        for owner, name, place in (
            (seal_journal, "write_columns", "seal"),
            (record, "write_whole", "record"),
        ):
            setattr(owner, name, self._demanding(getattr(owner, name), place))

    def _demanding(self, write: Callable[..., Any], place: str) -> Callable[..., Any]:
        def refused_if_short(*words: Any, **named: Any) -> Any:
            self.disk.demand_room()
            self.memory.demand(place)
            return write(*words, **named)

        return refused_if_short


def _with_defaults(owner: Any, **defaults: Any) -> None:
    real = owner.__init__

    def init(one: Any, *words: Any, **named: Any) -> None:
        real(one, *words, **{**defaults, **named})

    owner.__init__ = init


def _bound(computer: Computer) -> Callable[[Any, Callable[[], object]], BaseException | None]:
    return lambda passes, work: _meanwhile(computer, passes, work)


def _meanwhile(computer: Computer, passes: Any, work: Callable[[], object]) -> BaseException | None:
    """Do in one thread what is done in two: the work, and the passes that would be made meanwhile."""
    raised: BaseException | None = None
    try:
        work()
    except BaseException as error:  # noqa: BLE001 - as a future keeps it
        raised = error
    until_s = computer.clock.now_s() + computer.seals_in_s
    while computer.clock.now_s() < until_s:
        passes._tick_safely()
        computer.clock.sleep(PASS_S)
    return raised


class VirtualRecorder(RunRecorder):
    """The recorder, whose threads' work is done by who hands over, in stand time.

    Parameters
    ----------
    directory, run_id, metadata
        As of a recorder.
    computer : Computer
        Its clock and disk.
    """

    def __init__(self, directory: Path, run_id: str, metadata: Mapping[str, Any], computer: Computer) -> None:
        self._computer = computer
        self._write_due_s = self._sync_due_s = 0.0
        super().__init__(directory, run_id, metadata, journal_file=computer.disk.journal_file)
        self.evidence = Evidence(run_id, computer.start)
        computer.evidence.append(self.evidence)

    def append(
        self, stream: str, sequence: int, time_us: Any, counts: Mapping[str, Any], lost: int = 0
    ) -> None:
        """Record a block, and keep what was given."""
        self._computer.memory.demand("append")
        kept = {name: np.array(values) for name, values in counts.items()}
        self.evidence.given.setdefault(stream, []).append(
            (np.arange(sequence, sequence + len(time_us)), np.array(time_us), kept)
        )
        super().append(stream, sequence, time_us, counts, lost)

    def close(self, status: str, reason: str = "") -> Path:
        """End the recording, and keep what was acknowledged."""
        try:
            return super().close(status, reason)
        finally:
            self.evidence.closed = status
            self._note_acknowledged()

    def _write(self) -> None:
        """End the writer's thread: its work is done elsewhere."""

    def _sync(self) -> None:
        """End the sync thread."""

    def _hand_over(self, item: Any) -> None:
        super()._hand_over(item)
        now_s = self._computer.clock.now_s()
        if now_s >= self._write_due_s:
            self._write_due_s = now_s + WRITE_S
            self._write_what_waits()
        if now_s >= self._sync_due_s:
            first = self._sync_due_s == 0.0
            self._sync_due_s = now_s + SYNC_S + self._computer.disk.slow_s
            if not first or not self._computer.disk.slow_s:
                self._acknowledge()
                self._note_acknowledged()

    def _write_what_waits(self) -> None:
        items: list[Any] = []
        while True:
            try:
                while len(items) < _BATCH:
                    items.append(self._queue.get_nowait())
            except Empty:
                break
            self._write_batch(items)
            items = []
        if items:
            self._write_batch(items)

    def _stop_threads(self) -> None:
        self._write_what_waits()
        super()._stop_threads()

    def _note_acknowledged(self) -> None:
        self.evidence.acknowledged = max(self.evidence.acknowledged, self.durable)
