"""From a stand file to the sensors beside the controller."""

from __future__ import annotations

from bufferstand.drivers.acquisition import AcquisitionDevice, acquisition_kind_of
from bufferstand.drivers.instruments import TAGS, InstrumentSite
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.stand_file import RecordingStand, StandFile, acquisition_stream
from bufferstand.foundation import BadInput, Clock


def build_sensors(stand_file: StandFile, clock: Clock) -> tuple[Sensor, ...]:
    """Return the devices beside the controller, not started yet.

    Amplifiers, then thermometers, then other sensors, then acquisition devices, each in the order of the
    stand file.

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
            raise error.of_file(stand_file.path) from None
    for device in stand_file.thermometers:
        drivers["temperature"] += device.drivers(clock)
    beside = tuple(sensor for table in TAGS for sensor in drivers[table])
    return (*beside, *build_acquisition(stand_file, clock))


def build_acquisition(stand: StandFile | RecordingStand, clock: Clock) -> tuple[AcquisitionDevice, ...]:
    """Return the devices with a clock of their own, not started yet, in the order of the stand file."""
    return tuple(
        acquisition_kind_of(entry).driver(
            entry, InstrumentSite(stand.folder, clock, acquisition_stream(number))
        )
        for number, entry in enumerate(stand.acquisition)
    )
