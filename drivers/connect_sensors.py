"""From a stand file to the sensors beside the controller."""

from __future__ import annotations

from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.stand_file import StandFile
from bufferstand.drivers.thermometers import Ds2480bBus, W1Bus
from bufferstand.foundation import BadInput, Clock


def build_sensors(stand_file: StandFile, clock: Clock) -> tuple[Sensor, ...]:
    """Return the devices beside the controller, not started yet.

    Amplifiers, then thermometers, then other sensors, each in the order of the stand file.

    Raises
    ------
    BadInput
        If a register map that one names cannot be read.
    """
    drivers: dict[str, list[Sensor]] = {"amplifier": [], "sensor": []}
    for one in stand_file.instruments:
        try:
            drivers[one.kind.table].append(one.driver(clock))
        except BadInput as error:
            if error.file is not None:
                raise
            raise BadInput(
                error.problem, file=stand_file.path, place=error.place, remedy=error.remedy
            ) from None
    thermometers: tuple[Sensor, ...] = ()
    temperature = stand_file.temperature
    root, adapter = stand_file.w1_root(), stand_file.onewire_port()
    if temperature is not None and root is not None:
        thermometers += W1Bus(root, temperature, clock).sensors
    if temperature is not None and adapter is not None:
        thermometers += Ds2480bBus(adapter, temperature, clock).sensors
    return (*drivers["amplifier"], *thermometers, *drivers["sensor"])
