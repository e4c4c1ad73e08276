"""What an RMC's axis does, in the words of a ring controller's status: its state, and CiA 402's word."""

from __future__ import annotations

from bufferstand.drivers.controllers.rmc.axis import AxisStatus
from bufferstand.drivers.interfaces import MotionState

SWITCHED = 0x06
"""Bits of the control word with which the axis is ready to be enabled."""


def state_of(status: AxisStatus, fault: int, control: int, motion: MotionState | None) -> MotionState:
    """Return what the controller does.

    Parameters
    ----------
    status : AxisStatus
    fault : int
        Number of the fault; 0 without one.
    control : int
        The control word that was written last.
    motion : MotionState or None
        State of the motion under way; None where none is.
    """
    if fault:
        return MotionState.RELEASING if status.enabled else MotionState.FAULT
    if not status.enabled:
        return MotionState.READY if control & SWITCHED == SWITCHED else MotionState.OFF
    if motion is not None:
        return motion
    return MotionState.HOLDING if status.done else MotionState.RAMPING


def status_word(status: AxisStatus, fault: int, control: int) -> int:
    """Return the state as CiA 402 has it; parameters as for :func:`state_of`."""
    if fault:
        return 0x022F if status.enabled else 0x0228
    if status.enabled:
        return 0x0237
    if control & SWITCHED != SWITCHED:
        return 0x0260
    return 0x0233 if control & 0x01 else 0x0231
