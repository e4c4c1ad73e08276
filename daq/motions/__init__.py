"""Performing motions: running one to its end, cycles between two forces, and the safe stop."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.motions.motion_runner import (
        Halt,
        MotionRunner,
        MotionTimeLimit,
    )
    from bufferstand.daq.motions.safe_stop import (
        VALVE_OFF,
        SafeStop,
        SafeStopReport,
        SafeStopSettings,
    )
    from bufferstand.daq.motions.stop_observer import (
        SampleObserver,
    )

__all__ = [
    "VALVE_OFF",
    "Halt",
    "MotionRunner",
    "MotionTimeLimit",
    "SafeStop",
    "SafeStopReport",
    "SafeStopSettings",
    "SampleObserver",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
