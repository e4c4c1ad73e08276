"""The mass that moves between load cell and specimen, and what was corrected for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bufferstand.evaluation.facts.choices import ForceCell

MassSource = Literal["none", "stand", "option"]


MASS_ACCURACY_PERCENT = 5.0
"""Limit of the error of a moving mass, in per cent of it, where neither stand file nor option states one."""


@dataclass(frozen=True)
class MovingMass:
    """Mass between load cell and specimen [kg], limit of its error [%], place of the cell; None: unsaid."""

    kg: float | None = None
    accuracy_percent: float | None = None
    force_cell: ForceCell | None = None

    def over(self, other: MovingMass) -> MovingMass:
        """Return this one, and what it leaves unsaid as the other says it."""
        return MovingMass(
            other.kg if self.kg is None else self.kg,
            other.accuracy_percent if self.accuracy_percent is None else self.accuracy_percent,
            self.force_cell or other.force_cell,
        )


@dataclass(frozen=True)
class InertiaCorrection:
    """What was done about inertia: mass [kg], where it was stated, and the largest force added [kN].

    ``accuracy_percent`` is the limit of the error of the mass, ``force_cell`` the place of the cell.
    """

    moving_mass_kg: float = 0.0
    source: MassSource = "none"
    largest_force_kN: float = 0.0
    accuracy_percent: float = MASS_ACCURACY_PERCENT
    force_cell: ForceCell = "moving-side"
