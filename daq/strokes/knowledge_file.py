"""Stores what was learned of the stroke: one line a step, and a newer file while a step is under way.

``strokes.jsonl`` has what was learned by the end of each step. A step may last for hours, and a program that
is killed in it must not have learned for nothing: meanwhile ``strokes-now.json`` is written anew with the
cycles, at most once a second, and goes when the step's line is there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from bufferstand.daq.strokes.knowledge import StrokeKnowledge, is_knowledge
from bufferstand.daq.strokes.stroke_rows import read_strokes
from bufferstand.foundation.files import NotJson, json_content

NOW_NAME = "strokes-now.json"
EVERY_S = 1.0
"""It is written at most so often [s]."""


class StrokeKeeper:
    """Keeps what is learned while a step is under way.

    Parameters
    ----------
    folder : Path
        The campaign's.
    knowledge : StrokeKnowledge
        That learns.
    clock : callable, optional
        Returns a time that only rises [s].
    """

    def __init__(
        self, folder: Path, knowledge: StrokeKnowledge, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._path, self._knowledge, self._clock = folder / NOW_NAME, knowledge, clock
        self._cycles = knowledge.cycles
        self._kept_s = -EVERY_S

    def keep(self) -> None:
        """Write it if something was learned since, but not too often.

        The file is whole at any time. It is not brought to the disk: a pass of the loop may not wait for
        that, and after a loss of power the lines of the steps are left.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        now_s = self._clock()
        if self._knowledge.cycles == self._cycles or now_s - self._kept_s < EVERY_S:
            return
        self._cycles, self._kept_s = self._knowledge.cycles, now_s
        new = self._path.with_suffix(".tmp")
        new.write_text(json.dumps(self._knowledge.as_dict()) + "\n", encoding="utf-8")
        new.replace(self._path)

    def end(self) -> None:
        """Remove the file: all that was learned is in the step's line.

        Raises
        ------
        OSError
            If it cannot be removed.
        """
        self._cycles = self._knowledge.cycles
        self._path.unlink(missing_ok=True)


def learned_in(folder: Path) -> Mapping[str, Any] | None:
    """Return what was learned last in a campaign's folder; None where nothing was."""
    found = [line.get("learned") for line in read_strokes(folder)[-1:]]
    with suppress(OSError, NotJson):  # there is none, or a loss of power has cut it off
        found.append(json_content((folder / NOW_NAME).read_bytes()))
    whole = [one for one in found if is_knowledge(one)]
    return max(whole, key=lambda one: int(one["cycles"]), default=None)
