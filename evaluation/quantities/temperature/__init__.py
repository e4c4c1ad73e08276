"""Temperatures of a cycle, whether the sensors' readings cover it, and why one is missing."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.quantities.temperature.coverage import (
        READING_INTERVAL_S,
        TemperatureGap,
        longest_hole,
        read_at,
        readings_of,
    )
    from bufferstand.evaluation.quantities.temperature.of_cycles import (
        temperatures_of,
    )
    from bufferstand.evaluation.quantities.temperature.why_missing import (
        why_no_temperature,
    )

__all__ = [
    "READING_INTERVAL_S",
    "TemperatureGap",
    "longest_hole",
    "read_at",
    "readings_of",
    "temperatures_of",
    "why_no_temperature",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
