"""Put a simulated stand together from its stand file and a spring model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from bufferstand.drivers.simulated.faults import ScheduledFault, nearest
from bufferstand.drivers.simulated.machine import SimulatedDevice, Spring, TruthLog
from bufferstand.drivers.simulated.moved_stand import MovedStand
from bufferstand.drivers.simulated.settings import model_path, simulation_settings
from bufferstand.drivers.stand_file import StandFile, acquisition_stream
from bufferstand.foundation import BadInput
from bufferstand.model import SpringStepper, load_model


def demand_possible(stand_file: StandFile, fault: ScheduledFault) -> None:
    """See that a fault strikes a device that the stand has.

    Raises
    ------
    BadInput
        If it has none of that name.
    """
    channels = stand_file.controller.channel
    have = ["controller", *(channel.name for channel in channels if channel.quantity != "command")]
    if isinstance(stand_file, MovedStand):
        have = []  # what its controller samples nobody reads
    have += [one.stream for one in stand_file.instruments]
    have += [acquisition_stream(number) for number in range(len(stand_file.acquisition))]
    thermometers = {
        sensor.name: device.kind for device in stand_file.thermometers for sensor in device.sensors
    }
    have += thermometers
    target = next((one for one in stand_file.instruments if one.stream == fault.target), None)
    registers = target is not None and target.kind.registers(target.settings, target.folder) is not None
    if registers and fault.kind == "resync":
        raise BadInput(
            "what has registers sends no stream whose spacing could be lost",
            place=f"fault {fault}",
            remedy="use drop, delay, corrupt or duplicate",
        )
    kind = thermometers.get(fault.target)
    if kind is not None and fault.kind not in kind.sensor_type.faults:
        raise BadInput(
            f"{fault.target} is of kind “{kind.name}”, which has no fault “{fault.kind}”",
            place=f"fault {fault}",
            remedy=f"its faults: {', '.join(kind.sensor_type.faults)}",
        )
    if fault.target not in have:
        raise BadInput(
            f"the stand has no {fault.target}{nearest(fault.target, have)}",
            place=f"fault {fault}",
            remedy=f"it has {', '.join(have)}",
        )


def make_device(
    stand_file: StandFile,
    wall_s: Callable[[], float],
    *,
    model: Path | None = None,
    spring: Spring | None = None,
    truth: TruthLog | None = None,
    faults: Sequence[ScheduledFault] = (),
    fault_seed: int = 0,
) -> SimulatedDevice:
    """Return the stand of a stand file with a specimen in it, at time 0, switched off.

    Parameters
    ----------
    stand_file : StandFile
        With a table ``[simulation]``.
    wall_s : callable
        Monotonic wall time [s], for the watchdog.
    model : Path, optional
        Spring model instead of the one that the stand file names.
    spring : Spring, optional
        A specimen that is there already, instead of a model.
    truth : Truth, optional
        Where to log what really happens.
    faults : sequence of ScheduledFault
        What shall fail, and when.
    fault_seed : int
        By which the frames are picked that a fault strikes.

    Raises
    ------
    BadInput
        If the table is missing or wrong, the model cannot be loaded, or a calibration cannot be inverted.
    """
    settings = simulation_settings(stand_file)
    for fault in faults:
        demand_possible(stand_file, fault)
    if spring is None:
        initial_C = settings.ambient_C if settings.initial_C is None else settings.initial_C
        stated = load_model(model_path(stand_file, model))
        true = replace(stated, curves=stated.curves.scaled(settings.specimen_force_factor))
        spring = SpringStepper(true, initial_C, settings.ambient_C)
    return SimulatedDevice(stand_file, settings, spring, wall_s, truth, faults, fault_seed)
