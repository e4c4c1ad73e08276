"""What really happened, sample by sample: the measure of how well a figure was measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COLUMNS = (
    "sequence",
    "time_us",
    "stroke_mm",
    "force_kN",
    "temperature_C",
    "work_J",
    "heat_J",
    "position_mm",
    "command_mm",
)
"""Columns of the truth: absolute sequence, device time [µs] without wrapping, the true state of the specimen,
and of the piston: where it was and where it was told to be."""

FloatArray = NDArray[np.float64]

_MERGE = 1000


class TruthLog:
    """A growing log of the true state."""

    def __init__(self) -> None:
        self._slices: list[FloatArray] = []
        self._merged = 0

    def add(self, table: FloatArray) -> None:
        """Add a slice of samples, shape (n, columns) in the order of ``COLUMNS``."""
        self._slices.append(table)
        if (
            len(self._slices) - self._merged > _MERGE
        ):  # thousands of small arrays take more room than they hold
            self._slices[self._merged :] = [np.concatenate(self._slices[self._merged :])]
            self._merged += 1

    def arrays(self) -> dict[str, FloatArray]:
        """Return the whole log, shape (n,) each; counters too are float64, which holds them exactly."""
        table = np.concatenate(self._slices) if self._slices else np.zeros((0, len(COLUMNS)))
        return {name: np.ascontiguousarray(table[:, column]) for column, name in enumerate(COLUMNS)}

    def write(self, path: Path) -> None:
        """Write the log: ``.npz`` with one array a column, anything else as CSV with a header.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        arrays = self.arrays()
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".npz":
            with path.open("wb") as stream:
                np.savez(stream, allow_pickle=False, **arrays)
            return
        table = np.stack([arrays[name] for name in COLUMNS], axis=1)
        formats = ["%d", "%d", "%.6f", "%.6f", "%.4f", "%.6f", "%.6f", "%.6f", "%.6f"]
        np.savetxt(path, table, fmt=formats, delimiter=",", header=",".join(COLUMNS), comments="")


def read_truth(path: Path) -> dict[str, FloatArray]:
    """Read a truth file back, shape (n,) for each of ``COLUMNS``.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    if path.suffix == ".npz":
        with np.load(path) as file:
            return {name: file[name] for name in COLUMNS}
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return {name: table[:, index] for index, name in enumerate(COLUMNS)}
