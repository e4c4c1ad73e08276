"""What lies in the desk's folder: stands, specimens, campaigns, and folders of campaigns that were run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from bufferstand.daq.campaign_folder import RECORD_NAME, CampaignRecord, load_record
from bufferstand.daq.monitor import page_words
from bufferstand.daq.operator import is_running
from bufferstand.drivers.stand_file import (
    RecordingStand,
    StandFile,
    load_any_stand,
)
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import read_text, toml_document
from bufferstand.foundation.specimen import load_specimen
from bufferstand.protocols.campaign_file import load_campaign

DEEPEST = 5
"""Folders below the desk's that are looked into."""
MOST_ENTRIES = 20_000
"""Files and folders that are looked at."""
MOST_BYTES = 1 << 20
"""A settings file that is larger is none."""

Kind = Literal["stand", "specimen", "campaign"]


def read_stand(path: Path) -> StandFile | RecordingStand:
    """Read a stand file: one for campaigns, or one without a controller, of which is recorded only.

    Raises
    ------
    BadInput
        If it cannot be read, or breaks its schema.
    """
    return load_any_stand(path)


READERS: dict[Kind, Callable[[Path], Any]] = {
    "stand": read_stand,
    "specimen": load_specimen,
    "campaign": load_campaign,
}


@dataclass(frozen=True)
class SettingsFile:
    """A settings file of the folder.

    Parameters
    ----------
    path : str
        From the desk's folder.
    kind : Kind
        What it is, by its tables.
    id, title : str
        Its own id, and what it calls itself.
    problem : str
        Why it cannot be used: place, what is wrong, what to do; empty where it can.
    """

    path: str
    kind: Kind
    id: str = ""
    title: str = ""
    problem: str = ""


@dataclass(frozen=True)
class CampaignRun:
    """A campaign's folder.

    Parameters
    ----------
    path : str
        From the desk's folder.
    title, specimen : str
        Of its plan.
    status : str
        As its record says; ``killed`` where that says it runs and no process answers.
    reason : str
        Why it stopped.
    done, steps : int
        Steps that are over, and all.
    started_utc : str
        ISO 8601.
    problem : str
        Why its record cannot be read.
    """

    path: str
    title: str = ""
    specimen: str = ""
    status: str = ""
    reason: str = ""
    done: int = 0
    steps: int = 0
    started_utc: str = ""
    problem: str = ""


@dataclass(frozen=True)
class Contents:
    """What was found; ``cut`` where there is more than is looked at."""

    settings: tuple[SettingsFile, ...]
    runs: tuple[CampaignRun, ...]
    cut: bool

    def of_kind(self, kind: Kind) -> list[SettingsFile]:
        """Return the settings files of a kind."""
        return [one for one in self.settings if one.kind == kind]


