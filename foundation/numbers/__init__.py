"""Numbers that several rooms share.

Median and quantiles, gaps of signals, tolerances, signs of a wrong factor.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.numbers.quantiles import (
        median,
        quantile,
        sorted_quantile,
    )
    from bufferstand.foundation.numbers.signal_gaps import (
        HOLE_S,
        hole_from_s,
    )
    from bufferstand.foundation.numbers.tolerances import (
        MASS_ACCURACY_MOST_PERCENT,
        MOVING_MASS_MOST_KG,
        TILT_LEAST_MM,
        TILT_SHARE,
        TRIP_SHARE,
        tilt_bound_mm,
    )
    from bufferstand.foundation.numbers.wrong_factor import (
        likeness,
    )

__all__ = [
    "HOLE_S",
    "MASS_ACCURACY_MOST_PERCENT",
    "MOVING_MASS_MOST_KG",
    "TILT_LEAST_MM",
    "TILT_SHARE",
    "TRIP_SHARE",
    "hole_from_s",
    "likeness",
    "median",
    "quantile",
    "sorted_quantile",
    "tilt_bound_mm",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
