"""Functions on plain arrays.

Splines, smoothing, fits of shapes, harmonics, hum, reversals. They know nothing of a record.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.numerics.arrays import (
        BoolArray,
        ComplexArray,
        FloatArray,
        IndexArray,
    )
    from bufferstand.evaluation.numerics.cubic_splines import (
        moved,
        moved_evenly,
        spline_at,
        splines,
    )
    from bufferstand.evaluation.numerics.harmonic_basis import (
        basis_for,
    )
    from bufferstand.evaluation.numerics.hum import (
        HumLine,
        lines_of,
        without_lines,
    )
    from bufferstand.evaluation.numerics.reversals import (
        WHITE,
        Sampling,
        difference_sigma,
        find_reversals,
        held_samples,
        noise_sigma,
        sampling_of,
        without_fast_hum,
    )
    from bufferstand.evaluation.numerics.shape_fits import (
        LEAST_POINTS,
        MOST_POINTS,
        UNSURE_POINTS,
        Fits,
        WindowPoints,
        derivative,
        maxima,
        points_of,
        powers,
        sharp_fits,
        smooth_fits,
        solved,
        value_at,
    )
    from bufferstand.evaluation.numerics.smoothing import (
        moving_slopes,
        polynomials,
        smoothed,
    )

__all__ = [
    "LEAST_POINTS",
    "MOST_POINTS",
    "UNSURE_POINTS",
    "WHITE",
    "BoolArray",
    "ComplexArray",
    "Fits",
    "FloatArray",
    "HumLine",
    "IndexArray",
    "Sampling",
    "WindowPoints",
    "basis_for",
    "derivative",
    "difference_sigma",
    "find_reversals",
    "held_samples",
    "lines_of",
    "maxima",
    "moved",
    "moved_evenly",
    "moving_slopes",
    "noise_sigma",
    "points_of",
    "polynomials",
    "powers",
    "sampling_of",
    "sharp_fits",
    "smooth_fits",
    "smoothed",
    "solved",
    "spline_at",
    "splines",
    "value_at",
    "without_fast_hum",
    "without_lines",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
