"""Any span of a run that is over, from its file: as fine as it was recorded, or thinned out to extremes."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.past.answers import MOST_POINTS, answer
from bufferstand.daq.monitor.past.block_times import BlockTimes
from bufferstand.daq.monitor.past.buckets import LONGEST_S, bucketed, held
from bufferstand.daq.monitor.past.run_samples import run_blocks, units_of
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording import MAIN_STREAM
from bufferstand.recording.finding import run_files
from bufferstand.recording.runfile import Run, StreamData, open_run

BLOCK_ROWS = 1 << 17
"""Of what is read at once: those of a chunk of a run file, which is decoded as a whole."""
WIDE_ROWS = 1 << 20
"""Spans of more rows are put together from cells, which are kept once all rows were read: see RunSpans."""
MOST_OPEN = 4
"""So many runs stay opened; of a small one all samples are in memory."""
MOST_ANSWERS = 8
"""So many answers are kept: whoever has zoomed in goes back to where he was."""


class RunSpans:
    """Spans of the runs of one campaign; may block, and serves one at a time.

    A run is read to the end when its first span is asked for, to see that it is whole; from then on only
    those blocks are read that have samples in a span. Where these would be many (:data:`WIDE_ROWS`), the
    extremes in cells of a thousandth of as many rows are kept for the whole run when a channel is first asked
    for so; the buckets of a wide span are as many whole cells as they must be, and nothing more is read.

    Parameters
    ----------
    folder : Path
        The campaign's.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._one_by_one = threading.Lock()
        self._opened: OrderedDict[Path, _OpenedRun] = OrderedDict()

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
            return self._run(path).span(from_s, to_s, channels)

    def _run(self, path: Path) -> _OpenedRun:
        """Return a run as it was opened, unless its file is another one by now."""
        stamp = _stamp(path)
        known = self._opened.pop(path, None)
        if known is None or known.stamp != stamp:
            known = _OpenedRun(open_run(path), stamp)
        self._opened[path] = known
        while len(self._opened) > MOST_OPEN:
            self._opened.popitem(last=False)
        return known


def _stamp(path: Path) -> tuple[int, int, int]:
    """Return what tells that a file is the one that was opened."""
    try:
        facts = path.stat()
    except OSError as error:
        raise BadInput(f"it cannot be read ({error.strerror})", file=path) from None
    return facts.st_size, facts.st_mtime_ns, facts.st_ino


def _name(path: Path, folder: Path) -> str:
    return str(path.relative_to(folder))


