"""The exception for bad input, and the exit statuses that users script against."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path

from bufferstand.foundation.plain_text import plain


class ExitStatus(IntEnum):
    """Exit status of every command (docs/commands.md)."""

    DONE = 0
    SPECIMEN_FAILED = 1
    BAD_INPUT = 2
    STOPPED = 3
    DEVICE_FAULT = 4


MORE_SHOWN = 12
"""So many further findings of one file are shown; the others are counted."""

LONGEST_WORD = 200
"""Characters of a word or quotation that a message repeats: of a longer one its two ends are shown."""
_TOO_LONG = re.compile(rf"(?<=“)[^“”]{{{LONGEST_WORD + 1},}}(?=”)|\S{{{LONGEST_WORD + 1},}}")


class BadInput(Exception):  # noqa: N818 - it names the fact, and reads so at every raise
    """Input that cannot be used, with all that a user needs to mend it.

    Parameters
    ----------
    problem : str
        What is wrong.
    file : Path or str, optional
        The file (or option) in which it is wrong.
    place : str, optional
        Where in the file: line, key, column or dataset.
    remedy : str, optional
        What to do.
    """

    def __init__(
        self, problem: str, *, file: Path | str | None = None, place: str = "", remedy: str = ""
    ) -> None:
        self.problem = problem
        self.file = None if file is None else str(file)
        self.place = place
        self.remedy = remedy
        self._more: tuple[BadInput, ...] = ()
        super().__init__(self.message())

    def with_more(self, more: Sequence[BadInput]) -> BadInput:
        """Return this with what else is wrong in the same file."""
        self._more = tuple(more)
        self.args = (self.message(),)
        return self

    def of_file(self, file: Path | str) -> BadInput:
        """Return the same finding as one of a file, for whoever knows the file and not what is in it."""
        return BadInput(self.problem, file=file, place=self.place, remedy=self.remedy)

    def message(self) -> str:
        """Return the message: ``file: place: problem; remedy``, and a line for each further finding."""
        further = [f"  {one._line(named=False)}" for one in self._more[:MORE_SHOWN]]
        if len(self._more) > MORE_SHOWN:
            further.append(f"  and {len(self._more) - MORE_SHOWN} more")
        return "\n".join((self._line(named=True), *further))

    def _line(self, *, named: bool) -> str:
        said = self.problem if not self.place else f"{self.place}: {self.problem}"
        said = _TOO_LONG.sub(_ends, f"{said}; {self.remedy}" if self.remedy else said)
        return plain(f"{self.file}: {said}" if self.file and named else said)


def _ends(word: re.Match[str]) -> str:
    """Return the two ends of a word or quotation."""
    kept = LONGEST_WORD // 2 - 20
    return f"{word[0][:kept]}… ({len(word[0])} characters) …{word[0][-kept:]}"


class DeviceFault(Exception):  # noqa: N818 - it names the fact
    """A device or its wire does not do what it must: what, where, and where to look (exit status 4)."""


class NotInCharge(DeviceFault):
    """This program has not, or no longer, the right to give a controller commands; nothing was sent."""


class WireLost(DeviceFault):
    """No true reply came over a wire: what the device does meanwhile is not known, and it may come back."""


class CommandRejected(DeviceFault):
    """The controller refused a command; the text names the command and the reason it gave."""
