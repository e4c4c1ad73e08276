"""The stroke at its turning points: how sharp they are, and the force there, for each branch."""

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
