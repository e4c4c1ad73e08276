"""National Instruments TDMS: groups of channels, each with its waveform properties."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.columns import DATE_TIME
from bufferstand.recording.foreign.date_columns import DateColumns
from bufferstand.recording.foreign.library_files import (
    Groups,
    as_numbers,
    missing_library,
    of_library,
    quiet,
)
from bufferstand.recording.foreign.record import Floats, Numbers, ReadingOptions, TimeColumn

_SCALE_TYPE = re.compile(r"NI_Scale\[\d+\]_Scale_Type")
_SECONDS = ("", "s", "sec", "Time", "time", "seconds")


@dataclass(frozen=True)
class _Wave:
    """When the samples of a channel were taken: start (UTC, s since 1970), offset and increment [s]."""

    start_s: float | None
    offset_s: float
    increment_s: float


@dataclass(frozen=True)
class _Channel:
    group: str
    name: str
    wave: _Wave | None
    axis: str
    """What its waveform runs over, if not time."""


class TdmsRecord:
    """A TDMS file. Its index file, if there is one, is not needed and not read.

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
        with self._opened() as file, of_library(path, "TDMS file"):
            self._groups = Groups([group.name for group in file.groups()], reading.groups, path)
            self._version = int(file.tdms_version)
            channels = [channel for name in self._groups.read for channel in file[name].channels()]
            self._channels = [_described(channel) for channel in channels]
            self.headers = tuple(
                self._groups.header(channel.group_name, channel.name, *_unit(channel)) for channel in channels
            )
            if file.file_status.incomplete_final_segment:
                self._findings.append("the last segment is not complete: the recording was cut short")
        if not self.headers:
            raise BadInput("no channel in it", file=path)
        self.header_place = self._groups.place

    def where(self, position: int) -> str:
        """Return where a channel stands, for messages."""
        channel = self._channels[position]
        return f"group “{channel.group}”, channel “{channel.name}”"

    def facts(self) -> dict[str, Any]:
        """Return how the file is written, for the run file."""
        return {"format": "TDMS", "tdms_version": self._version, **self._groups.facts()}

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        return list(self._findings)

    def read(self, positions: Sequence[int], clock: TimeColumn | None = None) -> list[Numbers]:
        """Return the numbers of some channels; those with the same waveform share a time base.

        Raises
        ------
        BadInput
            If a channel holds no numbers, or is no function of time.
        """
        bases: dict[Any, list[int]] = {}
        for position in positions:
            channel = self._channels[position]
            if channel.axis:
                raise BadInput(
                    f"it runs over “{channel.axis}”, not over time",
                    file=self.path,
                    place=self.where(position),
                )
            bases.setdefault(channel.wave or channel.group, []).append(position)
        starts = [c.wave.start_s for c in (self._channels[p] for p in positions) if c.wave and c.wave.start_s]
        with self._opened() as file:
            return [self._base(file, members, clock, min(starts, default=None)) for members in bases.values()]

    def _base(
        self, file: Any, members: Sequence[int], clock: TimeColumn | None, first_start_s: float | None
    ) -> Numbers:
        moments = DateColumns(clock) if clock is not None and clock.position in members else None
        columns = {
            position: self._values(file, position, moments if clock and position == clock.position else None)
            for position in members
        }
        shortest = min(len(values) for values in columns.values())
        for position, values in columns.items():
            if len(values) > shortest:
                more = f"{len(values) - shortest} sample(s) more than the others, left out"
                self._findings.append(f"{self.where(position)}: {more}")
        columns = {position: values[:shortest] for position, values in columns.items()}
        wave = self._channels[members[0]].wave
        time_s: Floats | None = None
        started = None
        if wave is not None and moments is None:
            shift_s = (wave.start_s - first_start_s) if wave.start_s and first_start_s else 0.0
            time_s = np.asarray(shift_s + wave.offset_s + np.arange(shortest) * wave.increment_s)
            started = None if first_start_s is None else datetime.fromtimestamp(first_start_s, UTC)
        elif moments is not None:
            started = moments.started
        return Numbers(
            columns=columns,
            row=np.arange(1, shortest + 1, dtype=np.int64),
            time_s=time_s,
            time_from="" if time_s is None else "waveform (wf_increment)",
            started=started,
        )

    def _values(self, file: Any, position: int, moments: DateColumns | None) -> Floats:
        channel = self._channels[position]
        self._refuse_unknown_scale(file, position)
        with of_library(self.path, "TDMS file", self.where(position)):
            values = np.asarray(file[channel.group][channel.name][:])
        if moments is not None:
            if values.dtype.kind != "M":
                raise BadInput(
                    "its samples are no dates and times", file=self.path, place=self.where(position)
                )
            return moments.since_first(values.astype("datetime64[ns]").astype(np.int64), aware=True)
        if values.dtype.kind not in "iuf":
            what = "dates and times" if values.dtype.kind == "M" else "no numbers"
            raise BadInput(f"its samples are {what}", file=self.path, place=self.where(position))
        return as_numbers(values, self._missing)

    def _refuse_unknown_scale(self, file: Any, position: int) -> None:
        """Refuse counts whose scaling the library does not know: it would give them as they are."""
        from nptdms.scaling import get_scaling  # noqa: PLC0415 - optional library

        channel = self._channels[position]
        group = file[channel.group]
        for properties in (group[channel.name].properties, group.properties, file.properties):
            types = _scale_types(properties)
            if not types:
                continue
            with of_library(self.path, "TDMS file", self.where(position)):
                scaling = get_scaling(properties, {}, {})
            if scaling is None:
                raise BadInput(
                    f"its samples are counts, with a scaling that is not known here: {', '.join(types)}",
                    file=self.path,
                    place=self.where(position),
                    remedy="export it with the scaled values",
                )
            return

    @contextmanager
    def _opened(self) -> Iterator[Any]:
        try:
            from nptdms import TdmsFile  # noqa: PLC0415 - optional library
        except ImportError:
            raise missing_library("nptdms", self.path, "a TDMS file") from None
        try:
            stream = self.path.open("rb")  # not by name: a stale index file beside it would be believed
        except OSError as error:
            raise BadInput(f"cannot be read: {error.strerror}", file=self.path) from None
        with stream:
            if stream.read(4) == b"TDSh":
                raise BadInput(
                    "this is the index of a TDMS file, without data",
                    file=self.path,
                    remedy="name the .tdms file",
                )
            stream.seek(0)
            with quiet("nptdms"):
                with of_library(self.path, "TDMS file"):
                    file = TdmsFile.open(stream)
                yield file


