"""The complete cycles of a run prepared for the Monte Carlo, each at its first use."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property

from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.loops import InertiaForce, cut_loops, noise_of
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.hum_and_drift import OwnErrors, own_errors
from bufferstand.evaluation.uncertainty.monte_carlo import CyclePropagation
from bufferstand.evaluation.uncertainty.noise import Noise, record_noise


class Propagations(Mapping[int, CyclePropagation]):
    """Propagations of the complete cycles, by number; of ten thousand cycles only a few are ever needed.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Of that record.
    inertia : InertiaForce, optional
        What the correction for a moving mass added to the record.
    like : Propagations, optional
        Of the same run as it was recorded: its noise, hum and drift count.
    """

    def __init__(
        self,
        record: Record,
        cycles: Sequence[Cycle],
        inertia: InertiaForce | None = None,
        like: Propagations | None = None,
    ) -> None:
        self._record = record
        self._cycles = {cycle.index: cycle for cycle in cycles if cycle.complete}
        self._inertia = inertia
        self._other = like
        self._prepared: dict[int, CyclePropagation] = {}

    @cached_property
    def noise(self) -> Noise:
        """Noise of the record."""
        if self._other is not None:
            return self._other.noise
        return record_noise(self._record, self._inertia, list(self._cycles.values()))

    @cached_property
    def own(self) -> OwnErrors:
        """Errors of the force that are the run's own."""
        if self._other is not None:
            return self._other.own
        return own_errors(self.noise.force_lines, self._record.drift_kN, self._record.time_s)

    @cached_property
    def _cut_by(self) -> tuple[float, float]:
        return noise_of(self._record)

    def prepare(self, indices: Iterable[int]) -> None:
        """Prepare the complete ones of some cycles together: loops cut one by one take ten times as long.

        Parameters
        ----------
        indices : iterable of int
            Numbers of cycles.
        """
        cycles = [self._cycles[i] for i in indices if i in self._cycles and i not in self._prepared]
        for stack in cut_loops(self._record, cycles, self._cut_by, alone=True):
            for row, cycle in enumerate(stack.cycles):
                loop = stack.loop(row)
                own = (self._record, cycle, self.noise, self._inertia, self.own, loop)
                self._prepared[cycle.index] = CyclePropagation(*own)

    def __getitem__(self, index: int) -> CyclePropagation:
        if index not in self._prepared:
            if index not in self._cycles:
                raise KeyError(index)
            self.prepare([index])
        return self._prepared[index]

    def __contains__(self, index: object) -> bool:
        return index in self._cycles

    def __iter__(self) -> Iterator[int]:
        return iter(self._cycles)

    def __len__(self) -> int:
        return len(self._cycles)
