"""Temperatures of cycles: what the sensors show, and whether their readings cover a cycle."""

from bufferstand.evaluation.thermometry.coverage import (
    READING_INTERVAL_S,
    Hole,
    covers,
    longest_hole,
    read_at,
    readings_of,
)
from bufferstand.evaluation.thermometry.of_cycles import temperatures_of
from bufferstand.evaluation.thermometry.why import why_no_temperature

__all__ = [
    "READING_INTERVAL_S",
    "Hole",
    "covers",
    "longest_hole",
    "read_at",
    "readings_of",
    "temperatures_of",
    "why_no_temperature",
]
