"""The rows of an imported table as readings: doubled rows, and time stamps that rows share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.recording.foreign.times import doubled_rows, has_own_instants, shared_stamps, spread_stamps


def is_stamped(metadata: Mapping[str, Any], stream: str) -> bool:
    """Say whether the rows of a stream were imported with stamps of their own, and not counted at a rate.

    What interrupts such a stream is told from its stamps. The samples that an import says are lost are what
    it took for lost by the stamps of the table as a whole.
    """
    original = metadata.get("original") or {}
    return bool(original) and (original.get("time_from") or {}).get(stream) != "sample rate"


@dataclass(frozen=True, eq=False)
class Rows:
    """Which rows of a stream are readings, and by how much each was read later than stamped.

    Attributes
    ----------
    kept : array of bool, shape (N,), or None
        None: all.
    later_s : array, shape (kept,), or None
        None: when they are stamped.
    clock_s : float
        Step of the clock whose stamps several readings share; 0 where each has its own.
    """

    kept: NDArray[np.bool_] | None = None
    later_s: FloatArray | None = None
    clock_s: float = 0.0

    @property
    def are_all(self) -> bool:
        """Whether each row is one reading, taken when it is stamped."""
        return self.kept is None and self.later_s is None

    def time_s(self, stamps_s: FloatArray) -> FloatArray:
        """Return when the readings were taken, shape (kept,)."""
        own = self.of(stamps_s)
        return own if self.later_s is None else own + self.later_s

    def of(self, values: FloatArray) -> FloatArray:
        """Return the readings of a channel, shape (kept,)."""
        return values if self.kept is None else values[self.kept]


def readings_of(stamps_s: FloatArray, columns: Sequence[FloatArray]) -> Rows:
    """Return what the rows of an imported stream are.

    Parameters
    ----------
    stamps_s : array, shape (N,)
    columns : sequence of array, shape (N,)
        Channels of the stream: a row is doubled if all of them repeat with the stamp.
    """
    step = np.diff(stamps_s)
    if not np.any(step == 0.0):
        return Rows()
    doubled = doubled_rows(stamps_s, columns)
    kept = ~doubled if doubled.any() else None
    own_s = stamps_s if kept is None else stamps_s[kept]
    shared = shared_stamps(own_s)
    if shared is None:
        return Rows(kept)
    return Rows(kept, spread_stamps(own_s) - own_s, shared[0])


def without_blanks(time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a channel without the rows of its table in which it was not read.

    Holes in a channel that is read in every row are left in it.
    """
    filled = np.isfinite(value)
    if filled.all() or not has_own_instants(time_s, filled):
        return time_s, value
    return time_s[filled], value[filled]
