"""Finds out how a text file of columns is written: encoding, separator, heading."""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.heading import LOOKED_AT, Heading, find_heading, is_value, names_headers
from bufferstand.recording.foreign.record import Header, ReadingOptions
from bufferstand.recording.foreign.text.cell_splitting import text_rows

SEPARATORS = {"\t": "tab", ";": ";", ",": ","}
"""Separators understood, in the order in which they are tried, with their names in messages."""
ENCODINGS = {
    "utf-8": "UTF-8",
    "utf-8-sig": "UTF-8 with BOM",
    "utf-16": "UTF-16",
    "utf-16-le": "UTF-16",
    "utf-16-be": "UTF-16",
    "latin-1": "Latin-1",
    "cp1252": "Windows-1252",
}
"""Codecs, with their names in messages."""
_STEP = 1 << 20
_LONGEST_HEAD = 1 << 18
_MOST_PREAMBLE = 50


@dataclass(frozen=True)
class TextDialect:
    """What was found out about a file.

    Parameters
    ----------
    codec : str
        One of ``ENCODINGS``.
    separator : str
        One character of ``SEPARATORS``.
    header_line, units_line : int or None
        Line (from 1) of the header row and of the row of units; None if there is none.
    first_line : int
        Line of the first row that may be data.
    headers : tuple of Header
        The header row's cells, without surrounding spaces.
    preamble : tuple of str
        The lines before the header row that are not blank.
    zeros_at_end : int
        Bytes of zero with which the file ends: space that was reserved and not written.
    """

    codec: str
    separator: str
    header_line: int | None
    units_line: int | None
    first_line: int
    headers: tuple[Header, ...]
    preamble: tuple[str, ...]
    zeros_at_end: int

    @property
    def encoding(self) -> str:
        """Get the encoding's name."""
        return ENCODINGS[self.codec]

    @property
    def header_texts(self) -> tuple[str, ...]:
        """Get the texts of the header row."""
        return tuple(header.text for header in self.headers)


def detect(path: Path, reading: ReadingOptions | None = None) -> TextDialect:
    """Find out how a file is written.

    Raises
    ------
    BadInput
        If it cannot be read, is no text, or has no header row of at least two columns.
    """
    reading = reading or ReadingOptions()
    try:
        with path.open("rb") as stream:
            raw = stream.read(_LONGEST_HEAD)
            size = path.stat().st_size
            zeros = _zeros_at_end(path, size)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None
    if not raw.strip(b"\0 \t\r\n\xef\xbb\xbf"):
        raise BadInput("the file is empty", file=path)
    codec = _codec(raw, path, reading)
    if codec.startswith("utf-16"):
        zeros = 0 if zeros < 2 else zeros  # one is the upper half of the last character
    head = _decoded_head(raw, codec, path)
    lines = head.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    whole = len(raw) == size
    looked_at = max(LOOKED_AT, 2 * (reading.first_line or reading.header_line or 0))
    lines = [line.replace("\0", "") for line in (lines if whole else lines[:-1])][:looked_at]
    return _by_separator(lines, path, reading, codec, zeros)


def _zeros_at_end(path: Path, size: int) -> int:
    count = 0
    with path.open("rb") as stream:
        while count < size:
            step = min(_STEP, size - count)
            stream.seek(size - count - step)
            block = stream.read(step)
            kept = len(block.rstrip(b"\0"))
            count += step - kept
            if kept:
                break
    return count


def _codec(raw: bytes, path: Path, reading: ReadingOptions) -> str:
    marked = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = raw.rstrip(b"\0")
    if reading.encoding is not None:
        unmarked = reading.encoding == "utf-16" and not marked
        return _utf16_without_mark(text[:4096], path) if unmarked else reading.encoding
    if marked:
        return "utf-16"
    if b"\0" in text[:4096]:
        return _utf16_without_mark(text[:4096], path)
    if raw.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    return "utf-8" if _is_utf8(path) else "latin-1"


def _is_utf8(path: Path) -> bool:
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        with path.open("rb") as stream:
            while block := stream.read(_STEP):
                decoder.decode(block)
            decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return False
    return True


def _utf16_without_mark(sample: bytes, path: Path) -> str:
    """Tell the byte order by where the zeros of the ASCII characters stand."""
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    if even == 0 and odd > len(sample) // 4:
        return "utf-16-le"
    if odd == 0 and even > len(sample) // 4:
        return "utf-16-be"
    if not sample.count(0):
        raise wrong_encoding(path, "utf-16", 1)
    line = sample[: sample.index(0)].count(b"\n") + 1
    raise BadInput(
        "bytes of zero inside it: this is no text file",
        file=path,
        place=f"line {line}",
        remedy="export the record as CSV",
    )


