"""Finds files below folders and by patterns. A folder that cannot be read is reported, not skipped."""

from __future__ import annotations

import errno
import fnmatch
import glob
import heapq
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from bufferstand.foundation import BadInput

ANY_DEPTH = "**"
_LONGEST_SHOWN = 200
_RIGHT = "ask for the right to look there, or name only what may be read"


def is_there(path: Path) -> bool:
    """Tell whether there is a file or folder of that name.

    Raises
    ------
    BadInput
        If that cannot be told: a folder on the way must not be looked into, or it is no path at all.
    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise _refused(path, error) from None
    except ValueError:
        raise BadInput(
            "no path: it holds a NUL character", file=str(path).replace("\0", "␀"), remedy="name a file"
        ) from None
    return True


class RealPaths:
    """Where files really lie, behind all links; each folder is looked up once, for there are thousands."""

    def __init__(self) -> None:
        self._folders: dict[str, str] = {}

    def of(self, file: Path) -> str:
        """Return the same as :func:`os.path.realpath`."""
        folder, name = os.path.split(os.fspath(file))
        if name in ("", ".", ".."):
            return os.path.realpath(file)
        known = self._folders.get(folder)
        if known is None:
            known = self._folders[folder] = os.path.realpath(folder)
        path = os.path.join(known, name)  # noqa: PTH118 - a Path for each takes as long as the rest
        return os.path.realpath(path) if os.path.islink(path) else path  # noqa: PTH114 - as above


def files_below(folder: Path, *suffixes: str) -> list[Path]:
    """Return the files in a folder and in those below it, sorted by path.

    Folders that a link below it leads to are not searched.

    Parameters
    ----------
    folder : Path
    suffixes : str
        Ends of the names that count.

    Raises
    ------
    BadInput
        If a folder or what a link leads to must not be looked into.
    """
    return sorted(
        place / entry.name
        for place, entries in _tree([folder], as_pattern=False)
        for entry in entries
        if entry.name.endswith(suffixes) and _leads_to(entry, folder=False)
    )


def matching(pattern: str) -> list[Path]:
    """Return what a pattern stands for: as in a shell, ``**`` for folders at any depth.

    ``*`` and ``**`` leave out names that begin with a dot. Behind links ``**`` looks into folders that it
    does not meet otherwise, into each once.

    Raises
    ------
    BadInput
        If a folder in which the pattern would have to be looked for must not be looked into.
    """
    path = Path(pattern)
    parts = list(path.parts[1:] if path.anchor else path.parts)
    if parts[-1:] == [ANY_DEPTH]:
        parts.append("*")
    places = [Path(path.anchor)]
    for part in parts:
        places = list(dict.fromkeys(_one_further(places, part)))
    return sorted(places, key=str)


def _one_further(places: Iterable[Path], part: str) -> Iterator[Path]:
    """Yield what a part of a pattern stands for in each of some folders."""
    if part == ANY_DEPTH:
        yield from (folder for folder, _ in _tree(places, as_pattern=True))
    elif glob.has_magic(part):
        fits = re.compile(fnmatch.translate(part)).match
        for place in places:
            for entry in _entries(place):
                if fits(entry.name) and (part.startswith(".") or not entry.name.startswith(".")):
                    yield place / entry.name
    else:
        yield from (place / part for place in places if is_there(place / part))


def _tree(tops: Iterable[Path], *, as_pattern: bool) -> Iterator[tuple[Path, list[os.DirEntry[str]]]]:
    """Yield folders and all below them with what is in each; as a pattern: not hidden ones, and behind links.

    Links come last, and only where they lead out of what was seen: otherwise two of them that lead upwards
    would make paths without end, and a run would be named by the longer of its paths. Of two links to one
    folder it is the first by its path, whatever the order in which the disk has them.
    """
    waiting = sorted((top, os.path.realpath(top)) for top in tops)
    links: list[tuple[Path, str]] = []
    seen: set[str] = set()
    while waiting or links:
        folder, real = heapq.heappop(waiting or links)
        if real in seen:
            continue
        seen.add(real)
        entries = _entries(folder)
        yield folder, entries
        for entry in entries:
            if as_pattern and entry.name.startswith("."):
                continue
            if entry.is_dir(follow_symlinks=False):
                heapq.heappush(waiting, (folder / entry.name, os.path.join(real, entry.name)))  # noqa: PTH118
            elif as_pattern and entry.is_symlink() and _leads_to(entry, folder=True):
                heapq.heappush(links, (folder / entry.name, os.path.realpath(entry.path)))


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as found:
            entries = list(found)
        if entries:
            os.stat(f"{folder}/.")  # noqa: PTH116 - names may be listed, but what they stand for not be read
    except (FileNotFoundError, NotADirectoryError):  # gone meanwhile; or a file, which has nothing below it
        return []
    except OSError as error:
        raise _refused(folder, error) from None
    return entries


def _leads_to(entry: os.DirEntry[str], *, folder: bool) -> bool:
    """Tell whether something is a file, or a folder, or a link to one."""
    try:
        return entry.is_dir() if folder else entry.is_file()
    except OSError as error:
        if error.errno == errno.ELOOP:  # a link that leads to itself leads nowhere, as one to what is gone
            return False
        raise _refused(Path(entry.path), error) from None


def _refused(path: Path, error: OSError) -> BadInput:
    name = str(path)
    shown = name if len(name) <= _LONGEST_SHOWN else f"{name[:_LONGEST_SHOWN]}…"
    remedy = "check the path" if error.errno in (errno.ENAMETOOLONG, errno.ELOOP) else _RIGHT
    return BadInput(f"cannot be looked into: {error.strerror}", file=shown, remedy=remedy)
