"""How a text file of columns is written: encoding, header row, separator. Found out, never assumed."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from foundation.errors import BadInput

SEPARATORS = {"\t": "tab", ";": ";", ",": ","}
"""Separators understood, in the order in which they are tried, with their names in messages."""
NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
"""What a number looks like, by decimal sign."""
_LOOKED_AT = 50
_SNIFF_BYTES = 4096


@dataclass(frozen=True)
class Dialect:
    """What was found out about a file.

    Parameters
    ----------
    encoding : str
        ``UTF-8``, ``UTF-8 with BOM``, ``UTF-16`` or ``Latin-1``.
    separator : str
        One character of ``SEPARATORS``.
    header_line : int
        Line (from 1) of the header row; blank lines and lines that begin with ``#`` may stand before it.
    headers : tuple of str
        The header row's cells, without surrounding spaces.
    body : bytes
        The lines below it, in UTF-8, each ended by a line feed.
    ends_with_newline : bool
        Whether the last line is ended; if not, the file may be cut short.
    """

    encoding: str
    separator: str
    header_line: int
    headers: tuple[str, ...]
    body: bytes
    ends_with_newline: bool


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of one line, without surrounding spaces and quotes."""
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def detect(path: Path) -> Dialect:
    """Read a file and find out how it is written.

    Raises
    ------
    BadInput
        If it cannot be read, is no text, or has no header row of at least two columns.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None
    encoding, text = _decode(raw, path)
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    header_line, header, start = _header(text, path)
    separator = _separator(header, text[start : start + (1 << 16)], path, header_line)
    headers = tuple(split_line(header, separator))
    if all(any(form.fullmatch(cell) for form in NUMBER.values()) for cell in headers):
        raise BadInput(
            "no header row: this line holds numbers only",
            file=path,
            place=f"line {header_line}",
            remedy="put a row like “time [s],stroke [mm],force [kN]” before the numbers",
        )
    ended = text.endswith("\n")
    body = text[start:].encode()
    return Dialect(encoding, separator, header_line, headers, body if ended else body + b"\n", ended)


def _decode(raw: bytes, path: Path) -> tuple[str, str]:
    if not raw.strip():
        raise BadInput("the file is empty", file=path)
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        codec, name = "utf-16", "UTF-16"
    elif b"\0" in raw[:_SNIFF_BYTES]:
        codec, name = _utf16_without_mark(raw[:_SNIFF_BYTES], path), "UTF-16"
    elif raw.startswith(b"\xef\xbb\xbf"):
        codec, name = "utf-8-sig", "UTF-8 with BOM"
    else:
        codec, name = "utf-8", "UTF-8"
    try:
        return name, raw.decode(codec)
    except UnicodeDecodeError as error:
        if codec == "utf-8":
            return "Latin-1", raw.decode("latin-1")
        line = raw[: error.start].count(b"\n") + 1
        raise BadInput(
            f"byte {error.start} is no {name}",
            file=path,
            place=f"line {line}",
            remedy="save it anew as UTF-8",
        ) from None


def _utf16_without_mark(sample: bytes, path: Path) -> str:
    """Tell the byte order by where the zeros of the ASCII characters stand."""
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    if even == 0 and odd > len(sample) // 4:
        return "utf-16-le"
    if odd == 0 and even > len(sample) // 4:
        return "utf-16-be"
    raise BadInput("this is no text file", file=path, remedy="export the record as CSV")


def _header(text: str, path: Path) -> tuple[int, str, int]:
    """Return line number and text of the header row and where the next line begins."""
    start = 0
    number = 0
    while start < len(text):
        number += 1
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        line = text[start:end]
        start = end + 1
        if line.strip() and not line.lstrip().startswith("#"):
            return number, line, start
    raise BadInput("the file has no header row", file=path)


def _separator(header: str, following: str, path: Path, header_line: int) -> str:
    """Return the separator by which the header row and the first lines have equally many cells."""
    lines = [line for line in islice(following.split("\n"), _LOOKED_AT) if line.strip()]
    if len(following) >= 1 << 16:
        lines = lines[:-1]  # the last one looked at may be cut
    widths = {separator: len(split_line(header, separator)) for separator in SEPARATORS}
    several = [separator for separator in SEPARATORS if widths[separator] > 1]
    if not several:
        raise BadInput(
            f"the header row “{header.strip()[:60]}” has only one column",
            file=path,
            place=f"line {header_line}",
            remedy="separate columns by a comma, a semicolon or a tab",
        )
    fitting = [
        separator
        for separator in several
        if all(len(split_line(line, separator)) == widths[separator] for line in lines)
    ]
    return fitting[0] if fitting else max(several, key=lambda separator: widths[separator])
