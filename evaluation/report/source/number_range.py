"""The laboratory's own number range: a pattern, and a register in which each number is given once.

The register is a CSV file with a line for each number. The same evaluation has the same number again, so that
a report can be made anew byte by byte; another evaluation, or an amendment, has the next one.
"""

from __future__ import annotations

import csv
import io
import os
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from string import Formatter

from bufferstand.foundation import BadInput
from bufferstand.foundation.operating_system import BINARY, is_lock_taken, sync_folder

COLUMNS = ("number", "running", "year", "evaluation", "report")
"""Of a register; ``evaluation`` is a hash of what was reported, empty for a number given elsewhere."""
_WIDTH = re.compile(r"(0?[1-9])?")
_KEYS = {"running": "the running number", "year": "the year of issue"}
_WAIT_S = 10.0
_STEP_S = 0.05


def is_pattern(number: str) -> bool:
    """Say whether a number in ``report.toml`` is the pattern of a range, not a number itself."""
    return "{" in number or "}" in number


def check_pattern(pattern: str, file: Path) -> None:
    """Refuse a pattern that cannot be filled in, or would give a number twice.

    Parameters
    ----------
    pattern : str
        ``number`` of ``report.toml``, as ``PB-{year}-{running:04}``.
    file : Path
        That file, for the message.

    Raises
    ------
    BadInput
        If a brace is left open, a key is unknown, a width is none, or ``{running}`` is not in it once.
    """

    def refuse(problem: str) -> BadInput:
        return BadInput(
            problem,
            file=file,
            place="number",
            remedy="write it like “PB-{year}-{running:04}”, or give a number",
        )

    try:
        keys = [
            (key, form or "", turn) for _, key, form, turn in Formatter().parse(pattern) if key is not None
        ]
    except ValueError as error:
        raise refuse(f"the pattern cannot be read: {error}") from None
    for key, form, turn in keys:
        if key not in _KEYS:
            known = " and ".join(f"{{{name}}}, {words}" for name, words in _KEYS.items())
            raise refuse(f"the pattern has no {{{key}}}; it has {known}")
        if turn or not _WIDTH.fullmatch(form):
            raise refuse(f"“{form or turn}” is no width of {{{key}}}: it is digits, as 04")
    if [key for key, _, _ in keys].count("running") != 1:
        raise refuse("the pattern needs {running} once, or two reports would have one number")


@dataclass(frozen=True)
class _Entry:
    number: str
    running: int
    year: int
    evaluation: str


def number_of_range(pattern: str, register: Path, *, year: int, evaluation: str, report: str) -> str:
    """Return the number of a report: the one that its evaluation has, or the next one, written down first.

    Parameters
    ----------
    pattern : str
        A pattern that :func:`check_pattern` takes.
    register : Path
        The CSV file of the numbers; made if it is not there. It is locked meanwhile: two programs never give
        one number.
    year : int
        Year of issue. Where the pattern has it, the running number begins anew with it.
    evaluation : str
        Hash of what is reported.
    report : str
        Name of the campaign or run, for those who read the register.

    Returns
    -------
    str
        The number.

    Raises
    ------
    BadInput
        If the register cannot be read or written, is damaged, has a number twice, or is locked for 10 s.
    """
    try:
        with _locked(register) as handle:
            text = _read(handle, register)
            entries = list(_entries(text, register))
            yearly = any(key == "year" for _, key, _, _ in Formatter().parse(pattern))
            of_range = [entry for entry in entries if not yearly or entry.year == year]
            for entry in of_range:
                if entry.evaluation == evaluation:
                    return entry.number
            running = 1 + max((entry.running for entry in of_range), default=0)
            number = pattern.format(year=year, running=running)
            if number in {entry.number for entry in entries}:
                raise BadInput(
                    f"the next number, {number}, is given already",
                    file=register,
                    remedy="correct the running numbers of the register, or change the pattern",
                )
            _append(handle, text, register, (number, str(running), str(year), evaluation, report))
            return number
    except OSError as error:
        raise BadInput(
            f"the register of report numbers cannot be used: {error.strerror or error}",
            file=register,
            remedy="correct number_register in report.toml, or the rights of the file",
        ) from None


@contextmanager
def _locked(register: Path) -> Iterator[int]:
    handle = os.open(register, os.O_RDWR | os.O_CREAT | BINARY | getattr(os, "O_CLOEXEC", 0), 0o666)
    try:
        until = time.monotonic() + _WAIT_S
        while not is_lock_taken(handle):
            if time.monotonic() > until:
                raise BadInput(
                    "another program has had the register of report numbers locked for 10 s",
                    file=register,
                    remedy="end that program, and try again",
                )
            time.sleep(_STEP_S)
        yield handle
    finally:
        os.close(handle)  # gives the lock back, too


def _read(handle: int, register: Path) -> str:
    with os.fdopen(os.dup(handle), "rb") as stream:
        stream.seek(0)
        data = stream.read()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(
            f"not UTF-8 text (byte {error.start})", file=register, remedy="save the register as UTF-8"
        ) from None


def _entries(text: str, register: Path) -> Iterator[_Entry]:
    reader = csv.reader(io.StringIO(text, newline=""))
    seen: dict[str, int] = {}
    for line, row in enumerate(reader, start=1):
        if not row:
            continue
        if line == 1:
            if tuple(row) != COLUMNS:
                raise _damaged(register, 1, f"the first line is not “{','.join(COLUMNS)}”")
            continue
        entry = _entry(row, register, line)
        if entry.number in seen:
            raise _damaged(register, line, f"{entry.number} stands in line {seen[entry.number]} already")
        seen[entry.number] = line
        yield entry


def _entry(row: Sequence[str], register: Path, line: int) -> _Entry:
    if len(row) != len(COLUMNS) or not row[0]:
        raise _damaged(
            register, line, f"it has {len(row)} entries; {len(COLUMNS)} are wanted, the first a number"
        )
    number, running, year, evaluation, _ = row
    if not (running.isascii() and running.isdigit() and year.isascii() and year.isdigit()):
        raise _damaged(register, line, "running and year are no whole numbers")
    return _Entry(number, int(running), int(year), evaluation)


def _damaged(register: Path, line: int, problem: str) -> BadInput:
    return BadInput(
        f"the register of report numbers is damaged: {problem}",
        file=register,
        place=f"line {line}",
        remedy="mend the line; do not delete the file, or numbers would be given twice",
    )


def _append(handle: int, before: str, register: Path, row: Sequence[str]) -> None:
    """Write a line behind the others, to the disk itself, before the number is used."""
    line = io.StringIO()
    writer = csv.writer(line, lineterminator="\n")
    if not before:
        writer.writerow(COLUMNS)
    elif not before.endswith("\n"):
        line.write("\n")
    writer.writerow(row)
    data = line.getvalue().encode()
    os.lseek(handle, 0, os.SEEK_END)
    while data:
        data = data[os.write(handle, data) :]
    os.fsync(handle)
    sync_folder(register.parent)
