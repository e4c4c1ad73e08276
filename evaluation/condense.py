"""A record at the resolution that its cycles need: means over blocks of samples, never across a break.

A cycle of 100 000 samples says nothing that 4000 means do not: of a sine they take (π / 4000)² / 6 = 1e-7 of
the amplitude, and noise adds up as before. What is wrong with single samples (gaps, time stamps, NaN) was
found before, on the record as it was taken. The peak of an impact is as short as its record is: a record of a
single event stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evaluation.record import FloatArray, Record
from evaluation.reversals import find_reversals, noise_sigma
from foundation.specimen import Kind

POINTS_A_CYCLE = 4000
"""A cycle keeps at least so many points: twice what the shortest branch of the run keeps of them."""
POINTS_OF_KIND: Mapping[Kind, int | None] = {
    "harmonic": 1000,
    "static": 20_000,
    "impact": None,
    "proof": None,
}
"""The same by kind of run: a harmonic stroke has no corners, and the force of a static one where it meets the
specimen again has. None: a single event stays as it is."""


def condensed(record: Record, points: int = POINTS_A_CYCLE) -> Record:
    """Return the record as means over blocks of equally many samples, or itself where its cycles are short.

    Parameters
    ----------
    record : Record
    points : int
        That a cycle keeps at least.

    Returns
    -------
    Record
        Every column averaged over the same blocks, time too; a shorter block ends each unbroken stretch.
        ``breaks`` count the blocks, ``defects`` and ``temperatures`` are those of the record.
    """
    return _condensed(record, points)[0]


def condensed_for(record: Record, kind: Kind) -> tuple[Record, NDArray[np.intp] | None]:
    """Return the record as a run of this kind needs it, and its reversals where they are known then."""
    points = POINTS_OF_KIND.get(kind, POINTS_A_CYCLE)
    return (record, None) if points is None else _condensed(record, points)


def _condensed(record: Record, points: int) -> tuple[Record, NDArray[np.intp] | None]:
    size, turns = _block(record, points)
    if size == 1:
        return record, turns
    edges = np.array([0, *record.breaks, record.time_s.size])
    starts = np.concatenate([np.arange(first, last, size) for first, last in pairwise(edges)])

    def column(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else _means(values, edges, size)

    short = replace(
        record,
        time_s=_means(record.time_s, edges, size),
        stroke_mm=_means(record.stroke_mm, edges, size),
        force_kN=_means(record.force_kN, edges, size),
        speed_mm_per_s=column(record.speed_mm_per_s),
        wire_difference_mm=column(record.wire_difference_mm),
        breaks=tuple(int(i) for i in np.searchsorted(starts, record.breaks)),
    )
    return short, None


def samples_a_block(record: Record, points: int = POINTS_A_CYCLE) -> int:
    """Return how many samples may be averaged so that the shortest branch keeps its points; at least 1."""
    return _block(record, points)[0]


def _block(record: Record, points: int) -> tuple[int, NDArray[np.intp] | None]:
    if record.time_s.size < 2 * points:
        return 1, None
    turns = find_reversals(record.stroke_mm, noise_sigma(record.stroke_mm))
    if turns.size < 3:
        return 1, turns
    # The ends of the record cut branches off: they count only where there are no others.
    inner = turns[1:-1] if turns.size >= 5 else turns
    return max(1, 2 * int(np.min(np.diff(inner))) // points), turns


def _means(values: FloatArray, edges: NDArray[np.intp], size: int) -> FloatArray:
    """Return means over blocks of ``size`` values between neighbouring edges; the last of each is shorter."""
    parts = []
    for first, last in pairwise(edges):
        whole = first + (last - first) // size * size
        parts.append(np.einsum("ij->i", values[first:whole].reshape(-1, size)) / size)
        if whole < last:
            parts.append(np.array([np.mean(values[whole:last])]))
    return np.concatenate(parts)
