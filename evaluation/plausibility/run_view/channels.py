"""Force and stroke of a run as they were recorded, before anything is averaged, bridged or left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bufferstand.evaluation.numerics import FloatArray, IndexArray
from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.record import Record
from bufferstand.foundation.channels import STROKE_CHANNELS


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of a record, each on its own instants; of those ``held`` each value once, as it comes.

    ``spikes``: rows of channels that are known to be no readings, which they are without.
    """

    record: Record
    held: frozenset[str] = frozenset()
    spikes: Mapping[str, IndexArray] = field(default_factory=dict)

    @cached_property
    def force(self) -> Samples:
        """The force as recorded."""
        return self._own("force", self.record.force_kN)

    @cached_property
    def strokes(self) -> tuple[Samples, ...]:
        """The stroke as recorded; of several draw wires each one, if they are there, else their mean."""
        wires = [name for name in STROKE_CHANNELS if name in self.record.as_recorded]
        return tuple(self._own(name, self.record.stroke_mm) for name in wires or ("stroke",))

    @cached_property
    def stroke(self) -> Samples:
        """The stroke as it is evaluated: the mean of draw wires where there are several."""
        if len(self.strokes) == 1:
            return self.strokes[0]
        mean = Samples("stroke", self.record.time_s, self.record.stroke_mm)
        return _without_repeats(mean) if self.held.issuperset(one.name for one in self.strokes) else mean

    @property
    def all(self) -> tuple[Samples, ...]:
        """Force and strokes."""
        return (self.force, *self.strokes)

    def other(self, channel: Samples) -> Samples:
        """Return what a channel is compared with: the stroke of a force, the force of a stroke."""
        return self.stroke if channel.quantity == "force" else self.force

    def _own(self, name: str, otherwise: FloatArray) -> Samples:
        time_s, value = self.record.as_recorded.get(name, (self.record.time_s, otherwise))
        if name in self.spikes:
            time_s, value = np.delete(time_s, self.spikes[name]), np.delete(value, self.spikes[name])
        samples = Samples(name, time_s, value)
        return _without_repeats(samples) if name in self.held else samples


def _without_repeats(samples: Samples) -> Samples:
    """Return a channel without the samples that repeat the one before, but for its last one."""
    rows = np.append(True, np.diff(samples.value) != 0.0)
    rows[-1] = True
    return Samples(samples.name, samples.time_s[rows], samples.value[rows])
