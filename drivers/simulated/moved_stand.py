"""A simulated stand that its own controller moves: what record-only mode is tried on.

The machine is that of every simulated stand. Its controller answers nobody: it goes to a mean stroke and
makes sines by itself, as ``[simulation.moves]`` says. Only what the stand file lists measures it.
"""

from __future__ import annotations

import math

from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.simulated.machine import (
    AT_MEAN_MM,
    ENABLE_OPERATION,
    ENABLE_VOLTAGE,
    QUICK_STOP_OFF,
    SWITCH_ON,
    Command,
    CommandCode,
    ControllerFault,
    RejectReason,
    SimulatedDevice,
)
from bufferstand.drivers.simulated.settings import Moves, simulation_settings
from bufferstand.drivers.stand_file import ControllerSettings, RecordingStand, StandFile
from bufferstand.foundation import BadInput

APPROACH_MM_PER_S = 10.0
"""Speed with which it goes to the mean of its sines."""
CYCLES = 1_000_000
"""Of one sine: it makes them until it is switched off."""
_OPERATE = SWITCH_ON | ENABLE_VOLTAGE | QUICK_STOP_OFF | ENABLE_OPERATION
_LIMITS = {
    "force_max_kN": 630.0,
    "stroke_max_mm": 250.0,
    "frequency_max_Hz": 10.0,
    "speed_max_mm_per_s": 800.0,
}
"""Of the simulated machine: the stand file's own limits warn only."""
_CHANNELS = {
    "force": ("force", "kN", [0.0, 9.5367431640625e-05]),
    "stroke_1": ("stroke", "mm", [-50.0, 0.00762939453125]),
    "stroke_2": ("stroke", "mm", [-50.0, 0.00762939453125]),
    "position": ("position", "mm", [0.0, 0.01]),
    "command": ("command", "mm", [0.0, 0.01]),
}
"""What the machine's own controller samples, and nobody reads: name, quantity, unit, coefficients."""


class MovedStand(StandFile):
    """A stand file whose controller nobody reaches; made by :func:`moved_stand`."""


def moved_stand(recorded: RecordingStand) -> MovedStand:
    """Return the machine that a stand file without ``[controller]`` measures.

    Parameters
    ----------
    recorded : RecordingStand
        With a table ``[simulation]``.

    Raises
    ------
    BadInput
        If the table is missing or wrong.
    """
    channels = [
        {"name": name, "quantity": quantity, "unit": unit, "calibration": {"id": "own", "coefficients": by}}
        for name, (quantity, unit, by) in _CHANNELS.items()
    ]
    document = {
        "stand": recorded.stand.model_dump(exclude_none=True),
        "limits": _LIMITS,
        "controller": ControllerSettings.model_validate({"host": "127.0.0.1", "channel": channels}),
    }
    # The names of what is recorded (force, stroke_1 …) are those of the controller's own channels, too: the
    # lists are put in as they were checked in the file.
    made = MovedStand.model_validate(document).model_copy(
        update={
            "acquisition": recorded.acquisition,
            "amplifier": recorded.amplifier,
            "temperature": recorded.temperature,
            "sensor": recorded.sensor,
            "simulation": recorded.simulation,
        }
    )
    made._path = recorded.path
    simulation_settings(made)
    return made


class OwnController:
    """The controller of the stand's maker: it moves the simulated machine by itself.

    Parameters
    ----------
    device : SimulatedDevice
    moves : Moves

    Raises
    ------
    BadInput
        If the machine cannot make such a sine.
    """

    def __init__(self, device: SimulatedDevice, moves: Moves) -> None:
        self._controller, self._moves = device.controller, moves
        self._number = 0
        speed_mm_per_s = 2.0 * math.pi * moves.frequency_Hz * moves.amplitude_mm
        if speed_mm_per_s > _LIMITS["speed_max_mm_per_s"]:
            raise BadInput(
                f"± {moves.amplitude_mm:g} mm at {moves.frequency_Hz:g} Hz is {speed_mm_per_s:.0f} mm/s, "
                f"faster than the simulated machine's {_LIMITS['speed_max_mm_per_s']:g}",
                place="simulation.moves",
                remedy="write a smaller amplitude_mm or frequency_Hz",
            )

    def act(self) -> None:
        """Do what is next: switch on, go to the mean, begin the sine. After a fault it stays off."""
        controller, moves = self._controller, self._moves
        if controller.fault is not ControllerFault.NONE:
            return
        if not controller.valve_on:
            controller.control(_OPERATE)
        if controller.state is not MotionState.HOLDING:
            return
        self._number += 1
        if abs(controller.command_mm - moves.mean_mm) > AT_MEAN_MM:
            command = Command(
                self._number, CommandCode.RAMP, target_mm=moves.mean_mm, speed_mm_per_s=APPROACH_MM_PER_S
            )
        else:
            command = Command(
                self._number,
                CommandCode.HARMONIC,
                mean_mm=moves.mean_mm,
                amplitude_mm=moves.amplitude_mm,
                frequency_Hz=moves.frequency_Hz,
                cycles=CYCLES,
            )
        if controller.arm(command) is RejectReason.ACCEPTED:
            controller.execute(self._number)
