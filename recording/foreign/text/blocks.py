"""Reads a large text file in blocks of whole lines, so that only one block is in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.heading import is_data
from bufferstand.recording.foreign.record import MISSING
from bufferstand.recording.foreign.text.cell_splitting import split_line
from bufferstand.recording.foreign.text.dialect import TextDialect, wrong_encoding

BLOCK_CHARACTERS = 1 << 23
_MOST_FURTHER_LINES = 1000
_PLAIN = frozenset(MISSING)
_BYTE_ORDER_MARK = "\ufeff"
_END_OF_FILE = "\x1a"
"""What programs of DOS times put behind the last line."""


@dataclass(frozen=True)
class TextBlock:
    """Whole lines: the text, ended by a line feed, and the number (from 1) of the first."""

    first_line: int
    text: str
    cut: bool
    """Whether it is the last one and its last line is not ended in the file."""


def text_blocks(path: Path, dialect: TextDialect) -> Iterator[TextBlock]:
    """Give a file's lines from the first that may be data on; line ends are line feeds.

    A block ends behind a line of values where one comes soon, so that a header block inside the data is not
    torn.

    Raises
    ------
    BadInput
        If the file cannot be read, or is not in its encoding.
    """
    number = 1
    try:
        with path.open("r", encoding=dialect.codec, newline=None) as stream:
            for _ in range(dialect.first_line - 1):
                stream.readline()
                number += 1
            while text := stream.read(BLOCK_CHARACTERS):
                text += _rest(text, stream, dialect.separator)
                kept = _kept(text)
                block = TextBlock(number, _ended(kept), bool(kept) and not kept.endswith("\n"))
                number += text.count("\n")
                if kept:
                    yield block
    except UnicodeDecodeError:
        raise wrong_encoding(path, dialect.codec, number) from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None


def _kept(text: str) -> str:
    """Return text without what is none: marks where files were joined, what stands behind the end."""
    kept = text.replace(_BYTE_ORDER_MARK, "").rstrip("\0")
    ended = kept.rstrip("\n")
    return ended.rstrip(_END_OF_FILE) if ended.endswith(_END_OF_FILE) else kept


def _ended(text: str) -> str:
    return text if text.endswith("\n") else text + "\n"


def _rest(text: str, stream: TextIO, separator: str) -> str:
    """Return what follows, up to the end of a line of values."""
    rest = "" if text.endswith("\n") else stream.readline()
    last = (text + rest).rstrip("\n").rpartition("\n")[2]
    for _ in range(_MOST_FURTHER_LINES):
        if is_data(split_line(last, separator), _PLAIN) or not (last := stream.readline()):
            break
        rest += last
    return rest