def _described(channel: Any) -> _Channel:
    axis = str(channel.properties.get("wf_xunit_string", "") or "")
    return _Channel(
        channel.group_name,
        channel.name,
        _wave(channel.properties),
        "" if axis in _SECONDS else axis,
    )


def _unit(channel: Any) -> tuple[str, str]:
    """Return a channel's unit, and where it is stated; dates and times are in none."""
    if channel.dtype.kind == "M":
        return DATE_TIME, "samples"
    return str(channel.properties.get("unit_string", "") or "").strip(), "unit_string"


def _scale_types(properties: Any) -> list[str]:
    """Return the types of the scales that are still to be applied to the samples."""
    if properties.get("NI_Scaling_Status") == "scaled" or properties.get("NI_Number_Of_Scales") == 0:
        return []
    return [f"“{value}”" for key, value in sorted(properties.items()) if _SCALE_TYPE.fullmatch(key)]


def _wave(properties: Any) -> _Wave | None:
    increment = properties.get("wf_increment")
    if not isinstance(increment, int | float) or not 0.0 < increment < float("inf"):
        return None
    offset = properties.get("wf_start_offset", 0.0)
    start = properties.get("wf_start_time")
    start_s = None
    if isinstance(start, np.datetime64) and not np.isnat(start):
        start_s = float(start.astype("datetime64[us]").astype(np.int64)) * 1e-6
        start_s = start_s if start_s > 0.0 else None  # 1904: not set
    return _Wave(start_s, float(offset) if isinstance(offset, int | float) else 0.0, float(increment))
