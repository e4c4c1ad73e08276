"""ASAM MDF: groups of channels, each on the time of its group's master channel."""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation import BadInput, to_inside
from bufferstand.recording.foreign.channel_groups.survival import demand_survived
from bufferstand.recording.foreign.columns import spelled
from bufferstand.recording.foreign.library_files import (
    Groups,
    as_numbers,
    missing_library,
    of_library,
    quiet,
)
from bufferstand.recording.foreign.record import Floats, Header, Numbers, ReadingOptions, TimeColumn

_TIME = 1
"""Kind of a master channel that is a time (MDF 4: cn_sync_type)."""


@dataclass(frozen=True)
class _Channel:
    group: str
    group_index: int
    index: int


@dataclass(frozen=True)
class _Master:
    """When the samples of a group were taken, and the unit in which its master channel says so."""

    time_s: Floats
    unit: str


class MdfRecord:
    """An MDF file, version 4 (or 3). A file that was not finalised is finalised in a copy.

    Raises
    ------
    BadInput
        If it cannot be read, or the groups that are asked for are not there.
    """

    row_word = "sample"

    def __init__(self, path: Path, reading: ReadingOptions) -> None:
        self.path = path
        self._findings: list[str] = []
        self._missing = reading.no_value_numbers
        self._unfinalised = _is_unfinalised(path)
        demand_survived(path)
        if self._unfinalised:
            self._findings.append("the file was not finalised: the recording may have been cut short")
        with opened(self.path) as file, of_library(path, "MDF file"):
            names = _group_names(file)
            self._groups = Groups(names, reading.groups, path)
            self._version = str(file.version)
            self._started = _start(file)
            self._channels: list[_Channel] = []
            headers: list[Header] = []
            for number, (name, group) in enumerate(zip(names, file.groups, strict=True)):
                if name not in self._groups.read:
                    continue
                master = file.masters_db.get(number)
                for index, channel in enumerate(group.channels):
                    if index == master:
                        continue
                    unit = _unit(channel)
                    headers.append(self._groups.header(name, str(channel.name), unit, "channel unit"))
                    self._channels.append(_Channel(name, number, index))
        self.headers = tuple(headers)
        if not headers:
            raise BadInput("no channel in it", file=path)
        self.header_place = self._groups.place

    def where(self, position: int) -> str:
        """Return where a channel stands, for messages."""
        return f"group “{self._channels[position].group}”, channel “{self.headers[position].text}”"

    def facts(self) -> dict[str, Any]:
        """Return how the file is written, for the run file."""
        facts = {"format": "MDF", "mdf_version": self._version, **self._groups.facts()}
        return facts | ({"unfinalised": True} if self._unfinalised else {})

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        return list(self._findings)

    def read(self, positions: Sequence[int], clock: TimeColumn | None = None) -> list[Numbers]:
        """Return the numbers of some channels; groups whose masters are equal share a time base.

        Raises
        ------
        BadInput
            If a channel holds no numbers, or its group runs over something else than time.
        """
        if clock is not None:
            raise BadInput(
                "its samples are no dates and times",
                file=self.path,
                place=self.where(clock.position),
                remedy="say the unit of its numbers by --unit time=…",
            )
        groups: dict[int, dict[int, Floats]] = {}
        masters: dict[int, _Master] = {}
        with opened(self.path) as file:
            for position in positions:
                number = self._channels[position].group_index
                if number not in masters:
                    masters[number] = self._master(file, position)
                groups.setdefault(number, {})[position] = self._values(file, position)
        bases: list[tuple[_Master, dict[int, Floats]]] = []
        for number, columns in groups.items():
            for master, members in bases:
                if np.array_equal(master.time_s, masters[number].time_s, equal_nan=True):
                    members.update(columns)
                    break
            else:
                bases.append((masters[number], dict(columns)))
        return [self._numbers(master, columns) for master, columns in bases]

    def _numbers(self, master: _Master, columns: dict[int, Floats]) -> Numbers:
        shortest = min([len(master.time_s), *(len(values) for values in columns.values())])
        return Numbers(
            columns={position: values[:shortest] for position, values in columns.items()},
            row=np.arange(1, shortest + 1, dtype=np.int64),
            time_s=master.time_s[:shortest],
            time_from="master channel" if master.unit == "s" else f"master channel in {master.unit}",
            started=self._started,
        )

    def _master(self, file: Any, position: int) -> _Master:
        """Return the time of a channel's group, in seconds whatever its unit."""
        number = self._channels[position].group_index
        index = file.masters_db.get(number)
        if index is None:
            raise BadInput(
                "its group has no time (no master channel)", file=self.path, place=self.where(position)
            )
        channel = file.groups[number].channels[index]
        if self._version >= "4" and getattr(channel, "sync_type", _TIME) != _TIME:
            raise BadInput(
                f"its group runs over “{channel.name}”, not over time",
                file=self.path,
                place=self.where(position),
            )
        unit = spelled(_unit(channel)) or "s"
        with of_library(self.path, "MDF file", self.where(position)):
            stamps = np.asarray(file.get_master(number), dtype=np.float64)
        try:
            return _Master(to_inside(stamps, "time", unit), unit)
        except BadInput as error:
            raise BadInput(
                f"{error.problem} (master channel “{channel.name}”)",
                file=self.path,
                place=f"group “{self._channels[position].group}”",
                remedy="export the record with its time in seconds",
            ) from None

    def _values(self, file: Any, position: int) -> Floats:
        channel = self._channels[position]
        with of_library(self.path, "MDF file", self.where(position)):
            # Not to ignore the invalidation bits would drop those samples, and shift all that follow.
            signal = file.get(group=channel.group_index, index=channel.index, ignore_invalidation_bits=True)
        samples = np.asarray(signal.samples)
        if samples.dtype.kind not in "iuf" or samples.ndim != 1:
            raise BadInput("its samples are no numbers", file=self.path, place=self.where(position))
        values = as_numbers(samples, self._missing)
        invalid = signal.invalidation_bits
        if invalid is not None:
            values[np.asarray(invalid, dtype=bool)] = np.nan
        return values


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Give a file as its library has it; of one that was not finalised a copy, because finalising writes.

    Raises
    ------
    BadInput
        If it cannot be read, or its library is missing.
    """
    try:
        from asammdf import MDF  # noqa: PLC0415 - optional library
    except ImportError:
        raise missing_library("asammdf", path, "an MDF file") from None
    with ExitStack() as stack:
        stack.enter_context(quiet("asammdf"))
        stream = _stream(path, stack)
        stack.enter_context(redirect_stdout(io.StringIO()))  # it prints tracebacks
        with of_library(path, "MDF file"):
            file = MDF(stream)
        stack.callback(_closed, file)
        yield file


def _stream(path: Path, stack: ExitStack) -> Any:
    read, unfinalised = path, _is_unfinalised(path)
    try:
        if unfinalised:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="bufferstand-"))
            read = Path(shutil.copyfile(path, Path(folder) / "copy"))
        return stack.enter_context(read.open("r+b" if unfinalised else "rb"))
    except OSError as error:
        raise BadInput(f"cannot be read or copied: {error.strerror}", file=path) from None


def _closed(file: Any) -> None:
    """Let go of a file; of a damaged one the library may not know how."""
    with suppress(Exception):
        file.close()


def _is_unfinalised(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(8).startswith(b"UnFinMF")
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None


def _group_names(file: Any) -> list[str]:
    """Return a name of each group: what it was acquired as, and its number where that is not unique."""
    named = []
    for number, group in enumerate(file.groups, start=1):
        channel_group = group.channel_group
        name = str(
            getattr(channel_group, "acq_name", "") or getattr(channel_group, "comment", "") or ""
        ).strip()
        named.append(name if name and not name.startswith("<") else f"group {number}")
    return [
        f"{name} ({number})" if named.count(name) > 1 else name for number, name in enumerate(named, start=1)
    ]


def _unit(channel: Any) -> str:
    conversion = getattr(channel, "conversion", None)
    return str(getattr(conversion, "unit", "") or getattr(channel, "unit", "") or "").strip()


def _start(file: Any) -> datetime | None:
    start = getattr(file.header, "start_time", None)
    if not isinstance(start, datetime) or start.timestamp() <= 0.0:
        return None
    return start.astimezone(UTC) if start.tzinfo else start.replace(tzinfo=UTC)
