"""Trains of vehicles with springs of their own models: a file that says them, their motion, and its figures.

Vehicles are rigid masses on straight, level track, without brakes, traction or rolling resistance.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.train.file import (
        TrainFile,
        load_train,
    )
    from bufferstand.model.train.impact import (
        ImpactPrediction,
        impact_to,
        predict_impact,
    )
    from bufferstand.model.train.motion import (
        TrainMotion,
        move_train,
    )
    from bufferstand.model.train.result import (
        TrainFigures,
        figures_of,
    )
    from bufferstand.model.train.scene import (
        Gap,
        Springs,
        Train,
        Vehicle,
    )

__all__ = [
    "Gap",
    "ImpactPrediction",
    "Springs",
    "Train",
    "TrainFigures",
    "TrainFile",
    "TrainMotion",
    "Vehicle",
    "figures_of",
    "impact_to",
    "load_train",
    "move_train",
    "predict_impact",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
