"""Steps of a run: groups of cycles that belong together, each with a summary of its own.

What makes the figures of a step is in :mod:`evaluation.steps.sum_up`; it is slow to import, and documents and
archives do without.
"""

from evaluation.steps.divide import Division, Part, divide
from evaluation.steps.points import points_of

__all__ = ["Division", "Part", "divide", "points_of"]
