"""Any span of a run that is over, from its file: as fine as it was recorded, or thinned out to extremes."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.past.buckets import LONGEST_S, bucketed, held
from bufferstand.daq.monitor.past.history import MOST_POINTS
from bufferstand.daq.monitor.past.run_samples import run_blocks, units_of
from bufferstand.daq.monitor.sample_rows import finite
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording import MAIN_STREAM
from bufferstand.recording.finding import run_files
from bufferstand.recording.runfile import Run, StreamData, open_run

BLOCK_ROWS = 1 << 16


class RunSpans:
    """Spans of the runs of one campaign; may block, and serves one at a time.

    Parameters
    ----------
    folder : Path
        The campaign's.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._one_by_one = threading.Lock()

    def span(self, file: str, from_s: float, to_s: float, channels: Sequence[str]) -> dict[str, Any]:
        """Return what a chart of a span shows.

        Parameters
        ----------
        file : str
            One of the campaign's run files, relative to its folder.
        from_s, to_s : float
            Run time [s]; the infinite ones reach to what there is.
        channels : sequence of str

        Returns
        -------
        dict
            As of :meth:`~bufferstand.daq.monitor.past.history.History.span`.

        Raises
        ------
        BadInput
            If the campaign has no such run, or it cannot be read.
        """
        with self._one_by_one:
            path = next((one for one in run_files([self._folder]) if _name(one, self._folder) == file), None)
            if path is None:
                raise BadInput("the campaign has no such run")
            return _span(open_run(path), from_s, to_s, channels)


def _name(path: Path, folder: Path) -> str:
    return str(path.relative_to(folder))


def _span(run: Run, from_s: float, to_s: float, channels: Sequence[str]) -> dict[str, Any]:
    units = units_of(run)
    common = {"channels": [{"name": name, "unit": unit} for name, unit in units.items()]}
    main = run.streams.get(MAIN_STREAM) or next(iter(run.streams.values()), None)
    if main is None or not main.rows:
        return {**common, "t": [], "values": {}, "width_s": None, "first_s": None, "last_s": None}
    last_s = _length_s(main)
    from_s = min(max(from_s, 0.0), last_s)
    to_s = min(max(to_s, from_s), last_s)
    every_s = last_s / max(1, main.rows - 1)  # buckets that are wider have a sample each
    width_s = max(1.5 * every_s, (to_s - from_s) / MOST_POINTS, 1e-6)
    numbers = np.arange(math.floor(from_s / width_s), math.floor(to_s / width_s) + 1)[: MOST_POINTS + 1]
    found = {name: np.full((2, numbers.size), np.nan) for name in channels if name in units}
    for stream in run.streams.values():
        for time_s, values in _within(run, stream, list(found), (from_s - LONGEST_S, to_s), width_s):
            at, extremes = bucketed(time_s, values, width_s)
            here = (at >= numbers[0]) & (at <= numbers[-1])
            for name, (low, high) in extremes.items():
                place = at[here] - numbers[0]
                found[name][0, place] = np.fmin(found[name][0, place], low[here])
                found[name][1, place] = np.fmax(found[name][1, place], high[here])
    return {
        **common,
        "t": np.round((numbers + 0.5) * width_s, 6).tolist(),
        "values": {
            name: {"low": [finite(v) for v in low], "high": [finite(v) for v in high]}
            for name, (low, high) in found.items()
        },
        "width_s": width_s,
        "first_s": 0.0,
        "last_s": last_s,
    }


def _length_s(stream: StreamData) -> float:
    ends = np.array([stream.first_stamp, stream.stamps(slice(stream.rows - 1, stream.rows))[0]])
    first_s, last_s = stream.in_seconds(ends)
    return max(0.0, float(last_s - first_s))


def _within(
    run: Run, stream: StreamData, names: Sequence[str], span_s: tuple[float, float], width_s: float
) -> Iterator[tuple[NDArray[np.float64], Mapping[str, NDArray[np.float64]]]]:
    """Return the samples of a stream that a span needs; a value that comes seldom holds until the next."""
    own = list(stream.channels)
    read = [name for name in names if name in own]
    if "stroke" in names and "stroke" not in own:
        read += [name for name in STROKE_CHANNELS if name in own and name not in read]
    if not read:
        return
    for time_s, values in run_blocks(run, read, BLOCK_ROWS):
        first, last = np.searchsorted(time_s, span_s, side="right").tolist()
        rows = slice(first, min(last + 1, len(time_s)))  # the next one, too: until then the last one holds
        if rows.start < rows.stop:
            chosen = {name: one[rows] for name, one in values.items() if name in names}
            yield held(np.maximum.accumulate(time_s[rows]), chosen, width_s, LONGEST_S)
