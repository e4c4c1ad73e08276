"""What happens where the stroke turns: how sharp it does, and the forces there, of each branch by itself."""

from evaluation.turns.end_forces import END_SHARE, EndForces, Ends, continuous, end_forces
from evaluation.turns.sharpness import Tips, sharpness

__all__ = ["END_SHARE", "EndForces", "Ends", "Tips", "continuous", "end_forces", "sharpness"]
