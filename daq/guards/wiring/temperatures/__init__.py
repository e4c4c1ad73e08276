"""Wiring checks of thermometers: do they show the heat that goes into the specimen?"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.wiring.temperatures.heat import (
        HeatJudge,
    )

__all__ = [
    "HeatJudge",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
