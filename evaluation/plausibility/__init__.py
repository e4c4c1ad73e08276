"""Plausibility of each channel and of the set of cycles: what on record no specimen and no motion make.

Each detector is a pure function from a :class:`Look` to findings, in a module of its own;
:data:`DETECTORS` lists them.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.affected_figures import (
        SpoiledFigures,
        doubted,
        summary_without_claims,
        without_claims,
    )
    from bufferstand.evaluation.plausibility.detectors import (
        look_for_implausible,
    )

__all__ = [
    "SpoiledFigures",
    "doubted",
    "look_for_implausible",
    "summary_without_claims",
    "without_claims",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
