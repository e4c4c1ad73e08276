"""Time shift (skew) between force and stroke.

Its measurement on an elastic reference, and what a millisecond of it changes.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.uncertainty.skew.measure import (
        SkewMeasurement,
        measure_skew,
    )
    from bufferstand.evaluation.uncertainty.skew.sensitivity import (
        skew_sensitivity,
    )

__all__ = [
    "SkewMeasurement",
    "measure_skew",
    "skew_sensitivity",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
