"""What happens where the stroke turns: how sharp it does, and the forces there, of each branch by itself."""

from bufferstand.evaluation.turns.end_forces import EndForces, continuous, end_forces
from bufferstand.evaluation.turns.force_extremes import ForceExtremes, Inside, force_extremes, overreach
from bufferstand.evaluation.turns.sharpness import Tips, sharpness
from bufferstand.evaluation.turns.windows import Ends

__all__ = [
    "EndForces",
    "Ends",
    "ForceExtremes",
    "Inside",
    "Tips",
    "continuous",
    "end_forces",
    "force_extremes",
    "overreach",
    "sharpness",
]
