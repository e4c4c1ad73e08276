"""Following a campaign by its journal alone: where no socket can be reached, such as on a network drive."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.daq.guards import CONTROLLER_STREAM, FORCE_2_STREAM, GuardPanel, GuardSet
from bufferstand.daq.monitor.past import JournalStreams
from bufferstand.daq.monitor.sample_rows import RowBuffer, channels_of, finite
from bufferstand.foundation import BadInput
from bufferstand.recording import Anchor, Event
from bufferstand.recording.journal import ChainReader, DataRecord, EndRecord

BACKLOG_S = 30.0
"""Of a journal that is there already, so much is shown [s of the device's clock]."""


@dataclass
class News:
    """What a journal has brought since the last look."""

    rows: dict[str, Any] = field(default_factory=dict)
    extremes: dict[str, list[float | None]] = field(default_factory=dict)
    values: dict[str, float | None] = field(default_factory=dict)
    readings: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    lines: list[dict[str, Any]] = field(default_factory=list)
    heard: set[str] = field(default_factory=set)
    samples: int = 0
    lost: int = 0
    guards: Mapping[str, Any] | None = None
    channels: list[dict[str, Any]] = field(default_factory=list)
    margins: list[dict[str, Any]] = field(default_factory=list)
    at_s: float = 0.0
    ended: bool = False


class JournalTail:
    """Reads the journal of one run while it is written; takes no lock and cannot harm it.

    Parameters
    ----------
    path : Path
        Its first file.

    Raises
    ------
    BadInput
        If it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._reader = ChainReader(path)
        self._streams: JournalStreams | None = None
        self._guards: Mapping[str, Any] | None = None
        self._panel: GuardPanel | None = None
        """The guards of the run once more: they see what the journal holds, and show their margins."""
        self._buffer = RowBuffer()

    def close(self) -> None:
        """Let go of the files."""
        self._reader.__exit__(None, None, None)

    def poll(self) -> News:
        """Return what has come in since the last call.

        Raises
        ------
        BadInput
            If the journal cannot be understood.
        """
        try:
            return self._news()
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            what = f"{type(error).__name__}: {error}"
            raise BadInput(f"the journal cannot be understood ({what})", file=self.path) from None

    def _news(self) -> News:
        news = News()
        records = self._reader.poll()
        if self._streams is None and self._reader.header is not None:
            self._streams = self._understood(self._reader.header["metadata"])
            news.guards = self._guards
            news.channels = channels_of(self._streams.facts.values())
        newest_us = max(
            (int(r.time_us[-1]) for r in records if _is_main(r) and len(r.time_us)),  # type: ignore[union-attr]
            default=0,
        )
        for record in records:
            if isinstance(record, Anchor):
                if self._streams is not None:
                    self._streams.anchor = record
            elif isinstance(record, Event):
                news.lines.append(self._line(record))
            elif isinstance(record, EndRecord):
                news.ended = True
            elif self._streams is not None and record.stream in self._streams.facts and len(record.time_us):
                self._take(record, self._streams, news, newest_us)
        news.rows, news.extremes = self._buffer.take()
        anchor = self._streams.anchor if self._streams else None
        if anchor is not None:
            news.at_s = anchor.host_s + max(0.0, (newest_us - anchor.device_us) / 1e6)
        if self._panel is not None:
            news.margins = [margin.as_dict() for margin in self._panel.margins(time.monotonic())]
        return news

    def _understood(self, metadata: Mapping[str, Any]) -> JournalStreams:
        streams = JournalStreams(metadata, self.path)
        try:
            self._guards = metadata["limits"]["guards"]
            self._panel = GuardPanel(GuardSet.from_dict(self._guards), wall_s=time.monotonic())
        except (KeyError, TypeError, ValueError) as error:
            raise BadInput(f"the journal's header cannot be understood ({error})", file=self.path) from None
        return streams

    def _take(self, record: DataRecord, streams: JournalStreams, news: News, newest_us: int) -> None:
        assert self._panel is not None
        main = record.stream == CONTROLLER_STREAM
        recent = not main or newest_us - int(record.time_us[-1]) <= BACKLOG_S * 1e6
        scaled = streams.scaled(record, newest_us)
        if recent:
            self._panel.observe(scaled, time.monotonic())
        news.heard.add(record.stream)
        news.values.update({name: finite(float(value[-1])) for name, value in scaled.values.items()})
        if main:
            news.samples += len(scaled)
            news.lost += record.lost
            if recent:
                self._buffer.add(scaled)
        elif record.stream != FORCE_2_STREAM and record.stream in scaled.values:
            news.readings.setdefault(record.stream, []).extend(
                (round(float(t) / 1e6, 1), round(float(v), 3))
                for t, v in zip(scaled.time_us, scaled.values[record.stream], strict=True)
                if np.isfinite(v)
            )

    def _line(self, event: Event) -> dict[str, Any]:
        utc = ""
        anchor = self._streams.anchor if self._streams else None
        if anchor is not None:
            with suppress(ValueError, OverflowError):  # of a strange journal: without its time
                moment = datetime.fromisoformat(anchor.utc)
                utc = (moment + timedelta(seconds=event.at_s - anchor.host_s)).isoformat()
        return {"utc": utc, "at_s": round(event.at_s, 3), "text": f"{event.kind}: {event.text}"}


def _is_main(record: object) -> bool:
    return isinstance(record, DataRecord) and record.stream == CONTROLLER_STREAM


def newest_journal(runs: Path) -> Path | None:
    """Return the journal of the run under way, None if none is recorded."""
    found = [path for path in runs.glob("*.journal") if path.is_file()]
    return max(found, key=lambda path: path.name, default=None)
