"""Reduces a record to the resolution that its cycles need: means over blocks, never across a break.

A cycle of 100 000 samples holds no more information than 4000 means: of a sine these take
(π / 4000)² / 6 = 1e-7 of the amplitude, and noise adds up as before. Faults of single samples (gaps, time
stamps, NaN) are found before, on the record as it was taken. The peak of an impact is as short as its record:
a record of a single event stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.cycles import HARMONICS
from bufferstand.evaluation.numerics import FloatArray, Sampling, find_reversals, held_samples
from bufferstand.evaluation.record import Record
from bufferstand.foundation import Kind
from bufferstand.foundation.numbers import median

POINTS_OF_KIND: Mapping[Kind, int | None] = {
    "harmonic": 1000,
    "static": 20_000,
    "impact": None,
    "proof": None,
}
"""A cycle keeps at least so many points: twice what the shortest branch of the run keeps of them. The force
of a static run has corners where the stroke meets the specimen again. None: a single event stays as it is."""
POINTS_OF_A_SINE = 120
"""… and where the stroke of a harmonic run is as good as a sine. Its loop area, its turning points and its
harmonics are corrected for the bend between and within the blocks
(:meth:`bufferstand.evaluation.loops.branches.Branches.areas`,
:func:`bufferstand.evaluation.numerics.shape_fits.smooth_fits`,
:class:`bufferstand.evaluation.cycles.harmonics.Spectra`): of what is left, the largest is 2e-6 of W_a; an
extreme force loses (π / 120)² / 6 = 1e-4 of its amplitude."""
SINE_DISTORTION = 0.05
_MANY_TURNS = 40
"""Of a run of more turns …"""
_RUN_IN = 2
"""… so many half-cycles at both ends are not looked at: a ramp leads to its sines, and away from them."""
_LOOKED_AT = 8
"""So many cycles, spread over the run, are looked at; …"""
_LOOKED_AT_POINTS = 128
"""… at so many even moments of each."""
_FEW_A_BLOCK = 4
_CHUNK_BLOCKS = 8192
"""Blocks that are added up together: they stay in the processor's cache."""
_NEAR_BLOCKS = 4
"""Noise moves a coarse extreme: the extreme block is looked for among so many to both sides."""


def condensed_for(
    record: Record, kind: Kind, sampling: Sampling | None = None
) -> tuple[Record, NDArray[np.intp] | None, tuple[str, ...]]:
    """Return the record at the resolution that a run of this kind needs.

    Parameters
    ----------
    record : Record
    kind : Kind
        Of the run.
    sampling : Sampling, optional
        That of the stroke, if it is known already.

    Returns
    -------
    record : Record
        Every column averaged over the same blocks of equally many samples, time too; a shorter block ends
        each unbroken stretch. ``breaks`` count the blocks, ``defects`` and ``temperatures`` are those of the
        record. The same record where its cycles are short, or where it is written by event: its samples are
        not even.
    reversals : array of int or None
        Its reversals, where they are known then.
    warnings : tuple of str
        That a record which came averaged (:mod:`bufferstand.evaluation.loading.long_runs`) has fewer points
        than it needs.
    """
    points = POINTS_OF_KIND[kind]
    if points is None or record.by_event:
        return record, None, _coarse_event(record)
    turns = None
    if record.time_s.size >= 2 * (POINTS_OF_A_SINE if kind == "harmonic" else points):
        sampling = sampling or record.stroke_sampling
        turns = find_reversals(record.stroke_mm, sampling)
        if kind == "harmonic" and _is_sine(record, sampling, turns):
            points = POINTS_OF_A_SINE
    return *_condensed(record, points, turns), _coarse_cycles(record, points, turns)


def _coarse_event(record: Record) -> tuple[str, ...]:
    if record.averaged == 1:
        return ()
    lasts_s = median(np.diff(record.time_s))
    lower = f"a peak shorter than {10.0 * lasts_s:.2g} s is lower in force_max_kN and speeds than it was"
    return (f"coarse: {_averaged(record)}; {lower}",)


def _coarse_cycles(record: Record, points: int, turns: NDArray[np.intp] | None) -> tuple[str, ...]:
    """Return a warning where a record that came averaged lacks points; the reversals are those it shows."""
    if record.averaged == 1:
        return ()
    if turns is None or turns.size < 3:
        step_s = median(np.diff(record.time_s))
        return (f"coarse: {_averaged(record)}; cycles shorter than {8.0 * step_s:.2g} s are not found",)
    there = 2 * _shortest_branch(turns)
    if there >= points:
        return ()
    lower = (np.pi / there) ** 2 / 6.0
    kept = f"which leaves {there} points a cycle where {points} are wanted"
    suffers = f"extreme forces and speeds of a sine are lower by {lower:.2g} of their amplitude"
    return (f"coarse: {_averaged(record)}, {kept}; {suffers}, and corners of a loop are rounded",)


def _averaged(record: Record) -> str:
    return f"the run is so long that {record.averaged} samples were averaged into one"


