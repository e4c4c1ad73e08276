"""What really happened, sample by sample: the measure of how well a figure was measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COLUMNS = ("sequence", "time_us", "stroke_mm", "force_kN", "temperature_C", "work_J", "heat_J")
"""Columns of the truth: absolute sequence, device time [µs] without wrapping, and the true state."""


class Truth:
    """A growing log of the true state."""

    def __init__(self) -> None:
        self._slices: list[NDArray[np.float64]] = []

    def add(self, table: NDArray[np.float64]) -> None:
        """Add a slice of samples, shape (columns, n) in the order of ``COLUMNS``."""
        self._slices.append(table)

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the whole log, shape (n,) each; counters too are float64, which holds them exactly."""
        if len(self._slices) > 1:
            self._slices = [np.concatenate(self._slices, axis=1)]
        table = self._slices[0] if self._slices else np.zeros((len(COLUMNS), 0))
        return dict(zip(COLUMNS, table, strict=True))

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
        formats = ["%d", "%d", "%.6f", "%.6f", "%.4f", "%.6f", "%.6f"]
        np.savetxt(path, table, fmt=formats, delimiter=",", header=",".join(COLUMNS), comments="")


def read_truth(path: Path) -> dict[str, NDArray[np.float64]]:
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
