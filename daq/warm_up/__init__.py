"""Warming a specimen up, and what is known of its temperature and heat meanwhile."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.warm_up.heat_log import (
        LATE_S,
        HeatLog,
        StepHeat,
    )
    from bufferstand.daq.warm_up.outcome import (
        WarmUpOutcome,
    )
    from bufferstand.daq.warm_up.warming import (
        warm_up,
    )

__all__ = [
    "LATE_S",
    "HeatLog",
    "StepHeat",
    "WarmUpOutcome",
    "warm_up",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
