"""What a stand file says about a Modbus device that a description describes."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.drivers.acquisition.kind import AcquisitionSettings
from bufferstand.drivers.descriptions import GivenAnswers
from bufferstand.drivers.instruments import Baud, ReplyTime
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings, Within, WrongKeyError


def _as_tuple(value: object) -> object:
    if isinstance(value, dict):
        return (value,)
    return tuple(value) if isinstance(value, list) else value


class IoInput(Settings):
    """A point of the description and what is measured with it."""

    point: str = Field(min_length=1)
    """Name of the point, as the description has it."""
    channel: Channel
    """Its calibration takes the point's unit: coefficients in the channel's unit per volt, kg, °C …"""


class ModbusIoSettings(AcquisitionSettings):
    """Modbus I/O, a weighing transmitter, a gateway: whatever a description file describes."""

    own_clock: ClassVar[bool] = False

    kind: Literal["modbus-io"]
    description: str = Field(min_length=1)
    """A shipped description's name, or a path of a TOML file."""
    answers: GivenAnswers = Field(default_factory=dict)
    """What the device's documents do not say and the description asks, by its keys."""
    host: str = ""
    port: int = Field(default=502, ge=1, le=65535)
    """Of Modbus TCP."""
    serial: str = ""
    """Serial device: Modbus RTU instead."""
    baud: Baud = 19200
    parity: Literal["none", "even", "odd"] = "even"
    stop_bits: Literal[1, 2] = 1
    device_id: int = Field(default=1, ge=0, le=255)
    timeout_s: ReplyTime = 0.5
    """Longest wait for one reply [s]."""
    stamp_within_s: (
        Annotated[float, Field(gt=0.0), Within(1e-4, 5.0, "known no better it is no time of a value")] | None
    ) = None
    """Half of a poll's duration that is let pass [s]: a value is stamped with the middle of its poll. A
    slower poll is a gap. Without it a quarter of the period."""
    input: Annotated[tuple[IoInput, ...], BeforeValidator(_as_tuple)] = Field(min_length=1)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels; what is not known of the time of a poll is part of their ``u_delay_s``, where stated.

        A stamp is off by at most ``stamp_within_s``: a rectangular distribution, standard uncertainty
        a / √3 (GUM 4.3.7).
        """
        return tuple(_with_stamp_doubt(one.channel, self.stamp_half_s) for one in self.input)

    @property
    def stamp_half_s(self) -> float:
        """Half of the longest poll whose values are taken [s]."""
        return self.stamp_within_s or 0.25 / self.rate_Hz

    @model_validator(mode="after")
    def _is_somewhere(self) -> ModbusIoSettings:
        if bool(self.host) == bool(self.serial):
            raise WrongKeyError(
                "write host (and port) of Modbus TCP, or serial (and baud) of Modbus RTU"
                + (", not both" if self.host else ""),
                "host",
                "serial",
            )
        points = [one.point for one in self.input]
        for number, point in enumerate(points):
            if points.index(point) != number:
                raise WrongKeyError(
                    f"“{point}” is taken twice; give each input its own point", ("input", number, "point")
                )
        if 2.0 * self.stamp_half_s > 1.0 / self.rate_Hz:
            raise WrongKeyError(
                f"stamp_within_s = {self.stamp_half_s:g} is more than half of the period at rate_Hz = "
                f"{self.rate_Hz:g}; write {0.5 / self.rate_Hz:g} or less",
                "stamp_within_s",
                "rate_Hz",
            )
        return self


def _with_stamp_doubt(channel: Channel, half_s: float) -> Channel:
    stated_s = channel.uncertainty.u_delay_s
    if stated_s is None:
        return channel
    widened_s = math.hypot(stated_s, half_s / math.sqrt(3.0))
    doubt = channel.uncertainty.model_copy(update={"u_delay_s": widened_s})
    return channel.model_copy(update={"uncertainty": doubt})
