"""The energy that a spring holds, from its state alone: what an energy ledger of a train or a stand sums."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.model.spring import SpringModel
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]


def stored_energy(
    model: SpringModel, stroke_mm: ArrayLike, band: ArrayLike, lag_mm: ArrayLike, temperature_C: ArrayLike
) -> Floats:
    """Return the energy [J] that springs of one kind hold, shape (n,).

    It is the integral of F* over the stroke, the free energy of the hysteresis, and what the viscous branches
    and the stop hold. At constant temperature, work - heat is its difference; while a spring warms up it
    loses this energy without a heat (eq. (5) softens the spring and asks for no work).

    Parameters
    ----------
    model : SpringModel
        The kind of spring.
    stroke_mm, band, temperature_C : array_like
        State of each spring, shape (n,) or one figure.
    lag_mm : array_like
        Lags of the viscous branches, shape (branches, n).
    """
    tables = model.tables
    stroke, p, T = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(v, dtype=np.float64)) for v in (stroke_mm, band, temperature_C))
    )
    x = np.clip(stroke, 0.0, tables.end_mm)
    soft, e = model.temperature.softening(T), model.width_scale(T)
    here = tables.cells_of(x)
    held = (1.0 - tables.centre) * tables.width
    s = 1.0 - soft * tables.at(tables.depth, here)
    off_centre = p - tables.at(tables.centre, here)
    energy = _integral(tables, tables.loading, soft, x) - e * _integral(tables, held, soft, x)
    energy += 0.5 * e * s * tables.at(tables.free_energy, here) * off_centre**2
    pressing = s * (tables.at(tables.loading, here) - (1.0 - p) * e * tables.at(tables.width, here))
    lags = np.asarray(lag_mm, dtype=np.float64).reshape(len(model.viscous.branches), len(x))
    for (beta, _), lag in zip(model.viscous.branches, lags, strict=True):
        xi = np.clip(x - lag, 0.0, tables.end_mm)
        inner = tables.cells_of(xi)
        force = (1.0 - soft * tables.at(tables.depth, inner)) * tables.at(tables.middle, inner)
        between = _integral(tables, tables.middle, soft, x) - _integral(tables, tables.middle, soft, xi)
        energy += beta * (between - force * (x - xi))
        pressing += beta * (s * tables.at(tables.middle, here) - force)
    beyond = np.maximum(stroke - tables.end_mm, 0.0)  # where the spring presses on beside the stop
    return energy + beyond * (pressing + 0.5 * model.curves.stop_stiffness_kN_per_mm * beyond)


def _integral(tables: BandTables, force_kN: Floats, soft: Floats, x: Floats) -> Floats:
    """Return the integral [J] of (1 - soft depth) force from 0 to x, both straight within cells."""
    cells = tables.cells_of(x)
    parts = []
    for values in (force_kN, force_kN * tables.depth):
        whole = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * tables.step_mm)])
        parts.append(whole[cells[0]] + 0.5 * (values[cells[0]] + tables.at(values, cells)) * cells[1])
    return np.asarray(parts[0] - soft * parts[1], dtype=np.float64)
