"""Does a step keep every limit? If not: which one does it break, and what is the nearest that would do?"""

from __future__ import annotations

from bufferstand.protocols.admissible.breach import BELOW_ZERO, HYDRAULICS, KNOWN, BrokenLimit
from bufferstand.protocols.admissible.judge import StepJudge
from bufferstand.protocols.admissible.unknown import SLOW_MM_PER_S, shows_the_curve

__all__ = [
    "BELOW_ZERO",
    "HYDRAULICS",
    "KNOWN",
    "SLOW_MM_PER_S",
    "BrokenLimit",
    "StepJudge",
    "shows_the_curve",
]
