"""Columns of dates and times: seconds since the first one, and when that was."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bufferstand.recording.foreign.record import Floats, TimeColumn

_NS_PER_S = 1_000_000_000
_NOT_A_TIME = np.iinfo(np.int64).min
_NO_DATE = 1900
"""The year of a time without a date."""
KNOWN_DATES = np.array(["1678-01-01", "2262-01-01"], dtype="datetime64[us]")
"""What nanoseconds since 1970 can say."""
_ZONE = re.compile(r"(Z|[+-]\d{2}:?\d{2})\s*")


class DateColumns:
    """Turns dates and times into seconds since the first one, block by block.

    A logger's clock that was set (summer time) shows as a gap or as backward stamps: nothing is corrected.
    """

    def __init__(self, clock: TimeColumn) -> None:
        self._clock = clock
        self._first_ns: int | None = None
        self.started: datetime | None = None
        """When the first one was; None where no date is stated."""
        self.zone_is_stated = True
        self._aware: bool | None = None
        """Whether the first ones state a zone: then all must, or one could not tell them apart."""

    def seconds(self, cells: Sequence[str], no_value: frozenset[str]) -> tuple[Floats, NDArray[np.int64]]:
        """Return times [s] since the first one, and which cells are neither date and time nor no value."""
        texts = pd.Series(list(cells), dtype=str)
        empty = texts.isin(list(no_value)).to_numpy()
        known = texts.where(~empty, None)
        form = self._clock.format or "ISO8601"
        try:
            parsed = pd.to_datetime(known, format=form, errors="coerce")
        except ValueError:  # of several zones, or some without: on one clock as UTC
            zoned = texts.str.fullmatch(f".*{_ZONE.pattern}")
            if self._clock.format is None:
                known = known.where(zoned, None)
            parsed = pd.to_datetime(known, format=form, errors="coerce", utc=True)
        aware = getattr(parsed.dt, "tz", None) is not None
        if aware:
            parsed = parsed.dt.tz_convert("UTC").dt.tz_localize(None)
        coarse = parsed.to_numpy(dtype="datetime64[us]")
        ns = parsed.to_numpy(dtype="datetime64[ns]").astype(np.int64)
        ns[(coarse < KNOWN_DATES[0]) | (coarse > KNOWN_DATES[1])] = _NOT_A_TIME
        if self._aware is None and (ns != _NOT_A_TIME).any():
            self._aware = aware
        if aware != self._aware:
            ns[:] = _NOT_A_TIME
        bad = np.flatnonzero((ns == _NOT_A_TIME) & ~empty)
        return self.since_first(ns, aware=aware), bad

    def since_first(self, ns: NDArray[np.int64], *, aware: bool) -> Floats:
        """Return times [s] since the first one of nanoseconds since 1970, NaN where there is none."""
        known = ns != _NOT_A_TIME
        if self._first_ns is None and known.any():
            self._first_ns = int(ns[known][0])
            self._set_start(self._first_ns, aware=aware)
        seconds = (ns - (self._first_ns or 0)) / _NS_PER_S
        return np.where(known, seconds, np.nan)

    def _set_start(self, first_ns: int, *, aware: bool) -> None:
        first = datetime.fromtimestamp(first_ns // _NS_PER_S, UTC).replace(
            microsecond=first_ns % _NS_PER_S // 1000
        )
        if first.year <= _NO_DATE:
            return
        if not aware and self._clock.zone is not None:
            first = first.replace(tzinfo=self._clock.zone).astimezone(UTC)
        self.zone_is_stated = aware or self._clock.zone is not None
        self.started = first
