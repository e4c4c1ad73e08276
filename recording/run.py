"""A recorded run as the evaluation sees it: calibrated channels on one time base."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foundation.channel import Channel
from foundation.errors import BadInput
from recording.clockmap import ClockMap
from recording.content import MAIN_STREAM, MICROSECOND_S, Anchor, Event, Segment, gaps_of
from recording.layout import ENTRY
from recording.metadata import StreamHead
from recording.reading import open_tree, read_column

STROKES = ("stroke_1", "stroke_2")


@dataclass(frozen=True)
class Series:
    """A channel in its unit: time [s] since the run's start at which each value was true; shape (n,) both."""

    time_s: NDArray[np.float64]
    value: NDArray[np.float64]
    unit: str


@dataclass(frozen=True)
class RunEvent:
    """An event on the run's time [s]; None where the run has no anchor to place it by."""

    time_s: float | None
    kind: str
    text: str
    data: Mapping[str, Any]


class Columns(Mapping[str, NDArray[Any]]):
    """Datasets of one group, each read when it is first asked for."""

    def __init__(self, path: Path, places: Mapping[str, str], facts: Mapping[str, Mapping[str, Any]]) -> None:
        self._path, self._places, self._facts = path, dict(places), facts
        self._read: dict[str, NDArray[Any]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._read:
            place = self._places[name]
            with open_tree(self._path) as tree:
                values = read_column(tree, self._path, place, self._facts[place])
            values.setflags(write=False)
            self._read[name] = values
        return self._read[name]

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

    def __init__(self, path: Path, head: StreamHead, facts: Mapping[str, Mapping[str, Any]]) -> None:
        place = f"{ENTRY}/{head.name}"
        self.name, self.clock, self.device = head.name, head.clock, head.device
        self.rate_Hz = head.rate_Hz
        """Nominal sample rate [Hz], None where none is known."""
        self.channels: Mapping[str, Channel] = {channel.name: channel for channel in head.channels}
        self.time_name = "time_s" if f"{place}/time_s" in facts else "time_us"
        """Which of the two the time stamps are."""
        self.rows = int(facts.get(f"{place}/{self.time_name}", {}).get("rows", 0))
        self._columns = Columns(path, {n: f"{place}/{n}" for n in (self.time_name, "segments")}, facts)
        self.counts: Mapping[str, NDArray[Any]] = Columns(
            path, {name: f"{place}/{name}" for name in self.channels}, facts
        )
        """Raw numbers by channel, shape (n,) each; read when asked for."""

    @property
    def time(self) -> NDArray[Any]:
        """Get the time stamps as received: int64 [µs], of an imported record float64 [s]; shape (n,)."""
        return self._columns[self.time_name]

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Get the time stamps in seconds of the stream's own clock, shape (n,)."""
        if self.time_name == "time_s":
            return self.time
        return np.asarray(self.time * MICROSECOND_S, dtype=np.float64)

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


class Run:
    """One recorded run. Made by :func:`recording.runfile.open_run`.

    The run's time is in seconds on the clock of the controller; its zero is the first time stamp of the
    controller (without one: the first of the host's stamps). An imported record keeps its own zero.
    """

    def __init__(
        self,
        path: Path,
        metadata: dict[str, Any],
        streams: Mapping[str, StreamData],
        anchors: Sequence[Anchor],
        events: Sequence[Event],
    ) -> None:
        self.path = path
        self.metadata = metadata
        """The metadata document (docs/run-file.md)."""
        self.streams = streams
        self.anchors = tuple(anchors)
        self._events = tuple(events)

    @property
    def id(self) -> str:
        """Get the run's id."""
        return str(self.metadata["run"]["id"])

    @property
    def kind(self) -> str:
        """Get ``static``, ``harmonic``, ``impact`` or ``proof``."""
        return str(self.metadata["run"]["kind"])

    @property
    def status(self) -> str:
        """Get ``complete``, ``stopped``, ``failed``, ``recovered`` or ``imported``."""
        return str(self.metadata["run"]["status"])

    @property
    def reason(self) -> str:
        """Get why it ended so, in words."""
        return str(self.metadata["run"].get("reason", ""))

    @property
    def specimen(self) -> dict[str, Any]:
        """Get the specimen's facts."""
        return dict(self.metadata.get("specimen") or {})

    @property
    def step(self) -> dict[str, Any]:
        """Get the planned step's facts (empty for an imported record)."""
        return dict(self.metadata.get("step") or {})

    @property
    def sha256(self) -> str:
        """Get the hash of the run's whole content (survives repacking of the file)."""
        return str(self.metadata["content_sha256"])

    @property
    def events(self) -> tuple[RunEvent, ...]:
        """Get what happened, on the run's time."""
        return tuple(RunEvent(self._event_time_s(e), e.kind, e.text, e.data) for e in self._events)

    def has(self, channel: str) -> bool:
        """Tell whether there are samples of a channel; ``stroke`` is there if any stroke channel is."""
        if channel == "stroke":
            return any(self.has(name) for name in STROKES)
        return any(channel in stream.channels and stream.rows for stream in self.streams.values())

    def stream_of(self, channel: str) -> StreamData:
        """Return the stream that a channel belongs to (for ``stroke``: that of the first stroke channel).

        Raises
        ------
        BadInput
            If the run has no samples of it; the message lists the channels there are.
        """
        if channel == "stroke":
            channel = next((name for name in STROKES if self.has(name)), STROKES[0])
        for stream in self.streams.values():
            if channel in stream.channels and stream.rows:
                return stream
        present = [name for stream in self.streams.values() if stream.rows for name in stream.channels]
        raise BadInput(
            f"the run has no samples of the channel “{channel}”",
            file=self.path,
            remedy=f"it has {', '.join(present) or 'none at all'}",
        )

    def series(self, channel: str) -> Series:
        """Return a channel calibrated, corrected for its delay and on the run's time.

        Missing values are NaN; rows are neither dropped nor invented (see :meth:`gaps`).

        Raises
        ------
        BadInput
            If there is no such channel, its dataset is damaged, or its clock cannot be related to the run's.
        """
        if channel == "stroke":
            return self.stroke()
        stream = self.stream_of(channel)
        facts = stream.channels[channel]
        value = facts.calibration.apply(stream.counts[channel])
        return Series(self._run_time_s(stream) - facts.delay_s, value, facts.unit)

    def stroke(self) -> Series:
        """Return the stroke: the mean of ``stroke_1`` and ``stroke_2``, or the one that is present.

        The mean is true at the mean of both times: where their delays differ, that is exact to the first
        order, and nothing need be interpolated.

        Raises
        ------
        BadInput
            As :meth:`series`, and if the two are not sampled at the same instants.
        """
        names = [name for name in STROKES if self.has(name)] or [STROKES[0]]
        each = [self.series(name) for name in names]
        if len(each) == 1:
            return each[0]
        if self.stream_of(names[0]).name != self.stream_of(names[1]).name:
            raise BadInput(
                "stroke_1 and stroke_2 are of different streams: no common instants", file=self.path
            )
        one, two = each
        return Series((one.time_s + two.time_s) / 2.0, (one.value + two.value) / 2.0, one.unit)

    def gaps(self, stream: str) -> list[tuple[int, int]]:
        """Return the interruptions of a stream as (row before it, samples lost); never integrate across one.

        The number lost is 0 where an interruption is known but not its size.

        Raises
        ------
        BadInput
            If the run has no such stream.
        """
        if stream not in self.streams:
            raise BadInput(
                f"the run has no stream “{stream}”",
                file=self.path,
                remedy=f"it has {', '.join(self.streams)}",
            )
        return gaps_of(self.streams[stream].segments)

    @cached_property
    def _clocks(self) -> ClockMap | None:
        return ClockMap(self.anchors) if self.anchors else None

    @cached_property
    def _device_stream(self) -> StreamData | None:
        device = [s for s in self.streams.values() if s.clock == "device" and s.rows]
        return next((s for s in device if s.name == MAIN_STREAM), device[0] if device else None)

    @cached_property
    def _origin_s(self) -> float:
        """The zero of the run's time, on the device's clock (on the host's, where no device has one)."""
        if self._device_stream is not None:
            if self._device_stream.time.dtype.kind == "f":
                return 0.0
            return float(self._device_stream.time_s[0])
        firsts = [float(stream.time_s[0]) for stream in self.streams.values() if stream.rows]
        return min(firsts, default=0.0)

    def _run_time_s(self, stream: StreamData) -> NDArray[np.float64]:
        if stream is self._device_stream and stream.time.dtype.kind == "i":
            since_us = stream.time - stream.time[0]  # in integers: exact, however long the device is up
            return np.asarray(since_us * MICROSECOND_S, dtype=np.float64)
        time_s = stream.time_s
        if stream.clock == "host" and self._device_stream is not None:
            if self._clocks is None:
                raise BadInput(
                    f"stream {stream.name} has no place on the run's time: no clock anchors were recorded",
                    file=self.path,
                    place=f"{ENTRY}/anchors",
                )
            time_s = self._clocks.to_device_s(time_s)
        return time_s - self._origin_s

    def _event_time_s(self, event: Event) -> float | None:
        if self._device_stream is None:
            return event.at_s - self._origin_s
        if self._clocks is None:
            return None
        return float(self._clocks.to_device_s(np.array([event.at_s]))[0]) - self._origin_s
