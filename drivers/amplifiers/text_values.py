"""Values that come as lines of text: ``+0123.45 kN`` and the like, a line each."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

_NUMBER = re.compile(rb"^\s*([+-]?)\s*(\d+)(?:\.(\d+))?(?:\s*[^\d\s.,+-]\S*)?\s*$")
_LONGEST = 80
MOST_COUNTS = (1 << 31) - 1
"""Counts are kept as whole numbers of 32 bits; no amplifier has more."""


@dataclass(frozen=True)
class TextValue:
    """One value.

    Parameters
    ----------
    count : int
        Raw counts.
    lost : int
        Lines that could not be read before this one.
    status : int
        What the device says of it, where it does.
    """

    count: int
    lost: int
    status: int = 0


def decimal_counts(line: bytes, decimals: int) -> tuple[int, int] | None:
    """Return the digits of a number without its point, and status 0; None if the line holds no such number.

    Parameters
    ----------
    line : bytes
        A number, perhaps with a unit behind it.
    decimals : int
        Digits behind the point that it must have: another count would be read ten times too large or small.
    """
    found = _NUMBER.match(line)
    if found is None or len(found[3] or b"") != decimals:
        return None
    count = int(found[2] + (found[3] or b""))
    return (-count if found[1] == b"-" else count), 0


class LineDecoder:
    """Finds values in lines; a line that holds none is counted and skipped.

    Parameters
    ----------
    parse : callable
        Returns count and status of a line without its end, None if it holds no value.
    aligned : bool
        Whether the first byte is known to begin a line.
    end : bytes
        Last byte of a line; CR and LF around it are passed over.
    """

    undecided = False

    def __init__(
        self,
        parse: Callable[[bytes], tuple[int, int] | None],
        *,
        aligned: bool = False,
        end: bytes = b"\n",
    ) -> None:
        self._parse = parse
        self._end = end
        self._buffer = bytearray()
        self._aligned = aligned
        self._lost = 0
        self._in_doubt = False
        self.resyncs = 0

    @property
    def pending_frames(self) -> int:
        """Values that have begun to come in: the line that is not ended."""
        return 1 if self._buffer else 0

    def feed(self, data: bytes) -> list[TextValue]:
        """Return the values of the lines that are whole by now."""
        self._buffer += data
        values: list[TextValue] = []
        while (end := self._buffer.find(self._end)) >= 0:
            line = bytes(self._buffer[:end]).strip(b"\r\n")
            del self._buffer[: end + 1]
            self._take(line, values)
        if len(self._buffer) > _LONGEST:  # no line is that long: the rest of it is garbage, too
            self._doubt()
            self._buffer.clear()
            self._aligned = False
        return values

    def _take(self, line: bytes, values: list[TextValue]) -> None:
        found = self._parse(line)
        if found is not None and abs(found[0]) > MOST_COUNTS:  # lines that ran together, or garbage
            found = None
        if not self._aligned:
            self._aligned = True  # the first line may be the end of one, and a number all the same
            return
        if found is None:
            self._doubt()
            return
        values.append(TextValue(found[0], self._lost, found[1]))
        self._lost = 0
        self._in_doubt = False

    def _doubt(self) -> None:
        self._lost += 1
        if not self._in_doubt:
            self.resyncs += 1
        self._in_doubt = True
