"""Identification of a spring model from recorded runs (docs/identification.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.identification.drive import (
        Drive,
        join,
        reduce_run,
    )
    from bufferstand.model.identification.fitting import (
        Estimate,
    )
    from bufferstand.model.identification.laws import (
        LAWS,
        NAMES,
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
    )
    from bufferstand.model.identification.suggested_runs import (
        missing_runs,
        needed,
    )
    from bufferstand.model.identification.validation import (
        CycleCheck,
        check_cycles,
    )

__all__ = [
    "LAWS",
    "NAMES",
    "Answer",
    "BandStage",
    "CycleCheck",
    "Drive",
    "Estimate",
    "FitSettings",
    "Identification",
    "LagStage",
    "answer",
    "check_cycles",
    "experiment_of",
    "identify",
    "join",
    "missing_runs",
    "needed",
    "reduce_run",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
