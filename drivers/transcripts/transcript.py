"""A byte transcript of a session with devices: what went over each wire, in which direction, and when.

A text file. After the head, each line is one piece of a wire: seconds since the start, name of the wire,
``>`` to the device or ``<`` from it, and the bytes in hex; ``+`` and ``-`` stand for a connection that was
opened and closed. Lines that begin with ``#`` are comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bufferstand.foundation import BadInput

HEAD = "# bufferstand transcript 1"
Sign = Literal[">", "<", "+", "-"]
_LINE = re.compile(
    r"^(?P<time>[0-9]+\.[0-9]+) (?P<wire>[a-z0-9-]+) (?P<sign>[<>+-])(?P<bytes>(?: [0-9a-f]{2})*)$"
)


@dataclass(frozen=True)
class TranscriptPiece:
    """One piece of a session.

    Parameters
    ----------
    time_s : float
        Since the start of the recording [s].
    wire : str
        Name of the wire: ``controller``, ``amplifier``, ``onewire``.
    sign : str
        ``>`` to the device, ``<`` from it, ``+`` opened, ``-`` closed.
    data : bytes
        Empty for opened and closed.
    """

    time_s: float
    wire: str
    sign: Sign
    data: bytes = b""

    def __str__(self) -> str:
        """Return it as a line of the file."""
        shown = f" {self.data.hex(' ')}" if self.data else ""
        return f"{self.time_s:.6f} {self.wire} {self.sign}{shown}"


def read_transcript(path: Path) -> list[TranscriptPiece]:
    """Return the pieces of a transcript in their order.

    Raises
    ------
    BadInput
        If it cannot be read or a line is none; names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"cannot be read: {error}", file=path) from None
    if not lines or lines[0] != HEAD:
        raise BadInput("this is no transcript", file=path, place="line 1", remedy=f"it must be “{HEAD}”")
    pieces: list[TranscriptPiece] = []
    for number, line in enumerate(lines[1:], start=2):
        if not line or line.startswith("#"):
            continue
        found = _LINE.match(line)
        if found is None or bool(found["bytes"]) != (found["sign"] in "<>"):
            raise BadInput(
                f"“{line[:40]}” is no piece of a session",
                file=path,
                place=f"line {number}",
                remedy="write: seconds, wire, < or >, bytes in hex",
            )
        sign: Sign = found["sign"]  # type: ignore[assignment]
        pieces.append(
            TranscriptPiece(float(found["time"]), found["wire"], sign, bytes.fromhex(found["bytes"]))
        )
    return pieces
