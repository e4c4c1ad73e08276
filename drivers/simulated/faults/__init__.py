"""Faults of the simulated devices: their schedule, the fault file, the control socket, and damaged frames."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.faults.control import (
        SOCKET,
        FaultControl,
        ask,
    )
    from bufferstand.drivers.simulated.faults.file import (
        load_faults,
    )
    from bufferstand.drivers.simulated.faults.frames import (
        FrameFaults,
    )
    from bufferstand.drivers.simulated.faults.schedule import (
        FOREVER_S,
        FaultSchedule,
        ScheduledFault,
        nearest,
        parse_fault,
    )

__all__ = [
    "FOREVER_S",
    "SOCKET",
    "FaultControl",
    "FaultSchedule",
    "FrameFaults",
    "ScheduledFault",
    "ask",
    "load_faults",
    "nearest",
    "parse_fault",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
