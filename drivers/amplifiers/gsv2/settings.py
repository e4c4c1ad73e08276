"""What a stand file says about a GSV-2."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from bufferstand.drivers.amplifiers.settings import BITS_16, BITS_24, AmplifierSettings
from bufferstand.drivers.instruments import demand_port, demand_rate
from bufferstand.foundation.settings import Settings, WrongKeyError

TEXT_LINE_BYTES = 14
"""Longest line of a GSV-2 in text format that is reckoned with."""


class Gsv2Settings(Settings):
    """ME GSV-2: the form of its stream, and what is set in it."""

    frame: Literal["binary5", "binary3", "text"] = "binary5"
    """24-bit values with a status byte, 16-bit values, or lines of text."""
    set_up: bool = False
    """Set the form of the stream and the data rate in the amplifier; else they are only compared."""
    rate_code: int | None = Field(default=None, ge=0, le=0xFFFF)
    """The two parameter bytes of “set frequency” (0x12) for ``rate_Hz``, by the amplifier's manual."""
    decimals: int = Field(default=4, ge=0, le=7)
    """Digits behind the point of the text format; counts are the digits without it."""

    @model_validator(mode="after")
    def _fits(self) -> Gsv2Settings:
        if self.rate_code is not None and not self.set_up:
            raise WrongKeyError("rate_code is only sent with set_up = true", "rate_code", "set_up")
        return self

    @property
    def bytes_per_value(self) -> int:
        """Bytes on the wire for one value."""
        return {"binary5": 5, "binary3": 3, "text": TEXT_LINE_BYTES}[self.frame]

    @property
    def ends(self) -> tuple[float, float] | None:
        """Least and greatest count that a value can have; None of text, which has what is set in it."""
        return {"binary5": BITS_24, "binary3": BITS_16, "text": None}[self.frame]


class Gsv2AmplifierSettings(AmplifierSettings):
    """An entry ``protocol = "gsv2"``."""

    protocol: Literal["gsv2"]
    """The kind."""
    gsv2: Gsv2Settings = Gsv2Settings()
    """Its own settings."""

    @model_validator(mode="after")
    def _on_a_line(self) -> Gsv2AmplifierSettings:
        demand_port(self)
        demand_rate(self, 10, self.gsv2.bytes_per_value)
        return self
