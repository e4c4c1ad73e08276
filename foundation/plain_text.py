"""Texts that others chose (names, ids, notes), made so that they do nothing where they are shown."""

from __future__ import annotations

import re

_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""What moves a terminal's cursor, changes its state or the order of letters; not line feed and tab."""
_OURS = re.compile(r"\r(?=\x1b|\n)|\x1b\[[0-9;?]*[mKAJGhl]")
"""What this program's own displays write: colours, erased lines, the cursor up, hidden and shown."""
_FORMULA = re.compile(r"(?:^|(?<=[,;\t\n]))(\s*)([=+\-@|])")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def plain(text: str) -> str:
    r"""Return a text with control characters written out, e.g. ``\x1b``: a terminal does not obey it."""
    return _CONTROLS.sub(lambda found: ascii(found[0])[1:-1], text)


def plain_but_for_displays(text: str) -> str:
    """Return a text for a terminal: as :func:`plain`, but with the few sequences of our own displays."""
    parts, end = [], 0
    for found in _OURS.finditer(text):
        parts += [plain(text[end : found.start()]), found[0]]
        end = found.end()
    return "".join([*parts, plain(text[end:])])


def as_cell(text: str) -> str:
    """Return a text for a table that a spreadsheet reads: one that would be a formula begins with ``'``.

    A spreadsheet calculates what begins with =, +, - or @, and so can be made to fetch addresses and to run
    programs (OWASP: CSV injection). Numbers stay as they are.
    """
    return text if _NUMBER.fullmatch(text) else _FORMULA.sub(r"\1'\2", text)


def has_controls(text: str) -> bool:
    """Return whether a text has characters that :func:`plain` writes out, a carriage return aside."""
    return _CONTROLS.search(text.replace("\r", "")) is not None


def counted(count: int, noun: str) -> str:
    """Return a count with its noun in English: ``1 cycle``, ``2 cycles``."""
    return f"{count} {noun}{'s' * (count != 1)}"