def _decoded_head(raw: bytes, codec: str, path: Path) -> str:
    decoder = codecs.getincrementaldecoder(codec)()
    try:
        return decoder.decode(raw)
    except UnicodeDecodeError as error:
        raise wrong_encoding(path, codec, raw[: error.start].count(b"\n") + 1) from None


def wrong_encoding(path: Path, codec: str, line: int) -> BadInput:
    """Return the message for bytes that are not of the encoding that the file is in."""
    return BadInput(
        f"bytes that are no {ENCODINGS[codec].removesuffix(' with BOM')}",
        file=path,
        place=f"line {line}",
        remedy="save it anew as UTF-8",
    )


def _by_separator(
    lines: list[str], path: Path, reading: ReadingOptions, codec: str, zeros: int
) -> TextDialect:
    """Return the dialect by the separator with which heading and following lines have equally many cells."""
    separators = [reading.separator] if reading.separator else list(SEPARATORS)
    found: list[tuple[TextDialect, int]] = []
    for separator in separators:
        rows, further = _rows(lines, separator)
        heading = find_heading(rows, reading)
        if heading is None or len(heading.headers) < 2:
            continue
        while heading.first_row in further:  # a header with a line break in it
            heading = replace(heading, first_row=heading.first_row + 1)
        following = [row for row in rows[heading.first_row :] if row]
        fitting = sum(len(row) == len(heading.headers) for row in following)
        found.append((_dialect(heading, lines, separator, codec, zeros), fitting - len(following)))
    if not found:
        raise _no_columns(lines, path, reading)
    whole = [dialect for dialect, unfit in found if unfit == 0]
    chosen = whole[0] if whole else max(found, key=lambda item: (item[1], len(item[0].headers)))[0]
    _refuse_numbers_as_headers(chosen, path, reading)
    return chosen


def _rows(lines: Sequence[str], separator: str) -> tuple[list[list[str]], set[int]]:
    """Return the cells that begin in each line (none of a remark or a blank line), and which lines go on."""
    cells: list[list[str]] = [[] for _ in lines]
    further: set[int] = set()
    for row in text_rows(["" if line.lstrip().startswith("#") else f"{line}\n" for line in lines], separator):
        if lines[row.line].strip():
            cells[row.line] = row.cells if row.cells != [""] else []
        further.update(range(row.line + 1, row.line + row.lines))
    return cells, further


def _dialect(heading: Heading, lines: list[str], separator: str, codec: str, zeros: int) -> TextDialect:
    above = lines[: heading.first_row if heading.row is None else heading.row]
    return TextDialect(
        codec=codec,
        separator=separator,
        header_line=None if heading.row is None else heading.row + 1,
        units_line=None if heading.units_row is None else heading.units_row + 1,
        first_line=heading.first_row + 1,
        headers=heading.headers,
        preamble=tuple(line.strip() for line in above if line.strip())[:_MOST_PREAMBLE],
        zeros_at_end=zeros,
    )


def _no_columns(lines: list[str], path: Path, reading: ReadingOptions) -> BadInput:
    number = reading.header_line or next(
        (i for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")), None
    )
    if number is None or number > len(lines) or not lines[number - 1].strip():
        return BadInput("the file has no header row", file=path)
    return BadInput(
        f"the header row “{lines[number - 1].strip()[:60]}” has only one column",
        file=path,
        place=f"line {number}",
        remedy="separate columns by a comma, a semicolon or a tab",
    )


def _refuse_numbers_as_headers(dialect: TextDialect, path: Path, reading: ReadingOptions) -> None:
    """Refuse a header row that is a row of the table: what looks like one would be lost as a header."""
    texts = dialect.header_texts
    if dialect.header_line is None or reading.header_line is not None:
        return
    if any(is_value(text, frozenset()) for text in texts) and not names_headers(texts, reading.expected):
        raise BadInput(
            "no header row: this line holds numbers"
            + (" only" if all(is_value(text, frozenset(("",))) for text in texts) else ""),
            file=path,
            place=f"line {dialect.header_line}",
            remedy="put a row like “time [s],stroke [mm],force [kN]” before the numbers; or say header_line "
            "in a mapping file (0: there is none)",
        )
