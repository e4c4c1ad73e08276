"""The samples of one device in a run file, each dataset read when it is first asked for, or rows of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.channels import Channel
from bufferstand.recording.content import MICROSECOND_S, Segment
from bufferstand.recording.runfile.layout import ENTRY
from bufferstand.recording.runfile.metadata import StreamHead
from bufferstand.recording.runfile.reading_apart import DatasetReader


class Columns(Mapping[str, NDArray[Any]]):
    """Datasets of one group, each read when it is first asked for."""

    def __init__(self, reader: DatasetReader, places: Mapping[str, str]) -> None:
        self._reader, self._places = reader, dict(places)
        self._read: dict[str, NDArray[Any]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._read:
            values = self._reader.column(self._places[name])
            values.setflags(write=False)
            self._read[name] = values
        return self._read[name]

    def rows(self, name: str, rows: slice) -> NDArray[Any]:
        """Return some rows of a dataset; the others are not read.

        Raises
        ------
        BadInput
            If it is damaged.
        """
        if name in self._read:
            return self._read[name][rows]
        return self._reader.column(self._places[name], rows)

    def renamed(self, names: Mapping[str, str]) -> Columns:
        """Return the same datasets by other names; those that are not there keep theirs."""
        return Columns(self._reader, {names.get(name, name): place for name, place in self._places.items()})

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


class StreamData:
    """The samples of one device as received, uncorrected.

    Raises
    ------
    BadInput
        By ``time``, ``counts`` (when one is read) and ``segments``, if a dataset is damaged.
    """

    def __init__(
        self, reader: DatasetReader, head: StreamHead, facts: Mapping[str, Mapping[str, Any]]
    ) -> None:
        place = f"{ENTRY}/{head.name}"
        self.name, self.clock, self.device = head.name, head.clock, head.device
        self.rate_Hz = head.rate_Hz
        """Nominal sample rate [Hz], None where none is known."""
        self.channels: Mapping[str, Channel] = {channel.name: channel for channel in head.channels}
        self.time_name = "time_s" if f"{place}/time_s" in facts else "time_us"
        """Which of the two the time stamps are."""
        self.rows = int(facts.get(f"{place}/{self.time_name}", {}).get("rows", 0))
        self._columns = Columns(reader, {n: f"{place}/{n}" for n in (self.time_name, "segments")})
        self.counts = Columns(reader, {name: f"{place}/{name}" for name in self.channels})
        """Raw numbers by channel, shape (n,) each; read when asked for."""

    def renamed(self, names: Mapping[str, str]) -> StreamData:
        """Return the same samples with channels of other names; those that are not there keep theirs."""
        other = copy(self)
        other.counts = self.counts.renamed(names)
        other.channels = {
            names.get(name, name): channel.model_copy(update={"name": names.get(name, name)})
            for name, channel in self.channels.items()
        }
        return other

    @property
    def time(self) -> NDArray[Any]:
        """Get the time stamps as received: int64 [µs], of an imported record float64 [s]; shape (n,)."""
        return self._columns[self.time_name]

    def stamps(self, rows: slice) -> NDArray[Any]:
        """Return some of the time stamps as received; the others are not read.

        Raises
        ------
        BadInput
            If the dataset is damaged.
        """
        return self._columns.rows(self.time_name, rows)

    @cached_property
    def first_stamp(self) -> int | float:
        """Get the first time stamp as received [µs], of an imported record [s]."""
        return self.stamps(slice(0, 1))[0].item()  # type: ignore[no-any-return] # a number

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Get the time stamps in seconds of the stream's own clock, shape (n,)."""
        return self.in_seconds(self.time)

    def in_seconds(self, stamps: NDArray[Any]) -> NDArray[np.float64]:
        """Return time stamps as received, shape (n,), in seconds of the stream's own clock."""
        if self.time_name == "time_s":
            return stamps
        return np.asarray(stamps * MICROSECOND_S, dtype=np.float64)

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Get the uninterrupted stretches."""
        return tuple(Segment(*(int(v) for v in row)) for row in self._columns["segments"])

    @property
    def sequence(self) -> NDArray[np.int64]:
        """Get the device's sequence number of every row, shape (n,)."""
        starts = np.array([s.first_row for s in self.segments], dtype=np.int64)
        firsts = np.array([s.first_sequence for s in self.segments], dtype=np.int64)
        lengths = np.diff(np.append(starts, self.rows))
        return np.repeat(firsts - starts, lengths) + np.arange(self.rows)
