"""Identification of a spring model from recorded runs (docs/identification.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.identification.drive import (
        Drive,
        Reduction,
        join,
        reduce_run,
    )
    from bufferstand.model.identification.fitting import (
        Estimate,
        Solution,
        correlation_of,
    )
    from bufferstand.model.identification.held_out import (
        held_out_of,
    )
    from bufferstand.model.identification.laws import (
        LAWS,
        NAMES,
        Law,
    )
    from bufferstand.model.identification.parameters import (
        FixedParts,
        curves_at_knots,
        model_of,
    )
    from bufferstand.model.identification.problem import (
        START_SIGMA_K,
        STATE_RANGES,
        STATES,
        Experiment,
        Problem,
        whitened,
    )
    from bufferstand.model.identification.procedure import (
        FitSettings,
        Identification,
        experiment_of,
        identify,
    )
    from bufferstand.model.identification.response import (
        Answer,
        BandStage,
        LagStage,
        answer,
        spectrum_lags,
    )
    from bufferstand.model.identification.suggested_runs import (
        missing_runs,
        needed,
    )
    from bufferstand.model.identification.validation import (
        CycleCheck,
        check_cycles,
        cycles_of,
    )

__all__ = [
    "LAWS",
    "NAMES",
    "START_SIGMA_K",
    "STATES",
    "STATE_RANGES",
    "Answer",
    "BandStage",
    "CycleCheck",
    "Drive",
    "Estimate",
    "Experiment",
    "FitSettings",
    "FixedParts",
    "Identification",
    "LagStage",
    "Law",
    "Problem",
    "Reduction",
    "Solution",
    "answer",
    "check_cycles",
    "correlation_of",
    "curves_at_knots",
    "cycles_of",
    "experiment_of",
    "held_out_of",
    "identify",
    "join",
    "missing_runs",
    "model_of",
    "needed",
    "reduce_run",
    "spectrum_lags",
    "whitened",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
