"""Cycles of a run, found in its stroke: turning points, dwells and harmonics."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.cycles.dwells import (
        EASED_S,
    )
    from bufferstand.evaluation.cycles.find import (
        SLIPPED,
        STEADY_FREQUENCY,
        STEADY_STROKE,
        cycle_samples,
        find_cycles,
        find_with_harmonics,
        is_lead,
    )
    from bufferstand.evaluation.cycles.harmonics import (
        HARMONICS,
        spectra,
    )
    from bufferstand.evaluation.cycles.record_ends import (
        CONSISTENT,
    )
    from bufferstand.evaluation.cycles.turn_sharpness import (
        LONGEST_S,
    )

__all__ = [
    "CONSISTENT",
    "EASED_S",
    "HARMONICS",
    "LONGEST_S",
    "SLIPPED",
    "STEADY_FREQUENCY",
    "STEADY_STROKE",
    "cycle_samples",
    "find_cycles",
    "find_with_harmonics",
    "is_lead",
    "spectra",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
