"""The controller's sample ring: the newest samples by absolute sequence number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

COLUMNS: Mapping[str, str] = {
    "tick": "u4",
    "force": "i4",
    "stroke_1": "u2",
    "stroke_2": "u2",
    "position": "i2",
    "command": "i2",
}
"""What a sample holds, and its type (profile ``ring``)."""

_HALF = 1 << 31
_WHOLE = 1 << 32


class SampleRing:
    """Keeps the last ``capacity`` samples.

    Parameters
    ----------
    capacity : int
        Samples that it holds.
    """

    def __init__(self, capacity: int = 65536) -> None:
        self._capacity = capacity
        self._columns: dict[str, NDArray[Any]] = {
            name: np.zeros(capacity, dtype=kind) for name, kind in COLUMNS.items()
        }
        self.total = 0
        self.overruns = 0

    @property
    def oldest(self) -> int:
        """Absolute sequence number of the oldest sample still held."""
        return max(0, self.total - self._capacity)

    def append(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Store samples, shape (n,) each with n at most the capacity; their values fit the columns' types."""
        count = len(columns["tick"])
        start = self.total % self._capacity
        first = min(count, self._capacity - start)
        for name, store in self._columns.items():
            values = columns[name]
            store[start : start + first] = values[:first]
            if first < count:
                store[: count - first] = values[first:]
        self.total += count

    def absolute(self, acknowledged: int) -> int:
        """Return the sequence number meant by 32 bits on the wire: the one closest to the newest sample."""
        distance = (acknowledged - self.total + _HALF) % _WHOLE - _HALF
        return self.total + distance

    def window(self, wanted: int, most: int) -> tuple[int, dict[str, NDArray[Any]]]:
        """Return samples from ``wanted`` on.

        Parameters
        ----------
        wanted : int
            Absolute sequence number of the first sample wanted. One that has been overwritten is counted in
            ``overruns`` and answered with the oldest still held; one still to come with an empty window.
        most : int
            Largest number of samples.

        Returns
        -------
        first : int
            Absolute sequence number of the first sample returned, or of the next to come.
        columns : dict of str to NDArray
            Copies, shape (n,) each.
        """
        if wanted < self.oldest:
            self.overruns += 1
        first = min(max(wanted, self.oldest), self.total)
        count = min(most, self.total - first)
        start = first % self._capacity
        if start + count <= self._capacity:
            picked = {name: store[start : start + count].copy() for name, store in self._columns.items()}
        else:
            index = (start + np.arange(count)) % self._capacity
            picked = {name: store[index] for name, store in self._columns.items()}
        return first, picked
