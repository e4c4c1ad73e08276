"""Uncertainty of every figure.

Error model, noise, Monte Carlo propagation (JCGM 101), linear budget (JCGM 100), means.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.uncertainty.cycle_propagations import (
        Propagations,
    )
    from bufferstand.evaluation.uncertainty.cycle_uncertainty import (
        with_uncertainty,
    )
    from bufferstand.evaluation.uncertainty.error_model import (
        SHAPE_SHARE,
        Draws,
        draw_errors,
        drum_periods_mm,
        mean_of_wires,
        missing_facts,
        stroke_term_slopes,
    )
    from bufferstand.evaluation.uncertainty.linear_budget import (
        run_budget,
    )
    from bufferstand.evaluation.uncertainty.means import (
        MeanOfDraws,
        summarise,
    )
    from bufferstand.evaluation.uncertainty.monte_carlo import (
        COVERAGE,
        NEAR_LARGEST,
        CyclePropagation,
        LocalReading,
        expanded,
        force_draws,
        half_width_95,
        stroke_error_mm,
        turn_share,
    )
    from bufferstand.evaluation.uncertainty.noise import (
        Noise,
        Spectrum,
        record_noise,
    )
    from bufferstand.evaluation.uncertainty.shared_errors import (
        Regression,
    )
    from bufferstand.evaluation.uncertainty.speed_warnings import (
        noisy_speed_warnings,
    )

__all__ = [
    "COVERAGE",
    "NEAR_LARGEST",
    "SHAPE_SHARE",
    "CyclePropagation",
    "Draws",
    "LocalReading",
    "MeanOfDraws",
    "Noise",
    "Propagations",
    "Regression",
    "Spectrum",
    "draw_errors",
    "drum_periods_mm",
    "expanded",
    "force_draws",
    "half_width_95",
    "mean_of_wires",
    "missing_facts",
    "noisy_speed_warnings",
    "record_noise",
    "run_budget",
    "stroke_error_mm",
    "stroke_term_slopes",
    "summarise",
    "turn_share",
    "with_uncertainty",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
