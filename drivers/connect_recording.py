"""From a stand file without a controller to its devices."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.drivers.acquisition import AcquisitionDevice
from bufferstand.drivers.connect_sensors import build_acquisition
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.stand_file import RecordingStand
from bufferstand.foundation import Clock, DeviceFault


@dataclass(frozen=True)
class RecordingDevices:
    """What a recording reads: devices with a clock of their own, then those this computer stamps."""

    acquisition: tuple[AcquisitionDevice, ...]
    sensors: tuple[Sensor, ...]

    @property
    def all(self) -> tuple[Sensor, ...]:
        """Every device."""
        return (*self.acquisition, *self.sensors)

    def start(self) -> None:
        """Begin to read every one.

        Raises
        ------
        DeviceFault
            If one does not answer or is another one; whatever was open is let go of.
        """
        try:
            for sensor in self.all:
                sensor.start()
        except DeviceFault:
            self.close()
            raise

    def close(self) -> None:
        """Let go of every wire; never raises."""
        for sensor in self.all:
            sensor.close()


def build_recording(stand: RecordingStand, clock: Clock) -> RecordingDevices:
    """Return the devices of a stand without a controller, not started yet.

    Raises
    ------
    BadInput
        If a register map that one names cannot be read.
    """
    acquisition = build_acquisition(stand, clock)
    sensors: list[Sensor] = [one.driver(clock) for one in stand.instruments]
    for device in stand.thermometers:
        sensors += device.drivers(clock)
    return RecordingDevices(acquisition, tuple(sensors))