class _OpenedRun:
    """A run that was opened, which blocks of it hold which times, and its last answers."""

    def __init__(self, run: Run, stamp: tuple[int, int, int]) -> None:
        self.stamp = stamp
        self._run = run
        self._units = units_of(run)
        main = run.streams.get(MAIN_STREAM) or next(iter(run.streams.values()), None)
        self._rows = 0 if main is None else main.rows
        self._last_s = _length_s(main) if main is not None and main.rows else 0.0
        self._blocks = {
            name: BlockTimes(run, stream, BLOCK_ROWS) for name, stream in run.streams.items() if stream.rows
        }
        self._every_s = self._last_s / max(1, self._rows - 1)
        self._cell_s = max(1.5, WIDE_ROWS / MOST_POINTS) * self._every_s
        self._cells: dict[str, NDArray[np.float64]] = {}
        self._answers: OrderedDict[tuple[float, float, tuple[str, ...]], dict[str, Any]] = OrderedDict()

    def span(self, from_s: float, to_s: float, channels: Sequence[str]) -> dict[str, Any]:
        """Return what :meth:`RunSpans.span` does."""
        if not self._rows:
            return answer(self._units)
        last_s = self._last_s
        from_s = min(max(from_s, 0.0), last_s)
        to_s = min(max(to_s, from_s), last_s)
        names = tuple(name for name in channels if name in self._units)
        key = from_s, to_s, names
        if key not in self._answers:
            # buckets that are wider than one and a half steps have a sample each
            width_s = max(1.5 * self._every_s, (to_s - from_s) / MOST_POINTS, 1e-6)
            cells = math.ceil(width_s / self._cell_s) if width_s > self._cell_s > 0.0 else 0
            width_s = cells * self._cell_s or width_s
            numbers = np.arange(math.floor(from_s / width_s), math.floor(to_s / width_s) + 1)
            numbers = numbers[: MOST_POINTS + 1]
            if cells:
                values = self._of_cells(numbers, cells, names)
            else:
                values = self._extremes(numbers, width_s, (from_s, to_s), names)
            self._answers[key] = answer(self._units, numbers, width_s, values, (0.0, last_s), 6)
        self._answers.move_to_end(key)
        while len(self._answers) > MOST_ANSWERS:
            self._answers.popitem(last=False)
        return self._answers[key]

    def _of_cells(
        self, numbers: NDArray[np.int64], cells: int, names: Sequence[str]
    ) -> dict[str, NDArray[np.float64]]:
        """Return the extremes in buckets of so many cells each."""
        if missing := [name for name in names if name not in self._cells]:
            whole = np.arange(math.floor(self._last_s / self._cell_s) + 1)
            self._cells |= self._extremes(whole, self._cell_s, (0.0, self._last_s), missing)
        found = {}
        for name in names:
            kept = self._cells[name][:, numbers[0] * cells : (numbers[-1] + 1) * cells]
            filled = np.full((2, numbers.size * cells), np.nan)
            filled[:, : kept.shape[1]] = kept
            low, high = filled.reshape(2, numbers.size, cells)
            found[name] = np.array([np.fmin.reduce(low, axis=1), np.fmax.reduce(high, axis=1)])
        return found

    def _extremes(
        self,
        numbers: NDArray[np.int64],
        width_s: float,
        span_s: tuple[float, float],
        names: Sequence[str],
    ) -> dict[str, NDArray[np.float64]]:
        found = {name: np.full((2, numbers.size), np.nan) for name in names}
        reach_s = span_s[0] - LONGEST_S, float(numbers[-1] + 1) * width_s
        for name, blocks in self._blocks.items():
            stream, only = self._run.streams[name], blocks.within(*reach_s)
            for time_s, values in _within(self._run, stream, names, (reach_s[0], span_s[1]), width_s, only):
                at, extremes = bucketed(time_s, values, width_s)
                here = (at >= numbers[0]) & (at <= numbers[-1])
                for channel, (low, high) in extremes.items():
                    place = at[here] - numbers[0]
                    found[channel][0, place] = np.fmin(found[channel][0, place], low[here])
                    found[channel][1, place] = np.fmax(found[channel][1, place], high[here])
        return found


def _length_s(stream: StreamData) -> float:
    ends = np.array([stream.first_stamp, stream.stamps(slice(stream.rows - 1, stream.rows))[0]])
    first_s, last_s = stream.in_seconds(ends)
    return max(0.0, float(last_s - first_s))


def _within(
    run: Run,
    stream: StreamData,
    names: Sequence[str],
    span_s: tuple[float, float],
    width_s: float,
    only: Sequence[int],
) -> Iterator[tuple[NDArray[np.float64], Mapping[str, NDArray[np.float64]]]]:
    """Return the samples of a stream that a span needs, of some blocks; a value holds until the next."""
    own = list(stream.channels)
    read = [name for name in names if name in own]
    if "stroke" in names and "stroke" not in own:
        read += [name for name in STROKE_CHANNELS if name in own and name not in read]
    if not read:
        return
    for stamps_s, recorded in run_blocks(run, read, BLOCK_ROWS, only):
        there = np.isfinite(stamps_s)  # a foreign record may lack a time stamp
        time_s, values = stamps_s, recorded
        if not there.all():
            time_s, values = stamps_s[there], {name: one[there] for name, one in recorded.items()}
        first, last = np.searchsorted(time_s, span_s, side="right").tolist()
        rows = slice(first, min(last + 1, len(time_s)))  # the next one, too: until then the last one holds
        if rows.start < rows.stop:
            chosen = {name: one[rows] for name, one in values.items() if name in names}
            since_s = span_s[0] + LONGEST_S
            yield held(np.maximum.accumulate(time_s[rows]), chosen, width_s, LONGEST_S, since_s)
