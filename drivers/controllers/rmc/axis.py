"""One position axis of an RMC: its status, and the commands that move it.

Source: RMC70/150 and RMCTools User Manual 3.62, pp. 718 (5), 729 to 734 (20), 777 to 779 (72), 782 to 784
(80), 864 (status bits) and 899 (positions); RMCTools web help “RMC Commands Overview” and “Command List”.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from bufferstand.drivers.controllers.rmc.addresses import MODELS, parse_address
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters
from bufferstand.drivers.controllers.rmc.settings import RmcSettings

COMMAND_REGISTERS = 10
LAST_ERROR, POSITION, TARGET, REQUESTED = 2, 8, 53, 56
"""Elements of an axis' status, besides 0: the bits."""
NO_DIRECTION = 0.0
MID_POS = 1.0
"""Start location of a sine: at its middle, upwards."""


class AxisCommand(IntEnum):
    """Numbers of commands."""

    CLEAR_FAULTS = 4
    HOLD_HERE = 5
    STOP = 6
    MOVE = 20
    SINE = 72
    CHANGE = 80
    ENABLE = 97


class AxisBit(IntFlag):
    """Status bits."""

    IN_POSITION = 1 << 0
    OPEN_LOOP = 1 << 2
    STOPPED = 1 << 6
    DONE = 1 << 9
    ENABLED = 1 << 13
    EXTERNAL_HALT = 1 << 14
    HALTED = 1 << 15


@dataclass(frozen=True)
class AxisStatus:
    """One look at the axis and its transducers.

    Parameters
    ----------
    bits : AxisBit
    last_error : float
        Number of the last error.
    position_mm, target_mm, requested_mm : float
        Where it is, where it should be at this instant, where the last command sent it.
    force_kN, stroke_mm : float
        Of the registers that the stand file names.
    """

    bits: AxisBit
    last_error: float
    position_mm: float
    target_mm: float
    requested_mm: float
    force_kN: float
    stroke_mm: float

    @property
    def enabled(self) -> bool:
        """Whether it is switched on."""
        return bool(self.bits & AxisBit.ENABLED)

    @property
    def done(self) -> bool:
        """Whether its target stands still."""
        return bool(self.bits & AxisBit.DONE)

    @property
    def halted(self) -> bool:
        """Whether an error, or its halt input, has stopped it."""
        return bool(self.bits & (AxisBit.HALTED | AxisBit.EXTERNAL_HALT))


class RmcAxis:
    """Looks and commands.

    Parameters
    ----------
    registers : RmcRegisters
    settings : RmcSettings
    """

    def __init__(self, registers: RmcRegisters, settings: RmcSettings) -> None:
        model = MODELS[settings.model]
        self._registers, self._settings = registers, settings
        self._status, self._command = model.status(settings.axis), model.command(settings.axis)
        self._force = parse_address(settings.force)
        self._stroke = None if settings.stroke is None else parse_address(settings.stroke)

    def look(self) -> AxisStatus:
        """Get the axis' status: one read where that many registers go, and those of the transducers."""
        registers = self._registers
        if self._settings.largest_read >= 2 * (REQUESTED + 1):
            raw = registers.raw(self._status, REQUESTED + 1, "the axis' status")
            found = {at: raw[4 * at : 4 * at + 4] for at in (0, LAST_ERROR, POSITION, TARGET, REQUESTED)}
        else:
            head = registers.raw(self._status, POSITION + 1, "the axis' status")
            tail = registers.raw(self._status.plus(TARGET), REQUESTED - TARGET + 1, "the axis' target")
            found = {at: head[4 * at : 4 * at + 4] for at in (0, LAST_ERROR, POSITION)}
            found |= {TARGET: tail[:4], REQUESTED: tail[-4:]}
        (bits,) = struct.unpack(">I", found[0])
        error, position, target, requested = (
            struct.unpack(">f", found[at])[0] for at in (LAST_ERROR, POSITION, TARGET, REQUESTED)
        )
        (force,) = registers.reals(self._force, 1, "the force")
        stroke = position if self._stroke is None else registers.reals(self._stroke, 1, "the stroke")[0]
        return AxisStatus(AxisBit(bits), error, position, target, requested, force, stroke)

    def send(self, command: AxisCommand, *parameters: float) -> None:
        """Write a command with its parameters, all in one request that is never sent twice."""
        values = [float(command), *parameters]
        values += [0.0] * (COMMAND_REGISTERS - len(values))
        self._registers.set_reals(self._command, values, f"command {command.value}", once=True)

    def move(self, target_mm: float, speed_mm_per_s: float) -> None:
        """Move to a position at a speed."""
        rate = self._settings.acceleration_mm_per_s2
        self.send(AxisCommand.MOVE, target_mm, speed_mm_per_s, rate, rate, NO_DIRECTION)

    def stop(self) -> None:
        """Stop in closed loop."""
        self.send(AxisCommand.STOP, self._settings.acceleration_mm_per_s2)

    def sine(
        self, mean_mm: float, amplitude_mm: float, frequency_Hz: float, cycles: float, block: int
    ) -> None:
        """Begin a sine where the target stands at its mean.

        Parameters
        ----------
        mean_mm, amplitude_mm, frequency_Hz : float
        cycles : float
            In steps of 0.25.
        block : int
            Number of the first register of the status block.
        """
        self.send(AxisCommand.SINE, mean_mm, amplitude_mm, frequency_Hz, cycles, MID_POS, float(block))

    def change(self, which: int, value: float, ramp: int, cycles: float) -> None:
        """Change a parameter of the running sine over so many cycles."""
        self.send(AxisCommand.CHANGE, float(which), value, float(ramp), cycles)

    def enable(self, *, on: bool) -> None:
        """Switch the axis on, holding where it is, or off."""
        value = self._settings.enable_value
        if not on:
            self.send(AxisCommand.ENABLE, float(1 - value))
            return
        self.send(AxisCommand.ENABLE, float(value))
        self.send(AxisCommand.HOLD_HERE, 1.0)
