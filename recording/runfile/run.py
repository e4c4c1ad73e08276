"""A recorded run as the evaluation sees it: calibrated channels on one time base."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS, Branch, Channel, mean_of_strokes
from bufferstand.foundation.files import content_hash
from bufferstand.recording.content import MAIN_STREAM, MICROSECOND_S, Anchor, Event, gaps_of
from bufferstand.recording.runfile.clock_map import ClockMap
from bufferstand.recording.runfile.device_clocks import readings_in
from bufferstand.recording.runfile.drifting_clock_map import DriftingClockMap
from bufferstand.recording.runfile.layout import ENTRY
from bufferstand.recording.runfile.other_clocks import Alignment, OtherClocks
from bufferstand.recording.runfile.reading_apart import DatasetReader
from bufferstand.recording.runfile.simulated_origin import is_record_only
from bufferstand.recording.runfile.stream import StreamData

_KEPT_ROWS = 1_000_000
"""Calibrated channels of no more rows are kept once made: they are asked for several times."""


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


class Run:
    """One recorded run. Made by :func:`bufferstand.recording.runfile.file.open_run`.

    The run's time is in seconds on the clock of the controller; its zero is the first time stamp of the
    controller (without one: the first of the host's stamps). An imported record keeps its own zero.
    """

    def __init__(
        self,
        reader: DatasetReader,
        metadata: dict[str, Any],
        streams: Mapping[str, StreamData],
    ) -> None:
        self.path = reader.path
        self._reader = reader
        self.metadata = metadata
        """The metadata document (docs/run-file.md)."""
        self.streams = streams
        self._times_s: dict[str, NDArray[np.float64]] = {}
        self._series: dict[str, Series] = {}
        self._true_s: dict[tuple[str, float], NDArray[np.float64]] = {}

    def renamed(self, names: Mapping[str, Mapping[str, str]]) -> Run:
        """Return the same run with channels of other names.

        Parameters
        ----------
        names : mapping of str to mapping of str to str
            By stream: the new name of each channel that gets one.
        """
        streams = {
            name: stream.renamed(names[name]) if name in names else stream
            for name, stream in self.streams.items()
        }
        return Run(self._reader, self.metadata, streams)

    def _rows(self, group: str, names: Sequence[str]) -> Iterator[tuple[Any, ...]]:
        return zip(*[values.tolist() for values in self._columns(group, names)], strict=True)

    def _columns(self, group: str, names: Sequence[str]) -> list[NDArray[Any]]:
        return [self._reader.column(f"{ENTRY}/{group}/{name}") for name in names]

    @cached_property
    def anchors(self) -> tuple[Anchor, ...]:
        """Pairs of readings of the device's and the host's clock."""
        rows = self._rows("anchors", ("device_us", "host_s", "utc"))
        return tuple(Anchor(device_us, host_s, utc.decode()) for device_us, host_s, utc in rows)

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
    def samples_sha256(self) -> str | None:
        """Hash of the samples of all streams, whatever the document states about them; None without any."""
        groups = tuple(f"{ENTRY}/{name}/" for name in self.streams)
        samples = {
            place: facts["sha256"]
            for place, facts in self.metadata["datasets"].items()
            if place.startswith(groups) and facts["rows"]
        }
        return content_hash(samples) if samples else None

    @property
    def sha256(self) -> str:
        """Get the hash of the run's whole content (survives repacking of the file)."""
        return str(self.metadata["content_sha256"])

    @cached_property
    def recorded_events(self) -> tuple[Event, ...]:
        """Get what happened, on the host's stand time, as it was recorded."""
        rows = self._rows("events", ("at_s", "kind", "text", "data"))
        return tuple(
            Event(at_s, kind.decode(), text.decode(), json.loads(data)) for at_s, kind, text, data in rows
        )

    @cached_property
    def events(self) -> tuple[RunEvent, ...]:
        """Get what happened, on the run's time."""
        return tuple(
            RunEvent(self._event_time_s(event.at_s), event.kind, event.text, event.data)
            for event in self.recorded_events
        )

    def has(self, channel: str) -> bool:
        """Tell whether there are samples of a channel; ``stroke`` is there if any stroke channel is."""
        if channel == "stroke":
            return any(self.has(name) for name in STROKE_CHANNELS)
        return any(channel in stream.channels and stream.rows for stream in self.streams.values())

    def stream_of(self, channel: str) -> StreamData:
        """Return the stream that a channel belongs to (for ``stroke``: that of the first stroke channel).

        Raises
        ------
        BadInput
            If the run has no samples of it; the message lists the channels there are.
        """
        if channel == "stroke":
            channel = next((name for name in STROKE_CHANNELS if self.has(name)), STROKE_CHANNELS[0])
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
        if channel in self._series:
            return self._series[channel]
        own = stream.channels[channel]
        series = _calibrated(own, self._true_time_s(stream, own.delay_s), stream.counts[channel])
        if stream.rows <= _KEPT_ROWS:
            self._series[channel] = series
        return series

    def picked(self, channel: str, every: int) -> Series:
        """Return every so-manyeth sample of a channel of the stand, as :meth:`series` has them.

        Raises
        ------
        BadInput
            As :meth:`series`.
        """
        stream = self.stream_of(channel)
        own = stream.channels[channel]
        if channel in self._series or own.calibration.falling:  # which branch it is on, all samples tell
            whole = self.series(channel)
            return Series(whole.time_s[::every], whole.value[::every], whole.unit)
        return _calibrated(
            own, self._run_time_s(stream)[::every] - own.delay_s, stream.counts[channel][::every]
        )

    def stroke(self) -> Series:
        """Return the stroke: the mean of ``stroke_1`` … ``stroke_4``, as many as there are, or the only one.

        The mean is true at the mean of their times: where their delays differ, that is exact to the first
        order, and nothing need be interpolated.

        Raises
        ------
        BadInput
            As :meth:`series`, and if they are not sampled at the same instants.
        """
        first = self.stream_of("stroke").name
        there = [name for name in STROKE_CHANNELS if self.has(name)]
        if self.other_clocks.lines:  # those of another device are no part of this mean
            there = [name for name in there if self.stream_of(name).name == first]
        names = there or [STROKE_CHANNELS[0]]
        self._check_common_instants(names)
        return mean_stroke([self.series(name) for name in names])

    def _check_common_instants(self, wires: Sequence[str]) -> None:
        if len({self.stream_of(name).name for name in wires}) > 1:
            raise BadInput(
                f"{' and '.join(wires)} are of different streams: no common instants", file=self.path
            )

    def blocks(
        self, channels: Sequence[str], rows: int, only: Sequence[int] | None = None
    ) -> Iterator[dict[str, Series]]:
        """Return channels of one stream block by block, in order: as :meth:`series`, and never the whole.

        Parameters
        ----------
        channels : sequence of str
            Channels of one stream; not ``stroke`` (:func:`mean_stroke`).
        rows : int
            Rows of a block; the last one may be shorter.
        only : sequence of int, optional
            Numbers of those blocks that are wanted, rising, the first one being 0. The others are not read,
            but those before it of a channel with a falling branch: it carries on from block to block.

        Raises
        ------
        BadInput
            As :meth:`series`, and if the channels are of different streams.
        """
        streams = {self.stream_of(name).name: self.stream_of(name) for name in channels}
        if len(streams) > 1:
            raise BadInput(
                f"{' and '.join(channels)} are of different streams: no common instants", file=self.path
            )
        (stream,) = streams.values()
        branches = {name: Branch() for name in channels}
        wanted = range(-(-stream.rows // rows)) if only is None else only
        numbers: Sequence[int] = wanted
        if wanted and any(stream.channels[name].calibration.falling for name in channels):
            numbers = range(wanted[-1] + 1)
        for number in numbers:
            part = slice(number * rows, min((number + 1) * rows, stream.rows))
            time_s = self._on_run_time_s(stream, stream.stamps(part))
            counts = {name: stream.counts.rows(name, part) for name in channels}
            block = {
                name: _calibrated(
                    stream.channels[name],
                    time_s - stream.channels[name].delay_s,
                    counts[name],
                    branches[name],
                )
                for name in channels
            }
            if number in wanted:
                yield block

    def time_blocks(self, stream: str, rows: int) -> Iterator[NDArray[np.float64]]:
        """Return the times of a stream on the run's time [s], block by block; no channel's delay is in them.

        Raises
        ------
        BadInput
            If its time stamps are damaged, or its clock cannot be related to the run's.
        """
        data = self.streams[stream]
        for first in range(0, data.rows, rows):
            yield self._on_run_time_s(data, data.stamps(slice(first, min(first + rows, data.rows))))

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
    def _clocks(self) -> ClockMap | DriftingClockMap | None:
        device_us, host_s = self._columns("anchors", ("device_us", "host_s"))
        if not host_s.size:
            return None
        kind = DriftingClockMap if is_record_only(self.metadata) else ClockMap
        return kind(device_us, host_s)

    def u_clocks_s(self, one: str, two: str) -> float:
        """Return the standard uncertainty of the instants of one channel against those of another [s].

        Of channels of one clock, and of runs whose anchors are few, nothing is added to their delays: 0.
        """
        streams = {self.stream_of(name).name for name in (one, two)}
        if beside := streams & set(self.other_clocks.lines):
            return 0.0 if len(streams) == 1 else max(self.other_clocks.u_s(name) for name in beside)
        clocks = {self.stream_of(name).clock for name in (one, two)}
        if len(clocks) < 2 or not isinstance(self._clocks, DriftingClockMap):
            return 0.0
        return self._clocks.spread_s

    @cached_property
    def other_clocks(self) -> OtherClocks:
        """Devices beside the controller that have a clock of their own."""
        stand = self.metadata.get("stand") or {}
        beside = bool(stand.get("acquisition")) and not is_record_only(self.metadata)
        return OtherClocks(readings_in(self.recorded_events) if beside else {}, self.streams)

    def align(self, stream: str, alignment: Alignment) -> None:
        """Place a device's samples by what was found from the samples themselves, from now on.

        Parameters
        ----------
        stream : str
            Of :attr:`other_clocks`.
        alignment : Alignment
            Against the place that it has now.
        """
        self.other_clocks.alignments[stream] = alignment
        self._times_s.pop(stream, None)
        for name in self.streams[stream].channels:
            self._series.pop(name, None)
        for key in [key for key in self._true_s if key[0] == stream]:
            del self._true_s[key]

    @cached_property
    def _device_stream(self) -> StreamData | None:
        device = [
            s
            for s in self.streams.values()
            if s.clock == "device" and s.rows and s.name not in self.other_clocks.lines
        ]
        return next((s for s in device if s.name == MAIN_STREAM), device[0] if device else None)

    @cached_property
    def _origin_s(self) -> float:
        """The zero of the run's time, on the device's clock (on the host's, where no device has one)."""
        if self._device_stream is not None:
            return _first_s(self._device_stream) if self._device_stream.time_name == "time_us" else 0.0
        return min((_first_s(stream) for stream in self.streams.values() if stream.rows), default=0.0)

    def _run_time_s(self, stream: StreamData) -> NDArray[np.float64]:
        if stream.name in self._times_s:
            return self._times_s[stream.name]
        time_s = self._on_run_time_s(stream, stream.time)
        if stream.rows <= _KEPT_ROWS:
            self._times_s[stream.name] = time_s
        return time_s

    def _true_time_s(self, stream: StreamData, delay_s: float) -> NDArray[np.float64]:
        """Return the times at which the values of channels were true; those of one delay share them."""
        if (stream.name, delay_s) in self._true_s:
            return self._true_s[stream.name, delay_s]
        time_s = self._run_time_s(stream) - delay_s
        if stream.rows <= _KEPT_ROWS:
            self._true_s[stream.name, delay_s] = time_s
        return time_s

    def _on_run_time_s(self, stream: StreamData, stamps: NDArray[Any]) -> NDArray[np.float64]:
        if stream is self._device_stream and stream.time_name == "time_us":
            since_us = stamps - stream.first_stamp  # in integers: exact, however long the device is up
            return np.asarray(since_us * MICROSECOND_S, dtype=np.float64)
        time_s = stream.in_seconds(stamps)
        if stream.name in self.other_clocks.lines:
            main = None if self._device_stream is None or self._clocks is None else self._clocks.to_device_s
            return self.other_clocks.placed_s(stream.name, time_s, self._origin_s, main) - self._origin_s
        if stream.clock == "host" and self._device_stream is not None:
            if self._clocks is None:
                raise BadInput(
                    f"stream {stream.name} has no place on the run's time: no clock anchors were recorded",
                    file=self.path,
                    place=f"{ENTRY}/anchors",
                )
            time_s = self._clocks.to_device_s(time_s)
        return time_s - self._origin_s

    def _event_time_s(self, at_s: float) -> float | None:
        if self._device_stream is None:
            return at_s - self._origin_s
        if self._clocks is None:
            return None
        return float(self._clocks.to_device_s(np.array([at_s]))[0]) - self._origin_s


def _first_s(stream: StreamData) -> float:
    return float(stream.in_seconds(np.array([stream.first_stamp]))[0])


def _calibrated(
    channel: Channel, true_s: NDArray[np.float64], counts: NDArray[Any], branch: Branch | None = None
) -> Series:
    return Series(true_s, channel.calibration.apply(counts, branch), channel.unit)


def mean_stroke(wires: Sequence[Series]) -> Series:
    """Return the mean of the draw wires at the mean of their times (:meth:`Run.stroke`), or the only one."""
    if len(wires) == 1:
        return wires[0]
    first, *others = wires
    together = all(one.time_s is first.time_s or np.array_equal(one.time_s, first.time_s) for one in others)
    time_s = first.time_s if together else mean_of_strokes([one.time_s for one in wires])
    return Series(time_s, mean_of_strokes([one.value for one in wires]), first.unit)
