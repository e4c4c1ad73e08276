"""Loops of force over stroke.

Branches cut at the turning points, forces at their ends, first contact, inertia, the mean loop.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.loops.branches import (
        Branches,
    )
    from bufferstand.evaluation.loops.contact_bounds import (
        by_force_at_rest,
        by_ways_out,
    )
    from bufferstand.evaluation.loops.cut import (
        CutLoops,
        LoopStack,
        cut_loop,
        cut_loops,
        noise_of,
    )
    from bufferstand.evaluation.loops.extreme_forces import (
        overreach,
    )
    from bufferstand.evaluation.loops.first_contact import (
        contact_decimals,
        first_shown,
    )
    from bufferstand.evaluation.loops.inertia import (
        InertiaForce,
        correct_inertia,
    )
    from bufferstand.evaluation.loops.mean_of_loops import (
        mean_loop,
    )

__all__ = [
    "Branches",
    "CutLoops",
    "InertiaForce",
    "LoopStack",
    "by_force_at_rest",
    "by_ways_out",
    "contact_decimals",
    "correct_inertia",
    "cut_loop",
    "cut_loops",
    "first_shown",
    "mean_loop",
    "noise_of",
    "overreach",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
