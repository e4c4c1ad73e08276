"""The acquisition loop.

One thread reads every sample, feeds the watchdog, and rides out short outages of the wire.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.acquisition.catching_up import (
        NOT_CAUGHT_UP,
        catch_up,
    )
    from bufferstand.daq.acquisition.loop import (
        Acquisition,
    )
    from bufferstand.daq.acquisition.outage import (
        VALVE_OFF_S,
        OutageHandler,
    )
    from bufferstand.daq.acquisition.outage_settings import (
        rides_of,
    )
    from bufferstand.daq.acquisition.pace import (
        LoopPace,
    )
    from bufferstand.daq.acquisition.polled_periods import (
        PolledPeriods,
    )
    from bufferstand.daq.acquisition.run_log import (
        BlockRecorder,
    )
    from bufferstand.daq.acquisition.sample_collector import (
        CollectedSamples,
    )

__all__ = [
    "NOT_CAUGHT_UP",
    "VALVE_OFF_S",
    "Acquisition",
    "BlockRecorder",
    "CollectedSamples",
    "LoopPace",
    "OutageHandler",
    "PolledPeriods",
    "catch_up",
    "rides_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
