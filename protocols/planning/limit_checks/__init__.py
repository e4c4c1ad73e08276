"""Does a step keep every limit? If not: which one does it break, and what is the nearest that would do?"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.protocols.planning.limit_checks.broken_limit import (
        BELOW_ZERO,
        HYDRAULICS,
        KNOWN,
        BrokenLimit,
    )
    from bufferstand.protocols.planning.limit_checks.check import (
        StepJudge,
    )
    from bufferstand.protocols.planning.limit_checks.unknown_specimen import (
        SLOW_MM_PER_S,
        shows_the_curve,
    )

__all__ = [
    "BELOW_ZERO",
    "HYDRAULICS",
    "KNOWN",
    "SLOW_MM_PER_S",
    "BrokenLimit",
    "StepJudge",
    "shows_the_curve",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
