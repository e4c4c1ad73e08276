"""What is chosen at the export: units, sign, temperatures to begin with."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bufferstand.foundation import BadInput
from bufferstand.model.export.choices import Positive, Units
from bufferstand.model.spring import SpringModel


@dataclass(frozen=True)
class FmuOptions:
    """Choices for an FMU; all but the units can still be changed as parameters of the FMU.

    Parameters
    ----------
    units : str
        ``SI`` (m, m/s, N) or ``mm-kN`` (mm, mm/s, kN) of stroke, rate and force.
    positive : str
        What positive stroke and force are: ``loading`` as in the model file, ``compression``, or
        ``tension`` as many multibody tools count.
    temperature_C, ambient_C : float, optional
        Of the spring at the start and of the surroundings; T_ref of the model if not given.

    Raises
    ------
    BadInput
        If a temperature is no number or below absolute zero.
    """

    units: Units = "SI"
    positive: Positive = "loading"
    temperature_C: float | None = None
    ambient_C: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("temperature_C", self.temperature_C), ("ambient_C", self.ambient_C)):
            if value is not None and not (math.isfinite(value) and value >= -273.15):
                raise BadInput(f"must be a temperature of -273.15 °C or more, got {value:g}", place=name)

    @property
    def mm_per_stroke(self) -> float:
        """Get the stroke's unit [mm]."""
        return 1000.0 if self.units == "SI" else 1.0

    @property
    def force_per_kN(self) -> float:  # noqa: N802 - the unit's own letters
        """Get how many of the force's unit one kN is."""
        return 1000.0 if self.units == "SI" else 1.0

    def inverted(self, model: SpringModel) -> bool:
        """Return whether stroke and force are negative where the model's are positive."""
        own = "compression" if model.sense == "compression" else "tension"
        return self.positive not in ("loading", own)
