"""The CiA 402 state machine as the controller shows it: control words, status words, the way to “on”.

Source: CiA 402 / IEC 61800-7-201, objects 6040h and 6041h; the bits used are listed in the register profile.
"""

from __future__ import annotations

from dataclasses import dataclass

SWITCH_OFF = 0x0000
"""Control word: voltage off, valve closed."""
FAULT_RESET = 0x0080
"""Control word: its rising edge resets a fault."""
ENABLE_OPERATION = 0x000F
"""Control word: actuator on."""

RESET_FORCE_MAX_KN = 5.0
"""With more force than this on the specimen no fault is reset [kN]: what a transducer's zero may be off, as
at any start (``zero_force_max_kN``)."""

FAULT_BIT = 1 << 3
OPERATION_BIT = 1 << 2
_STATE_BITS = 0x006F


@dataclass(frozen=True)
class SwitchStep:
    """One step on the way to “on”: the control word, and the status that must follow."""

    control_word: int
    status: int
    name: str

    def reached(self, status_word: int) -> bool:
        """Return whether the status word shows the state of this step."""
        return status_word & _STATE_BITS == self.status


SWITCH_ON: tuple[SwitchStep, ...] = (
    SwitchStep(0x0006, 0x0021, "ready to switch on"),
    SwitchStep(0x0007, 0x0023, "switched on"),
    SwitchStep(ENABLE_OPERATION, 0x0027, "operation enabled"),
)
"""The way from off to on (transitions 2, 3, 4); simple controllers show only the last state."""

_NAMES = (
    (0x004F, 0x0000, "not ready to switch on"),
    (0x004F, 0x0040, "switch-on disabled"),
    (0x006F, 0x0021, "ready to switch on"),
    (0x006F, 0x0023, "switched on"),
    (0x006F, 0x0027, "operation enabled"),
    (0x006F, 0x0007, "quick stop active"),
    (0x004F, 0x000F, "reacting to a fault"),
    (0x004F, 0x0008, "fault"),
)


def state_name(status_word: int) -> str:
    """Return what a status word says, in words."""
    for mask, value, name in _NAMES:
        if status_word & mask == value:
            return name
    return f"unknown state (status word 0x{status_word:04X})"
