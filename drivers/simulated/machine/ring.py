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
"""What a sample of the shipped profiles holds, and its type."""

_HALF = 1 << 31
_WHOLE = 1 << 32


class SampleRing:
    """Keeps the last ``capacity`` samples.

    Parameters
    ----------
    capacity : int
        Samples that it holds.
    columns : mapping of str to str
        What each sample holds, and its array type.
    """

    def __init__(self, capacity: int = 65536, columns: Mapping[str, str] = COLUMNS) -> None:
        self._capacity = capacity
        self.columns = dict(columns)
        """What a sample holds, and its array type."""
        self._table = np.zeros((capacity, len(self.columns)), dtype=np.int64)
        self.total = 0
        self.missed = 0
        """Periods of its clock in which the controller took no sample."""
        self.overruns = 0
        self.acknowledged = 0
        self.acknowledgements = 0
        self.polling = False
        """Whether a poll has begun that wants further converters of this instant."""
        self._forgotten = 0

    @property
    def capacity(self) -> int:
        """Samples that it holds."""
        return self._capacity

    @property
    def oldest(self) -> int:
        """Absolute sequence number of the oldest sample still held."""
        return max(self._forgotten, self.total - self._capacity)

    @property
    def periods(self) -> int:
        """Periods of the controller's clock that have passed: with a sample, or missed."""
        return self.total + self.missed

    def forget(self, keep: int) -> None:
        """Hold only the newest ``keep`` samples, as if the others had been overwritten."""
        self._forgotten = max(self._forgotten, self.total - keep)

    def append(self, table: NDArray[Any]) -> None:
        """Store samples, shape (n, columns) in the order of ``columns``, whole numbers that fit their types.

        ``n`` is at most the capacity.
        """
        count = table.shape[0]
        start = self.total % self._capacity
        first = min(count, self._capacity - start)
        self._table[start : start + first] = table[:first]
        if first < count:
            self._table[: count - first] = table[first:]
        self.total += count

    def acknowledge(self, acknowledged: int) -> None:
        """Note which sample (32 bits of its sequence number) a reader wants next, of those that there are."""
        self.acknowledged = min(max(self.absolute(acknowledged), self.oldest), self.total)
        self.acknowledgements += 1

    def poll(self, *, whole: bool) -> None:
        """Note that a reader without a window has seen the newest sample.

        Parameters
        ----------
        whole : bool
            All of its channels; else those that are missing are to be of the same instant.
        """
        self.acknowledged, self.polling = self.total, not whole
        self.acknowledgements += 1

    def absolute(self, acknowledged: int) -> int:
        """Return the sequence number meant by 32 bits on the wire: the one closest to the newest sample."""
        distance = (acknowledged - self.total + _HALF) % _WHOLE - _HALF
        return self.total + distance

    def locate(self, wanted: int, most: int) -> tuple[int, int]:
        """Return from where and how many samples a window holds; see :meth:`window`."""
        if wanted < self.oldest:
            self.overruns += 1
        first = min(max(wanted, self.oldest), self.total)
        return first, min(most, self.total - first)

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
        first, count = self.locate(wanted, most)
        start = first % self._capacity
        if start + count <= self._capacity:
            rows = self._table[start : start + count]
        else:
            rows = self._table[(start + np.arange(count)) % self._capacity]
        return first, {
            name: rows[:, column].astype(kind) for column, (name, kind) in enumerate(self.columns.items())
        }
