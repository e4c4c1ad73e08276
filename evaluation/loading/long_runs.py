"""Runs that are too long for the memory: read in pieces and averaged over blocks.

What is wrong with single samples is found on all of them, by the rules of
:mod:`bufferstand.evaluation.record.defects`. What stays is a record of bounded size: the evaluation of a run
of any length takes the same memory, but for its cycles."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.loading.condense import block_means, block_starts
from bufferstand.evaluation.loading.join import are_of_streams
from bufferstand.evaluation.loading.join_pieces import Pieces, compared
from bufferstand.evaluation.loading.resample import holes, same_instants
from bufferstand.evaluation.loading.table_rows import is_stamped
from bufferstand.evaluation.numerics import FloatArray, moved, moved_evenly
from bufferstand.evaluation.record import (
    USUAL_SHARES,
    Cleaner,
    Ends,
    Record,
    check_usable,
    joined,
    peaks_of,
    usual_limit_s,
    with_own_steps,
)
from bufferstand.foundation import to_inside
from bufferstand.foundation.numbers import median
from bufferstand.recording.runfile import Run, Series, mean_stroke

_MARGIN = 64
"""Samples about a piece that its splines see: what lies further off counts by less than 0.27^64."""
_BIN = 1e-4
"""Steps of time are counted by sizes that differ by this share …"""
_SHORTEST_S, _LONGEST_S = 1e-9, 1e7
"""… between these."""
_NEAR_SAMPLE = 0.6
"""Among samples without a number, what lies this share of a step from one with a number is brought."""
_MORE_BLOCKS = 1024
_MOST_TAKEN = 0.05
"""Share of the stroke's range that averaging may take: of a sine of six points a cycle, it takes so much."""


