"""Bounds for the readings of requirements, like those of cycles: read again from fewer samples."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field

from bufferstand.evaluation.gaps.bounds import SURE, GapBounds, Reduced
from bufferstand.evaluation.gaps.coarse_sampling import halves_bound
from bufferstand.evaluation.uncertainty import CyclePropagation, Propagations

Reading = Callable[[CyclePropagation], float | None]


@dataclass(frozen=True, eq=False)
class BoundedReadings(Container[int]):
    """Cycles of which something is not on record, prepared once more from less of it.

    Attributes
    ----------
    widened : mapping of int to CyclePropagation
        With their holes made larger.
    halves : tuple of mapping
        From every second sample, and from the others.
    share : float
        So much of what these change counts.
    """

    widened: Mapping[int, CyclePropagation] = field(default_factory=dict)
    halves: tuple[Mapping[int, CyclePropagation], ...] = ()
    share: float = 1.0

    @classmethod
    def of(cls, gaps: GapBounds, prepared: Propagations) -> BoundedReadings:
        """Return them for the bounds of a record, with the noise of its own cycles, ``prepared``."""

        def less(again: Reduced) -> Propagations:
            return Propagations(again.record, tuple(again.cycles.values()), like=prepared)

        wider = {} if gaps.widened is None else less(gaps.widened)
        return cls(wider, tuple(less(half) for half in gaps.halves), gaps.share)

    def __contains__(self, index: object) -> bool:
        return index in self.widened or any(index in half for half in self.halves)

    def bound(self, index: int, value: float, read: Reading) -> float | None:
        """Return by how much a reading of a cycle may be wrong; None where less of it leaves nothing to read.

        Parameters
        ----------
        index : int
            Of the cycle.
        value : float
            The reading.
        read : callable
            Takes it from a cycle.
        """
        total = 0.0
        if index in self.widened:
            wider = read(self.widened[index])
            if wider is None:
                return None
            total += SURE * abs(wider - value)
        if self.halves and index in self.halves[0]:
            even, odd = (read(half[index]) for half in self.halves)
            if even is None or odd is None:
                return None
            total += abs(halves_bound(even - value, odd - value, self.share))
        return total
