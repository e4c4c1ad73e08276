"""The zero of the force: an offset, and a drift over time."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.zero_and_drift.drift import (
        drift_of_loops,
    )
    from bufferstand.evaluation.plausibility.zero_and_drift.zero import (
        zero_beside_turned_stroke,
        zero_in_wrong_unit,
        zero_of_force,
    )

__all__ = [
    "drift_of_loops",
    "zero_beside_turned_stroke",
    "zero_in_wrong_unit",
    "zero_of_force",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
