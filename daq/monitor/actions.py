"""What a page can do: stop, and write a note. Both go the way of ``bufferstand stop`` and ``note``."""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from bufferstand.daq.monitor.access import is_loopback
from bufferstand.daq.operator import LEVELS, LONGEST_NAME, add_note, ask, signed_note
from bufferstand.foundation import BadInput

LOG_NAME = "actions.jsonl"
"""What was asked for through pages, in the campaign's folder: one line each, only ever added to."""
LONGEST_WHO = 40
NOTES_A_MINUTE = 20
REFUSALS_LOGGED = 200
"""So many refused attempts are written down at most: a stranger must not fill the disk."""

Outcome = Literal["done", "refused"]


def who_asks(name: str, address: str) -> str:
    """Return e.g. ``monitor: A. Smith at 192.168.1.7`` from what somebody calls himself and his address."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in name).split())[:LONGEST_WHO]
    place = "this computer" if is_loopback(address) else address
    return f"monitor: {plain or 'someone'} at {place}"[:LONGEST_NAME]


class Actions:
    """Acts on a campaign for pages, and writes down who did what and when. Its methods may block.

    Parameters
    ----------
    folder : Path
        The campaign's folder.
    wall_s : callable
        Time of the wall [s].
    """

    def __init__(self, folder: Path, wall_s: Callable[[], float] = time.monotonic) -> None:
        self._folder = folder
        self._wall_s = wall_s
        self._noted_s: deque[float] = deque(maxlen=NOTES_A_MINUTE)
        self._refused = 0

    def stop(self, after: str, who: str) -> str:
        """Ask the campaign to stop; return what it answers.

        Raises
        ------
        BadInput
            If there is no such way to stop, it refuses, or none runs.
        """
        if after not in LEVELS:
            raise BadInput(f"there is no stop “{after[:20]}”: {', '.join(LEVELS)}")
        answer = ask(self._folder, {"stop": after, "by": who})
        if answer is None:
            self.log(who, f"stop {after}", "refused", "no campaign can be reached in this folder")
            raise BadInput("no campaign can be reached in this folder: use the stand's own controls")
        self.log(who, f"stop {after}", "done", answer)
        return answer

    def note(self, text: str, who: str) -> str:
        """Add a note: to the run under way, or where none is, to the folder.

        Raises
        ------
        BadInput
            If it is empty, too long, one of too many, or cannot be written.
        """
        line = signed_note(text, who)
        now_s = self._wall_s()
        if len(self._noted_s) == NOTES_A_MINUTE and now_s - self._noted_s[0] < 60.0:
            raise BadInput(f"more than {NOTES_A_MINUTE} notes in a minute", remedy="wait a moment")
        self._noted_s.append(now_s)
        if ask(self._folder, {"note": text, "by": who}) is None:
            try:
                add_note(self._folder, line)
            except OSError as error:
                raise BadInput(f"the note could not be written: {error.strerror}") from None
        self.log(who, "note", "done", line)
        return "noted"

    def refused(self, address: str, what: str) -> None:
        """Write down that somebody without the right to tried something."""
        self._refused += 1
        if self._refused <= REFUSALS_LOGGED:
            self.log(f"someone at {address}", what, "refused", "not allowed")

    def log(self, who: str, what: str, outcome: Outcome, text: str) -> None:
        """Add a line to the log; a disk that does not take it hinders nothing."""
        line = {
            "utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "who": who,
            "what": what,
            "outcome": outcome,
            "text": text,
        }
        with suppress(OSError):
            handle = os.open(self._folder / LOG_NAME, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                os.write(handle, (json.dumps(line, ensure_ascii=False) + "\n").encode())
            finally:
                os.close(handle)
