"""How a program dies in virtual time: at a chosen step of recorder, campaign record or safe stop.

The process is forked at that very step and the old one ends at once, with its threads and whatever its
frames still meant to do. The new one has the same memory, and so the same stand; it lets go of every file
and socket that the dead program had, as the kernel does for one that was killed, never returns into the dead
program's frames, and goes on with the life of the world. What is on the disk is what was written by then.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

STEPS = (
    "journal-begun", "journal-torn", "journal-written", "journal-synced", "journal-finished",
    "seal-begins", "file-torn", "file-without-name", "file-named", "journal-removed",
    "record-torn", "record-saved",
    "stop-begins", "stop-held", "stop-releases", "stop-waits", "stop-switches-off", "stop-ends",
    "request-sent", "request-taken",
)  # fmt: skip
"""Steps at which a program can be killed, beside any moment of stand time."""


class Death:
    """Waits for a step, and ends the program there.

    Parameters
    ----------
    folder : Path
        Of the campaign: the dead program's files below it are let go.
    afterwards : callable
        What goes on with the world; it must not return.
    """

    def __init__(self, folder: Path, afterwards: Callable[[str], NoReturn]) -> None:
        self._folder, self._afterwards = folder, afterwards
        self._step, self._left = "", 0
        self.struck = ""
        """At which step the program died; empty while it lives."""
        self.spent_s = 0.0
        """Processor time of the processes that are gone [s]."""

    def arm(self, step: str, count: int) -> None:
        """Let it come at the so-many-th time that a step is reached from now on."""
        self._step, self._left = step, count

    def disarm(self) -> None:
        """Let nobody die."""
        self._step = ""

    def due(self, step: str) -> bool:
        """Count a step; return whether it is the one to die at."""
        if step != self._step:
            return False
        self._left -= 1
        return self._left <= 0

    def reach(self, step: str) -> None:
        """Count a step, and die if it is the one."""
        if self.due(step):
            self.die(step)

    def die(self, step: str) -> NoReturn:
        """End the program here."""
        self.disarm()
        self.struck = step
        self.spent_s += time.process_time()
        if os.fork():
            os._exit(0)
        self.let_go()
        self._afterwards(step)

    def let_go(self) -> None:
        """Close what the kernel closes for a program that is gone: locks of journals, and sockets."""
        for entry in Path("/proc/self/fd").iterdir():
            handle = int(entry.name)
            try:
                leads_to = str(entry.readlink())
            except OSError:
                continue  # the listing's own handle
            if leads_to.startswith(("socket:", str(self._folder))):
                os.close(handle)


def set_traps(death: Death, wire: Any) -> None:
    """Let every step of :data:`STEPS` be told to ``death``; for the rest of this process' life."""
    from bufferstand.daq.campaign_folder import folder as record
    from bufferstand.daq.motions.safe_stop import SafeStop
    from bufferstand.recording.journal.file import JournalFile
    from bufferstand.recording.runfile import file as run_file
    from bufferstand.recording.sealing import seal_journal

    _after(JournalFile, "_begin", death, "journal-begun")
    _torn_append(JournalFile, death)
    _after(JournalFile, "append", death, "journal-written")
    _after(JournalFile, "sync", death, "journal-synced")
    _after(JournalFile, "finish", death, "journal-finished")
    _before(seal_journal, "outline", death, "seal-begins")
    _before(run_file, "give_final_name", death, "file-without-name", torn=lambda new, _: new)
    _before(seal_journal, "_put_away", death, "file-named")
    _after(seal_journal, "remove_journal", death, "journal-removed")
    _torn_record(record, death)
    _after(record, "write_whole", death, "record-saved")
    _before(SafeStop, "_stop", death, "stop-begins")
    _after(SafeStop, "_hold", death, "stop-held")
    _before(SafeStop, "_release", death, "stop-releases")
    _before(SafeStop, "_wait", death, "stop-waits")
    _before_order(SafeStop, death)
    _before(SafeStop, "_describe", death, "stop-ends")
    _before(wire, "lost", death, "request-sent")
    _after(wire.responder, "answer", death, "request-taken")


def _after(owner: Any, name: str, death: Death, step: str) -> None:
    real = getattr(owner, name)

    def then(*words: Any, **named: Any) -> Any:
        result = real(*words, **named)
        death.reach(step)
        return result

    setattr(owner, name, then)


def _before(owner: Any, name: str, death: Death, step: str, torn: Callable[..., Path] | None = None) -> None:
    real = getattr(owner, name)

    def first(*words: Any, **named: Any) -> Any:
        if torn is not None and death.due("file-torn"):  # as a kill in the midst of writing leaves it
            path = torn(*words)
            os.truncate(path, path.stat().st_size // 2)
            death.die("file-torn")
        death.reach(step)
        return real(*words, **named)

    setattr(owner, name, first)


def _torn_append(journal_file: Any, death: Death) -> None:
    real = journal_file.append

    def append(file: Any, frames: bytes) -> None:
        if frames and death.due("journal-torn"):
            os.pwrite(file._handle, frames[: len(frames) // 2], file.size)
            death.die("journal-torn")
        real(file, frames)

    journal_file.append = append


def _torn_record(record: Any, death: Death) -> None:
    real = record.write_whole

    def write_whole(path: Path, content: bytes) -> None:
        if death.due("record-torn"):
            path.with_name(f".{path.name}.new").write_bytes(content[: len(content) // 2])
            death.die("record-torn")
        real(path, content)

    record.write_whole = write_whole


def _before_order(safe_stop: Any, death: Death) -> None:
    real = safe_stop._ask

    def ask(stop: Any, what: str, order: Callable[[], Any]) -> Any:
        if what == "valve off":
            death.reach("stop-switches-off")
        return real(stop, what, order)

    safe_stop._ask = ask
