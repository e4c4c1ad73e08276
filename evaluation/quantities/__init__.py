"""Quantities of a cycle: their catalogue, and how they are computed from its loop."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.quantities.evaluate import (
        evaluate_cycle,
        evaluate_cycles,
        is_two_sided,
    )
    from bufferstand.evaluation.quantities.loop_readings import (
        SPEED_WINDOW,
        TANGENT_WINDOW,
        absorbed_energy_J,
        first_harmonic,
        stored_energy_J,
    )

__all__ = [
    "SPEED_WINDOW",
    "TANGENT_WINDOW",
    "absorbed_energy_J",
    "evaluate_cycle",
    "evaluate_cycles",
    "first_harmonic",
    "is_two_sided",
    "stored_energy_J",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
