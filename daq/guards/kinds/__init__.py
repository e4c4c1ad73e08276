"""The kinds of guards, one module each: settings, memory and evaluation."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.guards.kinds.channel import (
        DEFAULT_TILT_MM,
        ChannelGuard,
    )
    from bufferstand.daq.guards.kinds.clock import (
        PAUSE_S,
    )
    from bufferstand.daq.guards.kinds.controller import (
        DEVICE_LIMIT_FAULTS,
        FORCE_LIMIT_FAULT,
        WATCHDOG_FAULT,
        ControllerGuard,
        ControllerMemory,
        fault_text,
        new_limit,
    )
    from bufferstand.daq.guards.kinds.rate import (
        SPEED_FACTOR,
    )
    from bufferstand.daq.guards.kinds.silence import (
        SilenceGuard,
    )
    from bufferstand.daq.guards.kinds.temperature import (
        TemperatureGuard,
    )
    from bufferstand.daq.guards.kinds.wiring import (
        SignalsGuard,
    )

__all__ = [
    "DEFAULT_TILT_MM",
    "DEVICE_LIMIT_FAULTS",
    "FORCE_LIMIT_FAULT",
    "PAUSE_S",
    "SPEED_FACTOR",
    "WATCHDOG_FAULT",
    "ChannelGuard",
    "ControllerGuard",
    "ControllerMemory",
    "SignalsGuard",
    "SilenceGuard",
    "TemperatureGuard",
    "fault_text",
    "new_limit",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
