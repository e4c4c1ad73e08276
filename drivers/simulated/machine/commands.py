"""What a controller can be told, what it answers, and whether a command is within its means."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum


class RejectReason(IntEnum):
    """Judgement of a command (register ``reject_code``)."""

    ACCEPTED = 0
    UNKNOWN_COMMAND = 1
    WRONG_STATE = 2
    OUT_OF_RANGE = 3
    NOT_ARMED = 4


class ControllerFault(IntEnum):
    """Why the controller gave up (register ``fault_code``)."""

    NONE = 0
    WATCHDOG = 1
    FORCE_LIMIT = 2
    STROKE_LIMIT = 3
    ACTUATOR = 4


class CommandCode(IntEnum):
    """What is commanded (register ``command_code``)."""

    HOLD = 1
    RAMP = 2
    HARMONIC = 3
    STATIC = 4
    RELEASE = 5
    ADJUST = 6


KNOWN_CODES = frozenset(int(code) for code in CommandCode)
"""Every value of ``command_code`` that means something."""


class StatusBit(IntEnum):
    """Bits of the status word, as CiA 402 has them."""

    READY = 1 << 0
    SWITCHED_ON = 1 << 1
    ENABLED = 1 << 2
    FAULT = 1 << 3
    VOLTAGE = 1 << 4
    QUICK_STOP_INACTIVE = 1 << 5
    SWITCH_ON_DISABLED = 1 << 6
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    LIMIT_ACTIVE = 1 << 11


SWITCH_ON, ENABLE_VOLTAGE, QUICK_STOP_OFF, ENABLE_OPERATION, FAULT_RESET = 0x01, 0x02, 0x04, 0x08, 0x80
"""Bits of the control word, as CiA 402 has them; ``QUICK_STOP_OFF`` cleared stops."""

FLOAT32_SLACK = 1e-6
"""Relative slack of every comparison of a parameter with a limit: parameters arrive as float32."""
AT_MEAN_MM = 0.5
"""A harmonic starts only where the command stands this close to the mean [mm]."""
AT_ZERO_MM = 1.0
"""Static cycles start only where the command stands this close to zero [mm]."""


@dataclass(frozen=True)
class Capabilities:
    """What this controller can do and allows itself.

    Parameters
    ----------
    force_max_kN, stroke_max_mm, speed_max_mm_per_s, frequency_max_Hz : float
        Limits of the stand; the force and stroke limits that are set may be lower, never higher.
    force_trip_ratio : float
        The force limit trips at this multiple of itself, so that a motion may turn exactly at it.
    stroke_trip_mm : float
        The stroke limit trips this far beyond itself [mm].
    fallback_speed_mm_per_s : float
        Speed of the release that follows a fault.
    retract_max_mm : float
        How far the piston may be sent clear of the specimen.
    adjusts : bool
        Whether it can change a running sine (edition 3 of the ring profile).
    """

    force_max_kN: float = 600.0
    stroke_max_mm: float = 250.0
    speed_max_mm_per_s: float = 800.0
    frequency_max_Hz: float = 2.55
    force_trip_ratio: float = 1.02
    stroke_trip_mm: float = 1.0
    fallback_speed_mm_per_s: float = 20.0
    retract_max_mm: float = 50.0
    adjusts: bool = True


@dataclass(frozen=True)
class Command:
    """A command with all its parameters; each code uses its own."""

    sequence: int
    code: int
    target_mm: float = 0.0
    speed_mm_per_s: float = 0.0
    mean_mm: float = 0.0
    amplitude_mm: float = 0.0
    frequency_Hz: float = 0.0
    cycles: int = 0
    turning_force_kN: float = 0.0
    turning_stroke_mm: float = 0.0
    pause_s: float = 0.0


def in_range(command: Command, can: Capabilities, force_limit_kN: float, stroke_limit_mm: float) -> bool:
    """Return whether a command's parameters are such as this controller can do.

    Parameters
    ----------
    command : Command
        Of a known code.
    can : Capabilities
    force_limit_kN, stroke_limit_mm : float
        The device's limits in force.
    """
    more = 1.0 + FLOAT32_SLACK
    speed_fits = 0.0 < command.speed_mm_per_s <= can.speed_max_mm_per_s * more
    top = stroke_limit_mm * more
    match command.code:
        case CommandCode.HOLD:
            return True
        case CommandCode.RAMP:
            return speed_fits and -can.retract_max_mm <= command.target_mm <= top
        case CommandCode.HARMONIC:
            mean, amplitude = command.mean_mm, command.amplitude_mm
            peak_speed = 2.0 * math.pi * command.frequency_Hz * amplitude
            return (
                0.0 < amplitude <= mean * more
                and mean + amplitude <= top
                and 0.0 < command.frequency_Hz <= can.frequency_max_Hz * more
                and peak_speed <= can.speed_max_mm_per_s * more
                and command.cycles >= 1
            )
        case CommandCode.STATIC:
            return (
                speed_fits
                and 0.0 < command.turning_force_kN <= force_limit_kN * more
                and 0.0 < command.turning_stroke_mm <= top
                and command.cycles >= 1
                and 0.0 <= command.pause_s <= 86400.0
            )
        case _:
            return speed_fits
