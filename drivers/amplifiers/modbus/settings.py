"""What a stand file says about an amplifier or a sensor with Modbus registers."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from bufferstand.drivers.amplifiers.settings import AmplifierSettings
from bufferstand.drivers.instruments import Baud, ReplyTime, SampleRate
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings, WrongKeyError


class RegisterSettings(Settings):
    """Registers: where they are, and the map that describes them."""

    map: str = Field(min_length=1)
    """A shipped register map's name, or a path of a TOML."""
    host: str | None = Field(default=None, min_length=1)
    """Modbus TCP; without it Modbus RTU on the amplifier's ``port``."""
    tcp_port: int = Field(default=502, ge=1, le=65535)
    """Port of Modbus TCP."""
    device_id: int = Field(default=1, ge=0, le=255)
    """Unit number."""
    timeout_s: ReplyTime = 0.2
    """Longest wait for one reply [s]."""
    parity: Literal["none", "even", "odd"] = "even"
    """Parity of the serial line."""
    stop_bits: Literal[1, 2] = 1
    """Stop bits of the serial line."""


class ModbusAmplifierSettings(AmplifierSettings):
    """An entry ``protocol = "modbus"`` of ``[[amplifier]]``."""

    protocol: Literal["modbus"]
    """The kind."""
    modbus: RegisterSettings
    """Its registers: map and connection."""

    @model_validator(mode="after")
    def _somewhere(self) -> ModbusAmplifierSettings:
        _demand_place(self)
        return self


class ModbusSensorSettings(Settings):
    """An entry ``kind = "modbus"`` of ``[[sensor]]``: a sensor of any quantity behind registers."""

    kind: Literal["modbus"]
    """The kind."""
    port: str = ""
    """Serial device; none for Modbus TCP."""
    baud: Baud = 38400
    """Speed of the serial line."""
    rate_Hz: SampleRate
    """Values a second that it is asked for."""
    channel: Channel
    """What it measures."""
    modbus: RegisterSettings
    """Its registers: map and connection."""

    @model_validator(mode="after")
    def _somewhere(self) -> ModbusSensorSettings:
        _demand_place(self)
        return self


RegisterEntry = ModbusAmplifierSettings | ModbusSensorSettings


def _demand_place(settings: RegisterEntry) -> None:
    if not settings.port and settings.modbus.host is None:
        raise WrongKeyError("port must name the serial device", "port")
