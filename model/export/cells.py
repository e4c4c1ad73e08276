"""The model's fine tables as every export of the exact step needs them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.tables import BandTables

Floats = NDArray[np.float64]


def columns(tables: BandTables) -> Floats:
    """Return the eight tables in the order of the C core's ``bs_cell``, shape (8, n + 1)."""
    return np.array(
        [
            tables.A,
            tables.B,
            tables.loading,
            tables.width,
            tables.middle,
            tables.centre,
            tables.free_energy,
            tables.depth,
        ]
    )


def cells(tables: BandTables) -> Floats:
    """Return value and slope of the eight tables for every cell, shape (n + 1, 16): a ``bs_cell`` a row.

    The last stroke falls into a cell of its own, with the slope of the one before.
    """
    values = columns(tables)
    slopes = np.diff(values, axis=1) / tables.step_mm
    slopes = np.concatenate([slopes, slopes[:, -1:]], axis=1)
    return np.stack([values, slopes], axis=1).reshape(2 * len(values), -1).T