@dataclass(frozen=True)
class MemoryBounds:
    """How much of a run is held at once."""

    whole_rows: int = 1_000_000
    """A stream of more rows is read in pieces …"""
    piece_rows: int = 131_072
    """… of so many."""
    points: int = 2_000_000
    """A stream of more rows than this is averaged over blocks, so that about so many points are left."""
    readings: int = 100_000
    """Of a temperature, about so many readings are held."""

    def samples_a_block(self, rows: int) -> int:
        """Return how many samples of a stream are averaged."""
        return -(-rows // self.points)


def long_record(run: Run, wires: Sequence[str], bounds: MemoryBounds) -> tuple[Record, tuple[str, ...]]:
    """Return the record of a long run without its temperatures, and what is wrong with it.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        The draw wires that make up the stroke.
    bounds : Bounds

    Raises
    ------
    BadInput
        If force and stroke of a recorded run are not of one stream or nowhere on record together, a dataset
        is damaged, or fewer than two samples are usable.
    """
    stream = run.stream_of(wires[0])
    size = bounds.samples_a_block(stream.rows)
    cleaner = Cleaner(_longest_usual_step_s(run, stream.name, bounds.piece_rows))
    apart = Pieces(run, wires, bounds.piece_rows) if are_of_streams(run, wires) else None
    further = (len(wires) > 1) + (len(wires) if len(wires) > 2 else 0)
    columns = 3 + further + run.has("speed") + 2 * (apart is not None)
    blocks = _Blocks(size, columns, stream.rows)
    first = 0
    ends: dict[str, Ends] = {}
    known = [] if is_stamped(run.metadata, stream.name) else run.gaps(stream.name)
    gaps = np.array(known, dtype=np.int64).reshape(-1, 2)
    pieces = apart.columns() if apart else _pieces(run, wires, gaps[:, 0] + 1, bounds.piece_rows)
    for piece in pieces:
        last = first + piece.shape[1]
        own = gaps[(gaps[:, 0] + 1 >= first) & (gaps[:, 0] + 1 < last)]
        lost = [(row + 1 - first, samples) for row, samples in own.tolist()]
        kept, breaks = cleaner.take(piece[0], piece[1], piece[2], lost)
        usable = piece[:, kept]
        blocks.take(usable, breaks)
        _note_ends(ends, usable, breaks.tolist(), wires, speed=run.has("speed"))
        first = last
    problems = apart.problems() if apart else ()
    check_usable(cleaner)
    time_s, stroke_mm, force_kN, *others = blocks.columns()
    between = None
    if apart:
        others, halved = others[:-2], others[-2:]
        between = apart.between(time_s, np.stack(halved))
    record = Record(
        time_s=time_s,
        stroke_mm=stroke_mm,
        force_kN=force_kN,
        speed_mm_per_s=others.pop() if run.has("speed") else None,
        breaks=tuple(blocks.breaks),
        defects=cleaner.defects(),
        wire_difference_mm=others[0] if others else None,
        averaged=size,
        between=between,
        as_recorded=dict(zip(wires, ((time_s, wire) for wire in others[1:]), strict=False)),
    )
    if size == 1 and not cleaner.even:
        record = with_own_steps(record)
    if apart:
        ends |= _own_ends(run, bounds.piece_rows)
    hidden = _hidden_cycles(record, ends["stroke"][1].value - ends["stroke"][0].value)
    return replace(record, ends={} if size == 1 and not apart else ends), (*problems, *hidden)


def _own_ends(run: Run, rows: int) -> dict[str, Ends]:
    """Return the least and greatest force as it was read, which may be more often than the stroke."""
    unit = run.stream_of("force").channels["force"].unit
    ends: Ends | None = None
    for block in run.blocks(["force"], rows):
        series = block["force"]
        ends = joined(ends, peaks_of(series.time_s, to_inside(series.value, "force", unit)))
    return {} if ends is None else {"force": ends}


def _note_ends(
    ends: dict[str, Ends], piece: FloatArray, breaks: Sequence[int], wires: Sequence[str], *, speed: bool
) -> None:
    """Take the least and greatest samples of a piece, shape (columns, N), into those of the run so far."""
    columns = {"stroke": piece[1], "force": piece[2]}
    after = 3
    if len(wires) == 2:
        columns |= {wires[0]: piece[1] + 0.5 * piece[3], wires[1]: piece[1] - 0.5 * piece[3]}
        after = 4
    elif len(wires) > 2:
        after = 4 + len(wires)
        columns |= dict(zip(wires, piece[4:after], strict=True))
    if speed:
        columns["speed"] = piece[after]
    for name, values in columns.items():
        known = joined(ends.get(name), peaks_of(piece[0], values, breaks))
        if known is not None:
            ends[name] = known


def _hidden_cycles(record: Record, range_mm: float) -> tuple[str, ...]:
    """Return a warning where averaging took the motion itself: slow cycles may be found that never were."""
    left_mm = float(np.ptp(record.stroke_mm))
    if range_mm - left_mm <= _MOST_TAKEN * range_mm:
        return ()
    what = f"the run is so long that {record.averaged} samples were averaged into one"
    shown = f"the stroke's range went from {range_mm:.4g} to {left_mm:.4g} mm"
    text = f"too coarse: {what}, and {shown}: its cycles are too short for that, and what was found of them"
    return (f"{text} is wrong; cut the record into several runs",)


class _Blocks:
    """Means over blocks of equally many samples, of pieces of any length; none across a break.

    They have their room from the beginning: small arrays that stay, made between large ones that go, would
    keep the memory of the large ones from being used again.

    Parameters
    ----------
    size : int
        Samples of a block.
    columns, samples : int
        That will come.
    """

    def __init__(self, size: int, columns: int, samples: int) -> None:
        self._size = size
        self._rest = np.zeros((columns, 0))  # samples that do not fill a block yet
        self._means = np.empty((columns, -(-samples // size) + _MORE_BLOCKS))
        self._made = 0
        self.breaks: list[int] = []
        """Blocks before which a break lies."""

    def take(self, samples: FloatArray, breaks: NDArray[np.intp]) -> None:
        """Take the next samples, shape (columns, N), and before which of them a break lies."""
        breaks = breaks + self._rest.shape[1]
        samples = np.concatenate((self._rest, samples), axis=1)
        last = int(breaks[-1]) if breaks.size else 0
        whole = last + (samples.shape[1] - last) // self._size * self._size
        self._add(samples[:, :whole], breaks)
        self._rest = samples[:, whole:].copy()

    def columns(self) -> FloatArray:
        """Return all means, shape (columns, blocks); what does not fill a block makes a shorter one."""
        self._add(self._rest, np.zeros(0, dtype=np.intp))
        return self._means[:, : self._made]

    def _add(self, samples: FloatArray, breaks: NDArray[np.intp]) -> None:
        edges = np.array([0, *(at for at in breaks.tolist() if at > 0), samples.shape[1]])
        starts = block_starts(edges, self._size)
        self.breaks += (np.searchsorted(starts, breaks) + self._made).tolist()
        if not samples.shape[1]:
            return
        made = self._made + starts.size
        if made > self._means.shape[1]:  # each break ends a block early
            more = np.empty((samples.shape[0], made + self._means.shape[1] // 2))
            self._means = np.concatenate((self._means[:, : self._made], more), axis=1)
        for column, means in zip(samples, self._means, strict=True):
            means[self._made : made] = block_means(column, edges, self._size)
        self._made = made


def _pieces(run: Run, wires: Sequence[str], edges: NDArray[np.int64], rows: int) -> Iterator[FloatArray]:
    """Return time, stroke, force and, where there are, wire difference and speed; shape (columns, rows).

    Of more than two wires each one follows on their difference.
    """
    first = 0
    speed = ["speed"] if run.has("speed") else []
    names = [*wires, "force", *speed]
    quantities = [*("stroke" for _ in wires), "force", *speed]
    units = [run.stream_of(name).channels[name].unit for name in names]
    for window, before, size in _windows(_stacked(run, wires, names, rows)):
        inner = slice(before, before + size)
        own = edges[(edges > first - before) & (edges < first - before + window.shape[1])] - (first - before)
        within = [0, *own.tolist(), window.shape[1]]
        time_s, stroke, *columns = window
        values = [
            to_inside(on_time(at, value, time_s, within)[inner], quantity, unit)
            for at, value, quantity, unit in zip(columns[::2], columns[1::2], quantities, units, strict=True)
        ]
        force = values[len(wires)]
        difference = compared(values[: len(wires)])
        mean = to_inside(stroke[inner], "stroke", units[0])
        yield np.stack([time_s[inner], mean, force, *difference, *values[len(wires) + 1 :]])
        first += size


def _stacked(run: Run, wires: Sequence[str], names: Sequence[str], rows: int) -> Iterator[FloatArray]:
    """Return blocks of time and value of the mean stroke and of each channel, shape (2 + 2 C, rows)."""
    for block in run.blocks(names, rows):
        series = [mean_stroke([block[name] for name in wires]), *(block[name] for name in names)]
        yield np.stack([column for each in series for column in (each.time_s, each.value)])


def _windows(blocks: Iterator[FloatArray]) -> Iterator[tuple[FloatArray, int, int]]:
    """Return blocks with margins of their neighbours; how many samples lie before the block, and its own."""
    tail: FloatArray | None = None
    block = next(blocks, None)
    while block is not None:
        following = next(blocks, None)
        parts = [part for part in (tail, block) if part is not None]
        before = 0 if tail is None else tail.shape[1]
        if following is not None:
            parts.append(following[:, :_MARGIN])
        yield np.concatenate(parts, axis=1), before, block.shape[1]
        tail, block = block[:, -_MARGIN:], following


def on_time(at_s: FloatArray, value: FloatArray, wanted_s: FloatArray, edges: Sequence[int]) -> FloatArray:
    """Return the values of a channel at the instants of the stroke.

    Channels of one stream are sampled together, but their delays differ, and with them the times at which
    their values were true: a cubic spline over each uninterrupted stretch brings them together. It reaches
    at most two samples beyond its stretch. A sample whose stamp does not advance tells it nothing. What lies
    in a hole of the channel, or among samples without a number, is not on record: NaN.

    Parameters
    ----------
    at_s, value : arrays, shape (N,)
    wanted_s : array, shape (N,)
    edges : sequence of int
        Ends of the stretches, 0 and N included.
    """
    if same_instants(at_s, wanted_s):
        return value
    brought = np.full(wanted_s.size, np.nan)
    set_back = np.flatnonzero(np.diff(at_s) < 0.0) + 1  # what is behind is a stretch of its own
    if set_back.size:
        edges = np.union1d(edges, set_back).tolist()
    for first, last in pairwise(edges):
        at, known, wanted = at_s[first:last], value[first:last], wanted_s[first:last]
        even = moved_evenly(at, known, wanted)
        if even is not None:
            brought[first:last] = even
            continue
        good = np.flatnonzero(_advancing(at) & np.isfinite(known))
        if good.size < 4:
            continue
        lost = np.cumsum(np.isfinite(at) & ~np.isfinite(known))[good]
        at, known = at[good], known[good]
        blank, long = np.flatnonzero(np.diff(lost)), holes(at) - 1
        steps = np.diff(at)
        reach_s = 2.0 * float(np.min(steps))
        if (
            not (blank.size or long.size)
            and at[0] - reach_s <= np.min(wanted)
            and np.max(wanted) <= at[-1] + reach_s
        ):
            brought[first:last] = moved(at, known, wanted)
            continue
        usual_s = median(steps)
        near = (wanted >= at[0] - 2.0 * usual_s) & (wanted <= at[-1] + 2.0 * usual_s)
        near &= ~_within_holes(at, blank, wanted, _NEAR_SAMPLE * usual_s)
        near &= ~_within_holes(at, long, wanted, 2.0 * usual_s)
        brought[first:last][near] = moved(at, known, wanted[near])
    return brought


def _within_holes(
    at_s: FloatArray, begins: NDArray[np.intp], wanted_s: FloatArray, near_s: float
) -> NDArray[np.bool_]:
    """Say which moments lie in a hole behind one of the samples ``begins``, not near to either end of it."""
    before = np.searchsorted(at_s, wanted_s, side="right") - 1
    inside = np.isin(before, begins)
    before = np.clip(before, 0, at_s.size - 2)
    away_s = np.minimum(wanted_s - at_s[before], at_s[before + 1] - wanted_s)
    return np.asarray(inside & (away_s > near_s))


def _advancing(at_s: FloatArray) -> NDArray[np.bool_]:
    """Say which stamps are later than all before them; NaN is none."""
    stamps = np.where(np.isfinite(at_s), at_s, -np.inf)
    before = np.maximum.accumulate(np.concatenate(([-np.inf], stamps[:-1])))
    return np.asarray(stamps > before)


def _longest_usual_step_s(run: Run, stream: str, rows: int) -> float:
    """Return the largest step that is still usual, of all steps, counted by size to a ten-thousandth."""
    lowest = int(np.log(_SHORTEST_S) / _BIN)
    counts = np.zeros(int(np.log(_LONGEST_S) / _BIN) - lowest + 2, dtype=np.int64)
    latest = np.zeros(0)
    for time_s in run.time_blocks(stream, rows):
        step = np.diff(np.concatenate((latest, time_s[np.isfinite(time_s)])))
        step = np.clip(step[step > 0.0], _SHORTEST_S, _LONGEST_S)
        counts += np.bincount((np.log(step) / _BIN).astype(np.int64) - lowest, minlength=counts.size)
        latest = time_s[-1:]
    total = np.cumsum(counts)
    if total[-1] == 0:
        return float("inf")
    bins = np.searchsorted(total, np.array(USUAL_SHARES) * total[-1])
    median_s, high_s = np.exp((bins + lowest + 0.5) * _BIN)
    return usual_limit_s(float(median_s), float(high_s))


def thinned(
    run: Run, channel: str, bounds: MemoryBounds, ends_of: Callable[[Series], Ends | None]
) -> tuple[Series, Ends | None]:
    """Return a slow channel that was recorded fast: every k-th of its samples, and the ends of all of them.

    Parameters
    ----------
    run : Run
    channel : str
    bounds : Bounds
    ends_of : callable
        Gives the least and the greatest of a stretch of samples.

    Raises
    ------
    BadInput
        If its dataset is damaged.
    """
    stream = run.stream_of(channel)
    stride = -(-stream.rows // bounds.readings)
    times, values, skipped = [], [], 0
    ends: Ends | None = None
    for block in run.blocks([channel], bounds.piece_rows):
        series = block[channel]
        ends = joined(ends, ends_of(series))
        times.append(series.time_s[skipped::stride].copy())
        values.append(series.value[skipped::stride].copy())
        skipped = (skipped - series.value.size) % stride
    return Series(np.concatenate(times), np.concatenate(values), stream.channels[channel].unit), ends
