"""Jumps of force and stroke: within one sample, from one cycle to the next, and in single strokes."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.jumps.channel_jumps import (
        jumps,
        jumps_in_metres,
        jumps_in_newtons,
        jumps_of_turned_stroke,
        slips_s,
    )

__all__ = [
    "jumps",
    "jumps_in_metres",
    "jumps_in_newtons",
    "jumps_of_turned_stroke",
    "slips_s",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
