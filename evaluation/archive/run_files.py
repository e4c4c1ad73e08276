"""Finds the run files behind files, folders, patterns and lists."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import read_text
from bufferstand.recording.finding import is_there, matching, run_files
from bufferstand.recording.sealing import RUN_SUFFIX

LIST_MARK = "@"


def find_runs(sources: Sequence[str], lists: Sequence[Path] = ()) -> list[Path]:
    """Return the run files that a user names.

    Parameters
    ----------
    sources : sequence of str
        Run files; folders, which are searched for them; patterns as ``archive/**/*.h5``; ``@FILE``: a list.
        What exists under its name is never taken for a pattern or a list.
    lists : sequence of Path
        Further lists: a path of a file or folder a line, relative to the current folder; empty lines and
        lines that begin with ``#`` are skipped.

    Returns
    -------
    list of Path
        Each file once, in the order in which it is named first. A listed file that does not exist is among
        them: it is for the evaluation to report, so that it does not stop the others.

    Raises
    ------
    BadInput
        If a path does not exist, a folder or pattern has no run file, a folder must not be looked into, or a
        list cannot be read.
    """
    found: list[Path] = []
    for source in sources:
        if source.startswith(LIST_MARK) and not is_there(Path(source)):
            found += _listed(_list_file(source))
        else:
            found += _named(source)
    for one in lists:
        found += _listed(one)
    if not found:
        raise BadInput("no run is named", file="PATH", remedy="name run files, folders, a pattern or a list")
    return _each_once(found)


def _list_file(source: str) -> Path:
    name = source.removeprefix(LIST_MARK)
    if not name:
        raise BadInput("the name of the list is missing", file=source, remedy=f"write {LIST_MARK}FILE")
    return Path(name)


def _named(source: str) -> list[Path]:
    if not source:
        raise BadInput("the path is empty", file="PATH", remedy="write . for the current folder")
    path = Path(source)
    if is_there(path) or not glob.has_magic(source):
        return run_files([path])
    files = [path for path in matching(source) if path.suffix == RUN_SUFFIX and path.is_file()]
    if not files:
        raise BadInput(
            f"the pattern matches no run file (*{RUN_SUFFIX})",
            file=source,
            remedy="** stands for folders at any depth: archive/**/*.h5",
        )
    return files


def _listed(path: Path) -> list[Path]:
    """Return what a list names. It stands for what a search once found: a file that is gone is kept."""
    found: list[Path] = []
    for number, line in enumerate(read_text(path).split("\n"), start=1):
        name = line.strip()
        if not name or name.startswith("#"):
            continue
        try:
            found += _of_line(name)
        except BadInput as error:
            raise BadInput(
                f"{error.file}: {error.problem}" if error.file else error.problem,
                file=path,
                place=f"line {number}",
                remedy=error.remedy,
            ) from None
    if not found:
        raise BadInput("the list names no run", file=path, remedy="write a path a line")
    return found


def _of_line(name: str) -> list[Path]:
    """Return what a line of a list stands for: never a pattern, as a file may be named like one."""
    if "\0" in name:
        raise BadInput(
            "holds NUL characters", remedy="write a path a line, as UTF-8: find -print instead of -print0"
        )
    path = Path(name)
    return run_files([path]) if is_there(path) and path.is_dir() else [path]


def _each_once(paths: Iterable[Path]) -> list[Path]:
    unique: dict[str, Path] = {}
    for path in paths:
        unique.setdefault(os.path.realpath(path), path)
    return list(unique.values())
