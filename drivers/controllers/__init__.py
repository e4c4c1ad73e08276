"""Actuator controllers behind registers.

State, commands, switching on and off, samples from a ring or by polling, the writer's lock.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.controllers.catalogue import (
        REGISTERS,
        controller_kind,
        controller_kinds,
    )
    from bufferstand.drivers.controllers.cia402 import (
        FAULT_RESET,
        RESET_FORCE_MAX_KN,
        SWITCH_OFF,
    )
    from bufferstand.drivers.controllers.cycle_gaps import (
        missed_cycles,
        parted,
    )
    from bufferstand.drivers.controllers.identity import (
        find_mismatch,
    )
    from bufferstand.drivers.controllers.in_use import (
        IN_MOTION,
        SWITCHED_ON,
        is_read_by_one,
        who_uses,
    )
    from bufferstand.drivers.controllers.kind import (
        ControllerKind,
        ControllerSite,
    )
    from bufferstand.drivers.controllers.named_registers import (
        FAULT_TEXTS,
    )
    from bufferstand.drivers.controllers.outage_limit import (
        RESERVE_S,
        OutageLimit,
        leeway_of,
    )
    from bufferstand.drivers.controllers.polling_controller import (
        PollingController,
    )
    from bufferstand.drivers.controllers.register_controller import (
        RegisterController,
    )
    from bufferstand.drivers.controllers.ring_controller import (
        RingController,
    )
    from bufferstand.drivers.controllers.writer_notice import (
        NoticeBoard,
    )

__all__ = [
    "FAULT_RESET",
    "FAULT_TEXTS",
    "IN_MOTION",
    "REGISTERS",
    "RESERVE_S",
    "RESET_FORCE_MAX_KN",
    "SWITCHED_ON",
    "SWITCH_OFF",
    "ControllerKind",
    "ControllerSite",
    "NoticeBoard",
    "OutageLimit",
    "PollingController",
    "RegisterController",
    "RingController",
    "controller_kind",
    "controller_kinds",
    "find_mismatch",
    "is_read_by_one",
    "leeway_of",
    "missed_cycles",
    "parted",
    "who_uses",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
