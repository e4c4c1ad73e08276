"""From a stand file to the sensors beside the controller."""

from __future__ import annotations

from bufferstand.drivers.instruments import TAGS
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import BadInput, Clock


def build_sensors(stand_file: StandFile, clock: Clock) -> tuple[Sensor, ...]:
    """Return the devices beside the controller, not started yet.

    Amplifiers, then thermometers, then other sensors, each in the order of the stand file.

    Raises
    ------
    BadInput
        If a register map that one names cannot be read.
    """
    drivers: dict[str, list[Sensor]] = {table: [] for table in TAGS}
    for one in stand_file.instruments:
        try:
            drivers[one.kind.table].append(one.driver(clock))
        except BadInput as error:
            if error.file is not None:
                raise
            raise BadInput(
                error.problem, file=stand_file.path, place=error.place, remedy=error.remedy
            ) from None
    for device in stand_file.thermometers:
        drivers["temperature"] += device.drivers(clock)
    return tuple(sensor for table in TAGS for sensor in drivers[table])
