"""Whether another program uses a controller; the samples of its ring then belong to that program."""

from __future__ import annotations

from bufferstand.drivers.interfaces import Controller, MotionState

IN_MOTION = (MotionState.RAMPING, MotionState.WAVEFORM, MotionState.RELEASING)
"""States in which the piston goes somewhere."""
SWITCHED_ON = (MotionState.HOLDING, *IN_MOTION)
"""States in which somebody has the valve on."""


def who_uses(controller: Controller) -> str:
    """Return who else commands a controller that this program does not command; empty if nobody is seen to.

    Raises
    ------
    DeviceFault
        If the wire fails.
    """
    writer, status = controller.other_writer(), controller.status()
    if writer:
        return f"program {writer} gives commands ({status.state.name.lower()})"
    if writer is None and status.state in SWITCHED_ON:
        return f"somebody has switched it on ({status.state.name.lower()})"
    return ""


def is_read_by_one(controller: Controller) -> bool:
    """Return whether to read its samples takes them from another program: a ring's, not polled ones."""
    return controller.facts.clock != "host"
