"""What a stand file says about a measuring amplifier, besides what all of them have: one table a protocol."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from bufferstand.drivers.stand_file.bounded_numbers import ReplyTime
from bufferstand.foundation.settings import Settings, Within, WrongKeyError

BITS_16, BITS_24 = (-0x8000, 0x7FFF), (-0x800000, 0x7FFFFF)
"""Counts of converters of so many bits."""
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


class AedSettings(Settings):
    """HBM AED (AD101B, AD104): how it answers, and what is set in it."""

    output: Annotated[int, Within(0, 12, "the numbers of the output formats")] = 8
    """Number of the output format (command COF): 0, 2, 4, 6, 8, 12 binary; 1, 3, 9, 11 text."""
    address: int | None = Field(default=None, ge=0, le=89)
    """Address on a bus of several (command S..); the amplifier is asked for each value then."""
    parity: Literal["none", "even"] = "even"
    top_rate_Hz: Annotated[float, Field(gt=0), Within(1.0, 100_000.0, "no AED is slower or faster")] = 100.0
    """Values a second at ICR 0: 100 for an AD104, 600 for an AD101B; each further ICR halves it."""
    net: bool = False
    """Whether the tare value is subtracted in the amplifier (TAS0); gross (TAS1) otherwise."""
    checksum: bool = False
    """Whether the status byte is replaced by a checksum (CSM1)."""

    @model_validator(mode="after")
    def _fits(self) -> AedSettings:
        if self.output not in {0, 1, 2, 3, 4, 6, 8, 9, 11, 12}:
            raise WrongKeyError(
                "output must be 0, 1, 2, 3, 4, 6, 8, 9, 11 or 12 (COF without its additions)", "output"
            )
        if self.checksum and self.output not in {8, 12}:
            raise WrongKeyError("a checksum needs the output format 8 or 12", "checksum", "output")
        return self

    @property
    def bytes_per_value(self) -> int:
        """Bytes on the wire for one value in continuous output."""
        return {0: 4, 4: 4, 8: 4, 12: 4, 2: 2, 6: 2, 1: 13, 3: 10, 9: 17, 11: 14}[self.output]

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest count that a value can have."""
        return BITS_16 if self.output in {2, 6} else BITS_24


class ModbusAmplifierSettings(Settings):
    """An amplifier with registers: where it is, and the map that describes it."""

    map: str = Field(min_length=1)
    """A shipped register map's name, or a path of a TOML."""
    host: str | None = Field(default=None, min_length=1)
    """Modbus TCP; without it Modbus RTU on the amplifier's ``port``."""
    tcp_port: int = Field(default=502, ge=1, le=65535)
    device_id: int = Field(default=1, ge=0, le=255)
    timeout_s: ReplyTime = 0.2
    parity: Literal["none", "even", "odd"] = "even"
    stop_bits: Literal[1, 2] = 1
