"""The computational spring model: curves, exact hysteresis, heat and a viscous branch.

It knows no stand and no recording; its equations stand in ``docs/model.md``.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.energy import (
        stored_energy,
    )
    from bufferstand.model.file import (
        ModelFile,
        load_model,
        save_model,
    )
    from bufferstand.model.paper_runs import (
        SEQUENCE_mm,
        SimulatedRun,
        frequency_of,
        harmonic_run,
        sequence,
        static_run,
        warming_run,
    )
    from bufferstand.model.prediction import (
        CyclePrediction,
        heat_step,
        predict_forces,
        predict_harmonic,
        predict_static,
    )
    from bufferstand.model.simulation import (
        Simulation,
        simulate,
    )
    from bufferstand.model.spring import (
        HeatBalance,
        SpringModel,
    )
    from bufferstand.model.stepper import (
        SpringStepper,
    )
    from bufferstand.model.train import (
        ImpactPrediction,
        impact_to,
        predict_impact,
    )

__all__ = [
    "CyclePrediction",
    "HeatBalance",
    "ImpactPrediction",
    "ModelFile",
    "SEQUENCE_mm",
    "SimulatedRun",
    "Simulation",
    "SpringModel",
    "SpringStepper",
    "frequency_of",
    "harmonic_run",
    "heat_step",
    "impact_to",
    "load_model",
    "predict_forces",
    "predict_harmonic",
    "predict_impact",
    "predict_static",
    "save_model",
    "sequence",
    "simulate",
    "static_run",
    "stored_energy",
    "warming_run",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
