"""The order of a campaign's steps is changed in its text: each takes the comments right above it along."""

from __future__ import annotations

import re

from bufferstand.daq.desk.prepare.edits import IN_THE_TEXT, checked, toml_content_of
from bufferstand.foundation import BadInput

_STEP = re.compile(r"""^\s*\[\[\s*step\s*\]\]\s*(#.*)?$""")
_PART_OF_STEP = re.compile(r"""^\s*\[\[?\s*step\s*\.""")
_HEADING = re.compile(r"""^\s*\[\[?[^\[\],=]+\]\]?\s*(#.*)?$""")


def moved_step(text: str, index: int, by: int) -> str:
    """Return a text in which a step has changed places with the one before or behind it.

    A step is its heading, what follows up to the next table, and the comment lines right above the heading.
    Everything else stays where it is, to the letter.

    Parameters
    ----------
    text : str
        TOML.
    index : int
        Which step, from 0.
    by : int
        -1: before the one above it; 1: behind the one below it.

    Raises
    ------
    BadInput
        If there is no such step, none to change places with, the text is no TOML, or its steps are written so
        that they cannot be distinguished by lines.
    """
    before = toml_content_of(text)
    steps = before.get("step")
    other = index + by
    last = len(steps) - 1 if isinstance(steps, list) else -1
    if abs(by) != 1 or not 0 <= index <= last or not 0 <= other <= last:
        raise BadInput("there is no such step, or none to change places with", remedy=IN_THE_TEXT)
    lines = text.splitlines(keepends=True)
    spans = _spans(lines)
    if len(spans) != last + 1:
        raise BadInput("these steps cannot be distinguished by their lines", remedy=IN_THE_TEXT)
    (a, b), (c, d) = sorted((spans[index], spans[other]))
    swapped = [*lines[:a], *_ended(lines[c:d]), *lines[b:c], *_ended(lines[a:b]), *lines[d:]]
    order = list(before["step"])
    order[index], order[other] = order[other], order[index]
    return checked("".join(swapped), {**before, "step": order})


def _ended(lines: list[str]) -> list[str]:
    """Return lines of which the last ends, too: that of a file may not."""
    return lines if lines[-1].endswith("\n") else [*lines[:-1], lines[-1] + "\n"]


def _spans(lines: list[str]) -> list[tuple[int, int]]:
    """Return the lines of every step, first and behind the last, without the blank ones that follow it."""
    headings = [at for at, line in enumerate(lines) if _HEADING.match(line) and not _PART_OF_STEP.match(line)]
    begins = [_with_comments(lines, at) for at in headings]
    ends = [*begins, len(lines)][1:]
    spans = []
    for heading, begin, end in zip(headings, begins, ends, strict=True):
        if not _STEP.match(lines[heading]):
            continue
        last = end
        while not lines[last - 1].strip():
            last -= 1
        spans.append((begin, last))
    return spans


def _with_comments(lines: list[str], at: int) -> int:
    """Return the first of the comment lines right above a heading."""
    while at and lines[at - 1].lstrip().startswith("#"):
        at -= 1
    return at
