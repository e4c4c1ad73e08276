"""Where the force stands between two curves, by several laws: 0 on the unloading curve, 1 on the loading one.

All are rate-free: they see turns and strokes, no time. Ours is eq. (4) (``docs/model.md``).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.families.data import FamilyData
from bufferstand.model.simulation import band_history
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]

_FINEST = 0.25
"""Steps of the Bouc-Wen equation are no longer than this share of its length."""
_MOST_STEPS = 400
_CLOSE_MM = 1e-9
_NO_WAY = 1e-12


def berg(data: FamilyData, length_mm: float) -> Floats:
    """Return Berg's friction (1997): the way to the limit falls off hyperbolically from each turn.

    With z in -1 … 1: z = z_s + (1 - z_s) d / (x_2 (1 - z_s) + d) on loading, d the way since the
    turn: half of the way from zero to the limit is done after x_2.
    """
    z = np.empty_like(data.x_mm)
    z[0] = -1.0
    for first, last, way in data.half_strokes:
        begun = z[first]
        part = slice(first + 1, last + 1)
        d = np.abs(data.x_mm[part] - data.x_mm[first])
        room = 1.0 - begun * way if way else 1.0
        z[part] = begun + way * room * d / np.maximum(length_mm * room + d, _CLOSE_MM)
    return 0.5 * (1.0 + z)


def bouc_wen(data: FamilyData, length_mm: float, sharpness: float, asymmetry: float) -> Floats:
    """Return the Bouc-Wen variable, scaled to -1 … 1 and then to a band position.

    dz/dx = (1 - |z|^n (beta sgn(z dx) + gamma)) / x_0 with beta + gamma = 1; integrated by the midpoint rule.
    """
    z, found, x = -1.0, [-1.0], data.x_mm.tolist()
    with_way, against = 1.0, 2.0 * asymmetry - 1.0  # beta + gamma, gamma - beta
    for begin, end in pairwise(x):
        way = end - begin
        if way:
            steps = min(int(abs(way) / (_FINEST * length_mm)) + 1, _MOST_STEPS)
            dx = way / (steps * length_mm)
            for _ in range(steps):
                half = z + 0.5 * dx * (1.0 - abs(z) ** sharpness * (with_way if z * way > 0.0 else against))
                z += dx * (1.0 - abs(half) ** sharpness * (with_way if half * way > 0.0 else against))
                z = min(max(z, -1.0), 1.0)
        found.append(z)
    return 0.5 * (1.0 + np.array(found))


def eq_4(data: FamilyData, tables: BandTables) -> Floats:
    """Return the band position of eq. (4): the exact step, whose only memory is the present force."""
    return band_history(tables, data.x_mm)


def eq_4_with_return_points(data: FamilyData, tables: BandTables) -> Floats:
    """Return eq. (4) with a memory of its turns: an inner loop closes where it began, and is then forgotten.

    On a way back to the turn (x_r, p_r) from (x_0, p_0), p = p_0 + (p_r - p_0) g(x) / g(x_r) with g = 1 -
    exp(-(A - A_0)) on loading, and likewise with B on unloading; beyond it the older turn counts. Without a
    turn ahead it is eq. (4).
    """
    cells = tables.cells_of(data.x_mm)
    integrals = {1: tables.at(tables.A, cells), -1: tables.at(tables.B, cells)}
    p = np.zeros_like(data.x_mm)
    turns: list[_Turn] = []
    for first, last, way in data.half_strokes:
        nodes = np.arange(first + 1, last + 1)
        if not way:
            p[nodes] = p[first]
            continue
        along = integrals[way]
        here = _Turn(-way, float(data.x_mm[first]), float(integrals[-way][first]), float(p[first]))
        turns.append(here)
        x0, p0, place = here.x_mm, here.p, float(along[first])
        while nodes.size:
            number = _ahead(turns, way, x0)
            goal, whole, inside = 0.5 * (1.0 + way), 1.0, nodes
            if number is not None:
                turn = turns[number]
                goal, whole = turn.p, float(-np.expm1(-abs(turn.integral - place)))
                inside = nodes[(data.x_mm[nodes] - turn.x_mm) * way < 0.0]
            p[inside] = p0 - (goal - p0) * np.expm1(-np.abs(along[inside] - place)) / max(whole, _NO_WAY)
            nodes = nodes[inside.size :]
            if number is not None and nodes.size:  # closed: on as if the inner loop had never been
                x0, p0, place = turn.x_mm, turn.p, turn.integral
                del turns[number:]
    return p


@dataclass(frozen=True)
class _Turn:
    """A turn that is remembered: which way it lies ahead, where, its A (loading) or B, and p there."""

    way: int
    x_mm: float
    integral: float
    p: float


def _ahead(turns: list[_Turn], way: int, x_mm: float) -> int | None:
    """Return the place of the last turn that lies ahead."""
    for number in range(len(turns) - 1, -1, -1):
        if turns[number].way == way and (turns[number].x_mm - x_mm) * way > 0.0:
            return number
    return None
