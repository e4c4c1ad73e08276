"""The files that a campaign is made of: found by what they name, compared, copied, kept.

A place is the name of such a file in the campaign's folder: relative to the folder that the copies stand for,
or absolute for one that is named by an absolute path. The latter is read where it lies, and not copied.
"""

from __future__ import annotations

import difflib
import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bufferstand.foundation.files import make_folder, write_whole
from bufferstand.foundation.settings import NotToml, read_text, toml_content

INPUTS_NAME = "inputs"
BEFORE_NAME = "inputs-before"
"""Where inputs go that were replaced."""


@dataclass(frozen=True)
class Inputs:
    """The files of a campaign at one moment.

    Parameters
    ----------
    root : Path
        Folder that relative places start from.
    campaign : str
        Place of the campaign file.
    texts : mapping of str to str
        Text of each file by its place.
    """

    root: Path
    campaign: str
    texts: Mapping[str, str]

    @property
    def copied(self) -> dict[str, str]:
        """Return the texts that belong into the campaign's folder."""
        return {place: text for place, text in self.texts.items() if not Path(place).is_absolute()}


@dataclass(frozen=True)
class FileEdit:
    """What became of one file; None where there is none."""

    place: str
    before: str | None
    now: str | None

    def diff(self) -> str:
        """Return the unified diff, with all its lines."""
        was = f"{self.place} (as taken)" if self.before is not None else "(not there)"
        is_now = f"{self.place} (now)" if self.now is not None else "(no longer named)"
        lines = difflib.unified_diff(
            (self.before or "").splitlines(), (self.now or "").splitlines(), was, is_now, lineterm="", n=2
        )
        return "\n".join(lines)

    def summary(self) -> str:
        """Return e.g. ``stand.toml (+1 −1 lines)``."""
        lines = self.diff().splitlines()[2:]
        added, gone = (sum(line.startswith(sign) for line in lines) for sign in "+-")
        return f"{self.place} (+{added} −{gone} lines)"

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data, for ``campaign.json``."""
        return {
            "file": self.place,
            "sha256_before": _sha256(self.before),
            "sha256_now": _sha256(self.now),
            "diff": self.diff(),
        }


def read_inputs(campaign_file: Path, root: Path | None = None) -> Inputs:
    """Read a campaign file and every TOML file that it leads to.

    Parameters
    ----------
    campaign_file : Path
        The campaign file.
    root : Path, optional
        Folder that places start from; the deepest that holds all files if not given.

    Raises
    ------
    BadInput
        If a file cannot be read.
    """
    campaign_file = campaign_file.resolve()
    found = _found(campaign_file)
    if root is None:
        root = Path(os.path.commonpath([file.parent for file, linked in found.items() if linked]))
    inside = {file for file, linked in found.items() if linked and file.is_relative_to(root)}
    places = {file: file.relative_to(root).as_posix() if file in inside else str(file) for file in found}
    return Inputs(root, places[campaign_file], {place: read_text(file) for file, place in places.items()})


def edits_between(before: Mapping[str, str], now: Mapping[str, str]) -> tuple[FileEdit, ...]:
    """Return what differs between two states of a campaign's files, by place; line ends do not count."""
    return tuple(
        FileEdit(place, before.get(place), now.get(place))
        for place in sorted(before.keys() | now.keys())
        if before.get(place) != now.get(place)
    )


def copy_inputs(inputs: Inputs, folder: Path) -> None:
    """Put the files, with their bytes, into a campaign's folder in place of those that are there.

    Raises
    ------
    OSError
        If the disk does not take them; those that are there stay then.
    """
    _replace(folder, {place: (inputs.root / place).read_bytes() for place in inputs.copied})


def restore_inputs(texts: Mapping[str, str], folder: Path) -> None:
    """Put texts that were kept into a campaign's folder in place of the copies that are there.

    Raises
    ------
    OSError
        As :func:`copy_inputs`.
    """
    _replace(folder, {p: text.encode() for p, text in texts.items() if not Path(p).is_absolute()})


def keep_before(texts: Mapping[str, str], folder: Path, stamp: str) -> str:
    """Keep files that are being replaced; return where, relative to the folder.

    Raises
    ------
    OSError
        If the disk does not take them.
    """
    place = Path(BEFORE_NAME) / stamp.replace(":", "-")
    for name, text in texts.items():
        if not Path(name).is_absolute():
            _write(folder / place / name, text.encode())
    return place.as_posix()


def _replace(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write the new ones first, each whole, then drop those that are no longer named."""
    inputs = folder / INPUTS_NAME
    for place, content in contents.items():
        _write(inputs / place, content)
    for path in sorted(inputs.rglob("*"), reverse=True):  # what is in a folder comes before it
        if path.is_dir():
            if not any(path.iterdir()):
                path.rmdir()
        elif path.relative_to(inputs).as_posix() not in contents:
            path.unlink()


def _write(path: Path, content: bytes) -> None:
    make_folder(path.parent)
    write_whole(path, content)


def _found(first: Path) -> dict[Path, bool]:
    """Return a TOML file and every other that its texts lead to, and whether by relative paths alone."""
    found: dict[Path, bool] = {}
    waiting = [(first, True)]
    while waiting:
        file, linked = waiting.pop()
        if file in found and (found[file] or not linked):
            continue
        found[file] = linked
        try:
            content = toml_content(read_text(file))
        except NotToml:
            continue  # no longer what was loaded: kept as it is, resume will say what is wrong
        named = [text for text in sorted(_texts(content)) if text.endswith(".toml")]
        waiting += [
            (Path(os.path.normpath(file.parent / text)), linked and not Path(text).is_absolute())
            for text in reversed(named)
            if os.path.isfile(file.parent / text)  # noqa: PTH113 - no error of a text that is no file name
        ]
    return found


def _texts(content: Any) -> set[str]:
    """Return every text value in a TOML document."""
    if isinstance(content, str):
        return {content}
    if isinstance(content, dict):
        return set().union(*(_texts(value) for value in content.values()), set())
    if isinstance(content, list):
        return set().union(*(_texts(value) for value in content), set())
    return set()


def _sha256(text: str | None) -> str | None:
    return None if text is None else hashlib.sha256(text.encode()).hexdigest()