class Folder:
    """The desk's folder.

    Parameters
    ----------
    root : Path
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._known: dict[Path, tuple[tuple[int, int], SettingsFile | None]] = {}

    def contents(self) -> Contents:
        """Look at everything; what has not changed since is not read again."""
        settings: list[SettingsFile] = []
        runs: list[CampaignRun] = []
        looked = 0
        for path in _below(self.root):
            looked += 1
            if looked > MOST_ENTRIES:
                break
            if path.name == RECORD_NAME:
                runs.append(self.run(path.parent))
            elif (found := self._settings(path)) is not None:
                settings.append(found)
        runs.sort(key=lambda run: (run.status != "running", _descending(run.started_utc), run.path))
        settings.sort(key=lambda one: one.path)
        return Contents(tuple(settings), tuple(runs), looked > MOST_ENTRIES)

    def inside(self, relative: str, suffix: str = "") -> Path:
        """Return a file or folder by its path from the desk's folder.

        Raises
        ------
        BadInput
            If it lies elsewhere, also by a link, or is not there.
        """
        path = self.within(relative)
        if not path.exists() or (suffix and path.suffix != suffix):
            raise BadInput("there is no such file in the desk's folder", file=relative[:200])
        return path

    def new(self, relative: str) -> Path:
        """Return where something new may be made.

        Raises
        ------
        BadInput
            If that lies outside the desk's folder, or is there already.
        """
        if not relative.strip():
            raise BadInput("the name is empty", remedy="give one")
        path = self.within(relative)
        if path.exists():
            raise BadInput("is there already", file=relative[:200], remedy="give another name")
        return path

    def within(self, relative: str) -> Path:
        """Return a path in the desk's folder, there or not.

        Raises
        ------
        BadInput
            If it lies elsewhere, also by a link.
        """
        try:
            path = (self.root / relative).resolve()
            path.exists()  # of a name that is too long it cannot be told
        except (OSError, ValueError, RuntimeError):
            path = Path("/")
        if not path.is_relative_to(self.root) or any(ord(c) < 32 for c in relative):
            raise BadInput("this lies outside the desk's folder", file=relative[:200])
        return path

    def name(self, path: Path) -> str:
        """Return a path as the desk shows it: from its folder."""
        return path.relative_to(self.root).as_posix()

    def run(self, folder: Path) -> CampaignRun:
        """Return the state of a campaign's folder."""
        name = self.name(folder)
        try:
            record = load_record(folder)
        except BadInput as error:
            return CampaignRun(name, status="unreadable", problem=f"campaign.json: {_unnamed(error)}")
        if record is None:
            return CampaignRun(name, status="unreadable", problem="there is no campaign.json")
        return _state(name, record, running=is_running(folder))

    def _settings(self, path: Path) -> SettingsFile | None:
        try:
            seen = path.stat()
        except OSError:
            return None
        if seen.st_size > MOST_BYTES:
            return None
        mark = (seen.st_mtime_ns, seen.st_size)
        known = self._known.get(path)
        if known is None or known[0] != mark or (known[1] is not None and known[1].problem):
            known = self._known[path] = (mark, self._read(path))
        return known[1]

    def _read(self, path: Path) -> SettingsFile | None:
        """Try the reader of the kind that its tables speak of."""
        name = self.name(path)
        try:
            content = toml_document(read_text(path), path)
        except BadInput as error:
            kind = _kind_of_text(path)
            return None if kind is None else SettingsFile(name, kind, problem=_unnamed(error))
        kind = kind_of(content)
        if kind is None:
            return None
        facts = content[kind]
        said = (str(facts.get("id", "")), _title(facts))
        try:
            READERS[kind](path)
        except BadInput as error:
            return SettingsFile(name, kind, *said, problem=_unnamed(error))
        return SettingsFile(name, kind, *said)


def kind_of(content: dict[str, Any]) -> Kind | None:
    """Return which settings file this is by its tables; None if it is none of the three.

    A key of such a name that is no table makes none: a stored zero states its specimen by ``specimen = "…"``.
    """
    kinds: tuple[Kind, ...] = ("campaign", "stand", "specimen")
    return next((kind for kind in kinds if isinstance(content.get(kind), dict)), None)


def _kind_of_text(path: Path) -> Kind | None:
    """Return the kind of a file that is no TOML, by the headings that it has."""
    with suppress(OSError, UnicodeDecodeError):
        text = path.read_text(encoding="utf-8")
        return kind_of({line.strip(" []\r"): {} for line in text.splitlines() if line.startswith("[")})
    return None


def _title(facts: dict[str, Any]) -> str:
    return str(facts.get("title") or facts.get("name") or facts.get("description") or "")


def _unnamed(error: BadInput) -> str:
    """Return a message without its file's path: it stands beside the file's name."""
    text = str(error)
    return text.removeprefix(f"{error.file}: ") if error.file else text


def _state(name: str, record: CampaignRecord, *, running: bool) -> CampaignRun:
    plan = record.plan
    status: str = record.status
    if running:
        status = "running"
    elif status == "running":
        status = "killed"
    campaign, specimen = plan.get("campaign", {}), plan.get("specimen", {})
    return CampaignRun(
        name,
        title=str(campaign.get("title") or campaign.get("id", "")),
        specimen=str(specimen.get("id", "")),
        status=status,
        reason=page_words(record.reason),
        done=sum(step.over for step in record.steps),
        steps=len(record.steps),
        started_utc=record.started_utc,
    )


def _descending(text: str) -> tuple[int, ...]:
    return tuple(-ord(c) for c in text)


def _below(root: Path) -> Iterator[Path]:
    """Give the TOML files and campaign records below a folder; a campaign's folder is not looked into."""
    waiting = [(root, 0)]
    while waiting:
        folder, depth = waiting.pop()
        try:
            entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
        except OSError:
            continue
        if depth and any(entry.name == RECORD_NAME for entry in entries):
            yield folder / RECORD_NAME
            continue
        for entry in entries:
            if entry.name.startswith((".", "__")):
                continue
            if entry.is_dir(follow_symlinks=False):
                if depth < DEEPEST:
                    waiting.append((Path(entry.path), depth + 1))
            elif entry.name.endswith(".toml") and entry.is_file():
                yield Path(entry.path)
