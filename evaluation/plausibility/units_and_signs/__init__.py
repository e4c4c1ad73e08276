"""Wrong units, scales and signs of force and stroke."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.units_and_signs.signs import (
        force_falls,
        turned_signs,
    )
    from bufferstand.evaluation.plausibility.units_and_signs.units import (
        BUFFER_MM,
        STIFFEST,
        WINDOWS,
        implausible_units,
    )

__all__ = [
    "BUFFER_MM",
    "STIFFEST",
    "WINDOWS",
    "force_falls",
    "implausible_units",
    "turned_signs",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
