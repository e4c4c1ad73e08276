"""The complete cycles of a run prepared for drawing, each when it is first asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from evaluation.inertia import InertiaForce
from evaluation.motion import Cycle
from evaluation.noise import Noise, record_noise
from evaluation.record import Record
from evaluation.uncertainty import CyclePropagation


class Propagations(Mapping[int, CyclePropagation]):
    """Propagations of the complete cycles, by number; of ten thousand cycles only a few are ever needed.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Of that record.
    inertia : InertiaForce, optional
        What the correction for a moving mass added to the record.
    """

    def __init__(self, record: Record, cycles: Sequence[Cycle], inertia: InertiaForce | None = None) -> None:
        self._record = record
        self._cycles = {cycle.index: cycle for cycle in cycles if cycle.complete}
        self._inertia = inertia
        self._prepared: dict[int, CyclePropagation] = {}

    @cached_property
    def _noise(self) -> Noise:
        return record_noise(self._record, self._inertia, list(self._cycles.values()))

    def __getitem__(self, index: int) -> CyclePropagation:
        if index not in self._prepared:
            cycle = self._cycles[index]
            self._prepared[index] = CyclePropagation(self._record, cycle, self._noise, self._inertia)
        return self._prepared[index]

    def __contains__(self, index: object) -> bool:
        return index in self._cycles

    def __iter__(self) -> Iterator[int]:
        return iter(self._cycles)

    def __len__(self) -> int:
        return len(self._cycles)
