"""What a stand file says about an amplifier, or a sensor, that speaks lines."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from bufferstand.drivers.amplifiers.settings import AmplifierSettings
from bufferstand.drivers.descriptions import GivenAnswers
from bufferstand.drivers.instruments import Baud, SampleRate, demand_port
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings


class LineTable(Settings):
    """How it speaks."""

    description: str = Field(min_length=1)
    """A shipped description's name, or a path of a TOML file."""
    answers: GivenAnswers = Field(default_factory=dict)
    """What the description asks, by its keys."""
    parity: Literal["none", "even"] = "none"
    """Parity of the serial line."""


class AsciiLineSettings(AmplifierSettings):
    """An entry ``protocol = "ascii-line"`` of ``[[amplifier]]``."""

    protocol: Literal["ascii-line"]
    """The kind."""
    line: LineTable
    """Its description and the answers to it."""

    @model_validator(mode="after")
    def _on_a_line(self) -> AsciiLineSettings:
        demand_port(self)
        return self


class AsciiLineSensorSettings(Settings):
    """An entry ``kind = "ascii-line"`` of ``[[sensor]]``: a sensor of any quantity that speaks lines."""

    kind: Literal["ascii-line"]
    """The kind."""
    port: str = ""
    """Serial device."""
    baud: Baud = 9600
    """Speed of the serial line."""
    rate_Hz: SampleRate
    """Values a second that it sends, or is asked for."""
    channel: Channel
    """What it measures."""
    line: LineTable
    """Its description and the answers to it."""

    @model_validator(mode="after")
    def _on_a_line(self) -> AsciiLineSensorSettings:
        demand_port(self)
        return self


LineEntry = AsciiLineSettings | AsciiLineSensorSettings
