"""What a stand file says about an AED."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from bufferstand.drivers.amplifiers.settings import BITS_16, BITS_24, AmplifierSettings
from bufferstand.drivers.instruments import demand_port, demand_rate
from bufferstand.foundation.settings import Settings, Within, WrongKeyError


class AedSettings(Settings):
    """HBM AED (AD101B, AD104): how it answers, and what is set in it."""

    output: Annotated[int, Within(0, 12, "the numbers of the output formats")] = 8
    """Number of the output format (command COF): 0, 2, 4, 6, 8, 12 binary; 1, 3, 9, 11 text."""
    address: int | None = Field(default=None, ge=0, le=89)
    """Address on a bus of several (command S..); the amplifier is asked for each value then."""
    parity: Literal["none", "even"] = "even"
    """Parity of the serial line."""
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


class AedAmplifierSettings(AmplifierSettings):
    """An entry ``protocol = "aed"``."""

    protocol: Literal["aed"]
    """The kind."""
    aed: AedSettings = AedSettings()
    """Its own settings."""

    @model_validator(mode="after")
    def _on_a_line(self) -> AedAmplifierSettings:
        demand_port(self)
        demand_rate(self, 11 if self.aed.parity == "even" else 10, self.aed.bytes_per_value)
        return self