def _is_sine(record: Record, sampling: Sampling, turns: NDArray[np.intp]) -> bool:
    """Say whether some cycles are as good as sines. Samples that are held would beat with small blocks."""
    if turns.size < 5 or sampling.held > 1 or held_samples(record.force_kN) > 1:
        return False
    begins = np.arange(1, turns.size - 3)
    if begins.size > _MANY_TURNS:
        begins = begins[_RUN_IN:-_RUN_IN]
    if not begins.size:
        return False
    looked_at = begins[np.unique(np.linspace(0, begins.size - 1, _LOOKED_AT).astype(int))]
    first, last = turns[looked_at], turns[looked_at + 2]
    even = np.arange(_LOOKED_AT_POINTS) / _LOOKED_AT_POINTS
    rows = []
    for a, b in zip(first.tolist(), last.tolist(), strict=True):
        every = max(1, (b - a) // (2 * _LOOKED_AT_POINTS))
        time_s, stroke_mm = record.time_s[a : b + every : every], record.stroke_mm[a : b + every : every]
        start_s, end_s = record.time_s[a], record.time_s[b]
        rows.append(np.interp(start_s + even * (end_s - start_s), time_s, stroke_mm))
    power = np.abs(np.fft.rfft(np.stack(rows), axis=1)) ** 2
    others = np.sum(power[:, 2 : HARMONICS + 1], axis=1)
    return bool(np.all(others <= SINE_DISTORTION**2 * power[:, 1]))


def _condensed(
    record: Record, points: int, turns: NDArray[np.intp] | None
) -> tuple[Record, NDArray[np.intp] | None]:
    size = _block(turns, points)
    if size == 1:
        return record, turns
    edges = np.array([0, *record.breaks, record.time_s.size])
    starts = block_starts(edges, size)

    def column(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else block_means(values, edges, size)

    short = replace(
        record,
        time_s=block_means(record.time_s, edges, size),
        stroke_mm=block_means(record.stroke_mm, edges, size),
        force_kN=block_means(record.force_kN, edges, size),
        speed_mm_per_s=column(record.speed_mm_per_s),
        wire_difference_mm=column(record.wire_difference_mm),
        breaks=tuple(int(i) for i in np.searchsorted(starts, record.breaks)),
        averaged=size * record.averaged,
    )
    return short, None if turns is None else _reversals_of(short.stroke_mm, turns, starts)


def _reversals_of(
    stroke_mm: FloatArray, turns: NDArray[np.intp], starts: NDArray[np.intp]
) -> NDArray[np.intp] | None:
    """Return the extremes of the blocks about reversals of the samples; None where blocks are too few."""
    block = np.searchsorted(starts, turns, side="right") - 1
    if np.min(np.diff(block)) <= 2 * _NEAR_BLOCKS:
        return None
    near = np.clip(block[:, None] + np.arange(-_NEAR_BLOCKS, _NEAR_BLOCKS + 1), 0, starts.size - 1)
    rises = np.append(np.diff(stroke_mm[block]) > 0.0, False)
    rises[-1] = not rises[-2]
    value = np.where(rises, -1.0, 1.0)[:, None] * stroke_mm[near]
    found = near[np.arange(block.size), np.argmax(value, axis=1)]
    found[0], found[-1] = block[0], block[-1]
    return np.asarray(found)


def _block(turns: NDArray[np.intp] | None, points: int) -> int:
    if turns is None or turns.size < 3:
        return 1
    return max(1, 2 * _shortest_branch(turns) // points)


def _shortest_branch(turns: NDArray[np.intp]) -> int:
    # The ends of the record cut branches off: they count only where there are no others.
    inner = turns[1:-1] if turns.size >= 5 else turns
    return int(np.min(np.diff(inner)))


def block_starts(edges: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return the first sample of each block of :func:`block_means`."""
    return np.concatenate([np.arange(first, last, size) for first, last in pairwise(edges)])


def block_means(values: FloatArray, edges: NDArray[np.intp], size: int) -> FloatArray:
    """Return means over blocks of ``size`` values between neighbouring edges; the last of each is shorter."""
    means = np.empty(int(np.sum(-(-np.diff(edges) // size))))
    at = 0
    for first, last in pairwise(edges):
        blocks = (last - first) // size
        whole = first + blocks * size
        _row_means(values[first:whole].reshape(-1, size), means[at : at + blocks])
        at += blocks
        if whole < last:
            means[at] = np.mean(values[whole:last])
            at += 1
    return means


def _row_means(blocks: FloatArray, means: FloatArray) -> None:
    """Write the mean of each row."""
    size = blocks.shape[1]
    if size > _FEW_A_BLOCK:
        np.divide(np.einsum("ij->i", blocks), size, out=means)
        return
    # Of a few samples, adding columns is faster than adding along each of a million rows.
    for start in range(0, means.size, _CHUNK_BLOCKS):
        part, own = blocks[start : start + _CHUNK_BLOCKS].T, means[start : start + _CHUNK_BLOCKS]
        own[:] = part[0]
        for column in part[1:]:
            own += column
        own /= size
