"""What the text of the paper states with numbers, once: to set simulated and measured values beside it.

Source: Stiffness characteristics of railway buffers: Requirements, testing and proposal of a new
computational model, § 3.2. Nothing is read off its pictures; of the dynamic stiffness (Fig. 8b) it prints no
number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Literal

Specimen = Literal["buffer", "draw-gear"]


@dataclass(frozen=True)
class PublishedValue:
    """A number of the paper's text.

    Parameters
    ----------
    figure : str
        The figure that it belongs to.
    quantity : str
        Name of the quantity in :data:`~bufferstand.evaluation.catalogue.every_quantity.QUANTITIES`.
    printed : str
        The number as printed, in the quantity's unit: its last digit says how far it is rounded.
    specimen, kind : str
        What was tested, and how.
    step : mapping
        The conditions of the run: what was required of a harmonic one (``prestress_mm`` …), what a static one
        reached.
    """

    figure: str
    quantity: str
    printed: str
    specimen: Specimen
    kind: Literal["static", "harmonic"]
    step: Mapping[str, float] = field(hash=False)
    of_piston: bool = False
    """Whether it is what the specimen made of a stroke that was required of the piston."""

    @property
    def value(self) -> float:
        """The number."""
        return float(self.printed)

    @property
    def rounded_by(self) -> float:
        """By how much it may be rounded: half a unit of its last digit."""
        exponent = Decimal(self.printed).as_tuple().exponent
        assert isinstance(exponent, int)
        return 0.5 * 10.0**exponent


def _harmonic(
    figure: str, quantity: str, printed: str, prestress: float, amplitude: float, frequency: float
) -> PublishedValue:
    step = {"prestress_mm": prestress, "amplitude_mm": amplitude, "frequency_Hz": frequency}
    of_piston = quantity == "prestress_mm"
    return PublishedValue(figure, quantity, printed, "buffer", "harmonic", step, of_piston)


def _draw_hook(quantity: str, printed: str, stroke: float, temperature: float) -> PublishedValue:
    step = {"stroke_max_mm": stroke, "temperature_start_C": temperature}
    return PublishedValue("9", quantity, printed, "draw-gear", "static", step)


PUBLISHED_VALUES = (
    _harmonic("6, 8a", "damping", "0.232", 20.0, 20.0, 0.08),
    _harmonic("6, 8a", "damping", "0.225", 20.0, 20.0, 1.27),
    _harmonic("8a", "damping", "0.386", 40.0, 40.0, 0.04),
    _harmonic("8a", "damping", "0.373", 40.0, 40.0, 0.32),
    _harmonic("7, 8b", "prestress_mm", "48.5", 50.0, 30.0, 0.42),
    _harmonic("7", "frequency_Hz", "0.42", 50.0, 30.0, 0.42),
    _harmonic("7, 8b", "prestress_mm", "48.5", 50.0, 5.0, 2.55),
    _harmonic("7", "frequency_Hz", "2.55", 50.0, 5.0, 2.55),
    _harmonic("12", "prestress_mm", "78", 80.0, 15.0, 0.85),
    _harmonic("12", "frequency_Hz", "0.85", 80.0, 15.0, 0.85),
    _draw_hook("force_max_kN", "593", 42.5, 25.0),
    _draw_hook("force_max_kN", "374", 44.5, 75.0),
    _draw_hook("damping", "0.39", 42.5, 25.0),
    _draw_hook("damping", "0.37", 44.5, 75.0),
)
"""Dampings of the draw hook are printed in per cent."""


def published(quantity: str, kind: str) -> tuple[PublishedValue, ...]:
    """Return what the paper prints of a quantity of the runs of a kind, in its order."""
    return tuple(one for one in PUBLISHED_VALUES if (one.quantity, one.kind) == (quantity, kind))
