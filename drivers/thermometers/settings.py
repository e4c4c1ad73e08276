"""What a stand file says about thermometers, whatever their kind: a device, its sensors, and their roles."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from bufferstand.drivers.instruments import SensorDelay, SensorPeriod
from bufferstand.foundation.channels import Calibration, Channel, ChannelUncertainty
from bufferstand.foundation.settings import Settings, WrongKeyError


class ThermometerSensor(Settings):
    """One sensor and where it sits; a kind adds the key by which its device knows it."""

    ADDRESS: ClassVar[str]
    """Name of that key; its field has ``examples``, three for the contract suite."""

    name: str = Field(pattern=r"^temperature_[1-9][0-9]*$", description="e.g. “temperature_1”")
    place: str = Field(min_length=1)
    """Where it is, for reports and messages."""
    role: Literal["specimen", "ambient"] = "specimen"
    """Whether it is on the specimen, and stops the stand, or in the air."""
    delay_s: SensorDelay = 0.0
    """Measured delay of filter and conversion: a value was true so long before its time stamp [s]."""
    calibration: Calibration
    """How counts become a value."""
    uncertainty: ChannelUncertainty = ChannelUncertainty()
    """Limits of its errors."""

    @model_validator(mode="after")
    def _is_a_channel(self) -> ThermometerSensor:
        if self.uncertainty.drift is not None:
            raise WrongKeyError(
                "uncertainty.drift is for force channels, not for temperature; leave it out", "uncertainty"
            )
        return self

    @property
    def address(self) -> str:
        """By which its device knows it."""
        return str(getattr(self, self.ADDRESS))

    @property
    def device(self) -> str:
        """What it is, for the run file."""
        return f"{self.ADDRESS} {self.address}"

    def channel(self) -> Channel:
        """Return the sensor as the one channel of its stream."""
        return Channel(
            name=self.name,
            quantity="temperature",
            unit="°C",
            place=self.place,
            delay_s=self.delay_s,
            calibration=self.calibration,
            uncertainty=self.uncertainty,
        )


class ThermometerSettings(Settings):
    """A device of thermometers; a kind narrows ``kind`` to its name and ``sensor`` to its sensors."""

    kind: str
    """The kind."""
    period_s: SensorPeriod = 1.0
    """Time between two readings of a sensor [s]."""
    sensor: tuple[ThermometerSensor, ...] = Field(min_length=1)
    """``[[temperature.sensor]]``: its sensors."""

    @field_validator("sensor", mode="before")
    @classmethod
    def _as_tuple(cls, value: object) -> object:
        return tuple(value) if isinstance(value, list) else value

    @model_validator(mode="after")
    def _all_different(self) -> ThermometerSettings:
        for what in (self.sensor[0].ADDRESS, "name", "place"):
            values = [getattr(sensor, what) for sensor in self.sensor]
            for number, value in enumerate(values):
                if value in values[:number]:
                    raise WrongKeyError(
                        f"two sensors have the {what} “{value}”; give each its own", ("sensor", number, what)
                    )
        return self
