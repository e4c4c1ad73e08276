"""First guesses: which stroke the curves span, where their knots lie, and what they are roughly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.identification.drive import Drive
from bufferstand.model.identification.parameters import FixedParts, pack
from bufferstand.model.measured_curves import branch_at

Floats = NDArray[np.float64]

_ROUGH_TRANSITION_MM = 8.0
_KNOT_DISTANCE_MM = 5.0
_LEAST_KNOTS, _MOST_KNOTS = 5, 24


def knots_of(drives: Sequence[Drive], count: int | None = None) -> tuple[float, ...]:
    """Return strokes from 0 to the largest measured one, evenly, 5 mm apart unless a number is given.

    Raises
    ------
    BadInput
        If nothing was compressed, or the number is below 3.
    """
    end = max(float(np.max(drive.stroke_mm)) for drive in drives)
    if end < 1.0:
        raise BadInput(f"the largest stroke of these runs is {end:.2g} mm: nothing was compressed")
    if count is None:
        count = min(max(round(end / _KNOT_DISTANCE_MM) + 1, _LEAST_KNOTS), _MOST_KNOTS)
    if count < 3:
        raise BadInput(f"curves need three knots or more, got {count}")
    return tuple(np.linspace(0.0, end, count).tolist())


def start_vector(frame: FixedParts, drives: Sequence[Drive]) -> Floats:
    """Return a vector to begin with: the measured branches away from their turns, and usual laws.

    Raises
    ------
    BadInput
        If no run loads, or none unloads, by more than a transition.
    """
    x, F, rising, way = (np.concatenate(column) for column in zip(*map(_points, drives), strict=True))
    knots = np.array(frame.knots_mm)
    width = 0.75 * float(knots[1] - knots[0])
    far = np.minimum(_ROUGH_TRANSITION_MM, 0.2 * knots[-1])
    inside = x > frame.contact_ramp_mm
    loading = _envelope(knots, x, F, inside & rising & ((way > far) | (x < far)), width, upper=True)
    unloading = _envelope(knots, x, F, inside & ~rising & (way > far), width, upper=False)
    seen = float(np.max(x[inside & ~rising & (way > far)]))
    share = np.clip(unloading / np.maximum(loading, 1e-6), 0.05, 0.98)
    beyond = knots > seen
    if np.any(~beyond):
        share[beyond] = share[~beyond][-1]
    return pack(frame, loading, loading * share, {})


def _points(drive: Drive) -> tuple[Floats, Floats, NDArray[np.bool_], Floats]:
    """Return stroke, force, direction and way since the turn of each measured node."""
    starts = np.flatnonzero(np.diff(drive.half, prepend=-1))
    lengths = np.diff(starts, append=drive.half.size)
    begin = np.repeat(drive.stroke_mm[starts], lengths)
    end = np.repeat(drive.stroke_mm[np.minimum(starts + lengths, drive.half.size - 1)], lengths)
    stroke = drive.stroke_mm[drive.node]
    return stroke, drive.force_kN, (end > begin)[drive.node], np.abs(stroke - begin[drive.node])


def _envelope(
    knots: Floats, x: Floats, F: Floats, wanted: NDArray[np.bool_], width: float, *, upper: bool
) -> Floats:
    """Return the outer quarter of many branches at the knots: inner loops do not reach the curves."""
    if np.count_nonzero(wanted) < 10:
        raise BadInput(
            f"no run {'loads' if upper else 'unloads'} the spring far enough to show its curve",
            remedy="give a run that goes through the stroke slowly (kind = “static”)",
        )
    x, F = x[wanted], F[wanted]
    keep = np.zeros(x.size, dtype=np.bool_)
    edges = np.searchsorted(knots, x)
    for cell in np.unique(edges):
        members = np.flatnonzero(edges == cell)
        slope, offset = np.polyfit(x[members], F[members], 1) if members.size > 2 else (0.0, 0.0)
        rest = F[members] - slope * x[members] - offset
        limit = np.quantile(rest, 0.75 if upper else 0.25)
        keep[members] = rest >= limit if upper else rest <= limit
    return branch_at(knots, x[keep], F[keep], width)
