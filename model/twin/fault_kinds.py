"""What may have moved when a loop leaves the model: six kinds, each with its trace in force and stroke."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FaultKind:
    """One thing that may have moved.

    Attributes
    ----------
    name : str
        For machines: ``stiffness``, ``loss``, ``force_zero_kN``, ``stroke_zero_mm``, ``stroke_gain``,
        ``delay_s``. A change of it is in the name's unit; of those without, a share of what it was.
    title : str
        For people.
    factor, unit, digits
        How a change is shown: times the factor, in this unit.
    note : str
        What force and stroke alone cannot tell from it.
    plausible : float
        A large change; the prior standard deviation of the joint decomposition.
    """

    name: str
    title: str
    factor: float
    unit: str
    digits: int
    plausible: float
    note: str = ""

    def shown(self, change: float) -> str:
        """Return a change with its unit."""
        return f"{self.factor * change:+.{self.digits}f} {self.unit}"


FAULT_KINDS = (
    FaultKind(
        "stiffness", "stiffness", 100.0, "%", 1, 0.2,
        "or gain of the force channel, which leaves the same trace",
    ),
    FaultKind("loss", "loss", 100.0, "%", 1, 0.5),
    FaultKind("force_zero_kN", "zero of the force", 1.0, "kN", 2, 20.0),
    FaultKind("stroke_zero_mm", "zero of the stroke", 1.0, "mm", 2, 3.0),
    FaultKind("stroke_gain", "gain of the stroke channel", 100.0, "%", 2, 0.05),
    FaultKind("delay_s", "delay between force and stroke", 1000.0, "ms", 1, 0.05),
)  # fmt: skip
"""In the order of the columns of sensitivities. A zero, a gain or a delay is that of the reading: a stroke
that reads 1 mm too much has moved by +1 mm, a force that comes 2 ms late by +2 ms."""
