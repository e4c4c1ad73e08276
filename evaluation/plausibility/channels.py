"""Force and stroke of a run as they were recorded, before anything is averaged, bridged or left out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from evaluation.plausibility.samples import Samples
from evaluation.record import FloatArray, Record


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of a record, each on its own instants."""

    record: Record

    @cached_property
    def force(self) -> Samples:
        """The force as recorded."""
        return self._own("force", self.record.force_kN)

    @cached_property
    def strokes(self) -> tuple[Samples, ...]:
        """The stroke as recorded; of two draw wires each one, if they are there, else their mean."""
        wires = [name for name in ("stroke_1", "stroke_2") if name in self.record.as_recorded]
        return tuple(self._own(name, self.record.stroke_mm) for name in wires or ("stroke",))

    @cached_property
    def stroke(self) -> Samples:
        """The stroke as it is evaluated: the mean of draw wires where there are two."""
        if len(self.strokes) == 1:
            return self.strokes[0]
        return Samples("stroke", self.record.time_s, self.record.stroke_mm)

    @property
    def all(self) -> tuple[Samples, ...]:
        """Force and strokes."""
        return (self.force, *self.strokes)

    def other(self, channel: Samples) -> Samples:
        """Return what a channel is held against: the stroke of a force, the force of a stroke."""
        return self.stroke if channel.quantity == "force" else self.force

    def _own(self, name: str, otherwise: FloatArray) -> Samples:
        if name in self.record.as_recorded:
            return Samples(name, *self.record.as_recorded[name])
        return Samples(name, self.record.time_s, otherwise)
