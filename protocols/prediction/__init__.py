"""What is expected of a specimen before it is tested.

Forces, turning points and temperatures, by a model, a curve or what was learned.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.protocols.prediction.coarse import (
        CoarsePredictor,
    )
    from bufferstand.protocols.prediction.curve_predictor import (
        CurvePredictor,
        UnknownSpecimenPredictor,
        curve_of_stroke,
    )
    from bufferstand.protocols.prediction.force_turning_points import (
        FINEST_MM,
        SpecimenLoading,
        force_turns,
    )
    from bufferstand.protocols.prediction.learning import (
        HeatScale,
        LearnedPredictor,
        Observation,
        end_as_measured,
        learn_heating,
    )
    from bufferstand.protocols.prediction.machine_stroke import (
        Sine,
        piston_mm,
        piston_sine,
    )
    from bufferstand.protocols.prediction.predictor import (
        ModelPredictor,
        Predictor,
        StaticEstimate,
        Temperatures,
        force_at,
        sensor_after,
    )
    from bufferstand.protocols.prediction.rest_time import (
        EVEN_LAGS,
        LOOK_S,
        UNKNOWN_LAG_S,
        comes_in_two_goes,
        even_within_K,
        rested_even,
        seen_too_late,
    )
    from bufferstand.protocols.prediction.sine_start import (
        ForcePath,
        first_cycle,
        peak_force,
    )
    from bufferstand.protocols.prediction.turning_point_changes import (
        turn_changes,
    )

__all__ = [
    "EVEN_LAGS",
    "FINEST_MM",
    "LOOK_S",
    "UNKNOWN_LAG_S",
    "CoarsePredictor",
    "CurvePredictor",
    "ForcePath",
    "HeatScale",
    "LearnedPredictor",
    "ModelPredictor",
    "Observation",
    "Predictor",
    "Sine",
    "SpecimenLoading",
    "StaticEstimate",
    "Temperatures",
    "UnknownSpecimenPredictor",
    "comes_in_two_goes",
    "curve_of_stroke",
    "end_as_measured",
    "even_within_K",
    "first_cycle",
    "force_at",
    "force_turns",
    "learn_heating",
    "peak_force",
    "piston_mm",
    "piston_sine",
    "rested_even",
    "seen_too_late",
    "sensor_after",
    "turn_changes",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
