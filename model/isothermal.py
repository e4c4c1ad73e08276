"""Band position and force of a whole stroke history at one temperature, as fast as numpy goes.

The band position depends on the stroke history only, and within one half stroke it has a closed form. So only
the turning points need a loop; all between them is computed block by block, in blocks that fit a processor's
cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.spring import SpringModel
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]

_BLOCK = 16384


@dataclass(frozen=True)
class _HalfStrokes:
    """The monotone parts of a history; ``1 - p = offset + factor exp(exponent(x) - start)`` within each.

    ``first`` [-] is the sample at which a part begins (it belongs to the part before), ``falling`` 1 where it
    unloads. exponent is -A on loading and B on unloading; offset is 0 or 1, factor 1 - p0 or -p0.
    """

    first: NDArray[np.intp]
    falling: NDArray[np.intp]
    start: Floats
    factor: Floats
    offset: Floats

    @classmethod
    def of(cls, tables: BandTables, x: Floats, initial_band: float) -> _HalfStrokes:
        up, down = x[1:] > x[:-1], x[1:] < x[:-1]
        if np.count_nonzero(up) + np.count_nonzero(down) < len(up):  # a hold is no turn
            moving = np.flatnonzero(up | down)
            turned = moving[1:][down[moving[1:]] != down[moving[:-1]]]
        else:
            turned = np.flatnonzero(down[1:] != down[:-1]) + 1
        first = np.concatenate([[0], turned]).astype(np.intp)
        ends = np.append(first[1:], len(x) - 1)
        falling = (x[ends] < x[first]).astype(np.intp)
        rates = [tables.at(table, tables.cells_of(x[[*first, ends[-1]]])) for table in (tables.A, tables.B)]
        exponents = np.where(falling == 1, rates[1][:-1], -rates[0][:-1])
        reached = np.exp(np.minimum(np.where(falling == 1, rates[1][1:], -rates[0][1:]) - exponents, 0.0))
        begins, p = [], initial_band
        for falls, share in zip(falling.tolist(), reached.tolist(), strict=True):
            begins.append(p)
            p = p * share if falls else 1.0 - (1.0 - p) * share
        p0 = np.array(begins)
        factor = np.where(falling == 1, -p0, 1.0 - p0)
        return cls(first, falling, exponents, factor, falling.astype(np.float64))


def band_position(tables: BandTables, stroke_mm: Floats, initial_band: float) -> Floats:
    """Return p at every stroke, shape (n,); see :func:`bufferstand.model.simulation.band_history`."""
    band = np.empty(len(stroke_mm))
    for part, _, _, rest in _blocks(tables, stroke_mm, initial_band):
        np.subtract(1.0, rest, out=band[part])
    band[0] = initial_band
    return band


def isothermal_force(
    model: SpringModel, stroke_mm: Floats, temperature_C: float, initial_band: float = 0.0
) -> Floats:
    """Return the force [kN] of a stroke history at one temperature, without viscous branches, shape (n,).

    The figures are those of :func:`bufferstand.model.simulation.simulate` with ``isothermal``; nothing else
    is computed.

    Parameters
    ----------
    model : SpringModel
        The spring; its viscous branches, which need time, are left out.
    stroke_mm : NDArray
        Strokes, shape (n,), n >= 1.
    temperature_C : float
        Temperature of the spring.
    initial_band : float
        Band position p at the first stroke.
    """
    tables = model.tables
    soft, scale = float(model.temperature.softening(temperature_C)), float(model.width_scale(temperature_C))
    loading, width, depth = (
        _Table.of(tables.loading),
        _Table.of(tables.width * scale),
        _Table.of(tables.depth),
    )
    force = np.empty(len(stroke_mm))
    work = np.empty(_BLOCK), np.empty(_BLOCK)
    for part, index, inside, rest in _blocks(tables, stroke_mm, initial_band):
        wide, other = work[0][: len(index)], work[1][: len(index)]
        out = loading.at(index, inside, force[part], other)
        held = width.at(index, inside, wide, other)
        held *= rest
        out -= held
        if soft:
            softened = depth.at(index, inside, wide, other)
            softened *= -soft
            softened += 1.0
            out *= softened
        np.maximum(out, 0.0, out=out)
    _edges(model, stroke_mm, force)
    return force


def _edges(model: SpringModel, stroke_mm: Floats, force_kN: Floats) -> None:
    """Put the lost contact and the stop into forces, in place."""
    if float(stroke_mm.min()) <= 0.0:
        force_kN[stroke_mm <= 0.0] = 0.0
    end = model.tables.end_mm
    if float(stroke_mm.max()) > end:
        force_kN += model.curves.stop_stiffness_kN_per_mm * np.maximum(stroke_mm - end, 0.0)


@dataclass(frozen=True)
class _Table:
    """A table with its differences from point to point, for lookups into memory that is there."""

    base: Floats
    rise: Floats

    @classmethod
    def of(cls, values: Floats) -> _Table:
        # The last point falls into a cell of its own, at whose beginning it is met.
        return cls(values, np.append(np.diff(values), 0.0))

    def at(self, index: NDArray[np.intp], inside: Floats, out: Floats, other: Floats) -> Floats:
        """Write base + rise * inside (a share of a cell) to ``out``; ``other`` is overwritten."""
        self.rise.take(index, out=out, mode="clip")
        out *= inside
        self.base.take(index, out=other, mode="clip")
        out += other
        return out


def _blocks(
    tables: BandTables, stroke_mm: Floats, initial_band: float
) -> Iterator[tuple[slice, NDArray[np.intp], Floats, Floats]]:
    """Go through a history: where, cell, share of the cell, 1 - p; the next block reuses their memory."""
    end, per_step = tables.end_mm, 1.0 / tables.step_mm
    inside_tables = float(stroke_mm.min()) >= 0.0 and float(stroke_mm.max()) <= end
    x = stroke_mm if inside_tables else np.clip(stroke_mm, 0.0, end)
    strokes = _HalfStrokes.of(tables, x, initial_band)
    points = len(tables.A)
    exponent = _Table.of(np.concatenate([-tables.A, tables.B]))
    bounds = np.append(strokes.first, len(x))
    index, shifted = np.empty(_BLOCK, np.intp), np.empty(_BLOCK, np.intp)
    place, inside, rest, other = (np.empty(_BLOCK) for _ in range(4))
    for begin in range(0, len(x), _BLOCK):
        part = slice(begin, min(begin + _BLOCK, len(x)))
        n = part.stop - begin
        i, j, at, f, r, o = index[:n], shifted[:n], place[:n], inside[:n], rest[:n], other[:n]
        np.multiply(x[part], per_step, out=at)
        np.floor(at, out=f)
        np.copyto(i, f, casting="unsafe")
        np.subtract(at, f, out=f)
        # Sample `first` of a part still belongs to the part before.
        some = slice(
            max(0, int(np.searchsorted(strokes.first, begin, side="left")) - 1),
            max(1, int(np.searchsorted(strokes.first, part.stop - 1, side="left"))),
        )
        edges = np.clip(bounds[some.start : some.stop + 1] + 1, begin, part.stop)
        edges[0], edges[-1] = begin, part.stop
        counts = np.diff(edges)
        np.add(i, np.repeat(strokes.falling[some] * points, counts), out=j)
        exponent.at(j, f, r, o)
        r -= np.repeat(strokes.start[some], counts)
        np.minimum(r, 0.0, out=r)
        np.exp(r, out=r)
        r *= np.repeat(strokes.factor[some], counts)
        r += np.repeat(strokes.offset[some], counts)
        yield part, i, f, r
