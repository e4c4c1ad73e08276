"""What a stand file says of an RMC: table ``[controller.rmc]``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from bufferstand.drivers.controllers.rmc.addresses import MODELS, VARIABLES_THERE, parse_address
from bufferstand.drivers.controllers.rmc.program import VARIABLES_USED
from bufferstand.foundation.settings import Settings, WrongKeyError


class ChangeCodes(Settings):
    """By which numbers Change Target Parameter (80) knows amplitude, offset, and a ramp over cycles.

    RMCTools shows them in its list of the command's parameters; the pages that were read do not.
    """

    amplitude: Annotated[int, Field(ge=0, le=20)]
    """Code of the amplitude."""
    offset: Annotated[int, Field(ge=0, le=20)]
    """Code of the offset."""
    ramp_cycles: Annotated[int, Field(ge=0, le=20)]
    """Cycles over which the change goes."""


class RmcSettings(Settings):
    """An RMC75 or RMC150 with the watchdog program; what its documents leave open has no default."""

    model: Literal["rmc75", "rmc150"]
    """``rmc75`` or ``rmc150``."""
    axis: Annotated[int, Field(ge=0, le=15)]
    """The position axis, in mm, compression positive, 0 at first contact."""
    plot: Annotated[int, Field(ge=0, le=7)]
    """Its data sets are what the register profile samples, in that order."""
    word_order: Literal["big", "little"]
    """Which word of 32 bits comes first; a setting of the controller. A wrong one is seen at connect."""
    variables: Annotated[int, Field(ge=0, le=VARIABLES_THERE - VARIABLES_USED)]
    """First of the variables that the watchdog program uses."""
    force: str
    """Register of the force in kN, e.g. ``%MD9.8``."""
    stroke: str | None = None
    """Register of the stroke in mm; the axis' position without it."""
    clear_mm: Annotated[float, Field(ge=-50.0, le=0.0)]
    """Where the piston is clear of the specimen: a release goes there [mm]."""
    acceleration_mm_per_s2: Annotated[float, Field(ge=10.0, le=100_000.0)]
    """With which moves begin and end, and stops are made [mm/s²]."""
    largest_read: Annotated[int, Field(ge=21, le=125)] = 125
    """Registers of the largest read that it answers; more than Modbus allows is not tried."""
    enable_value: Annotated[int, Field(ge=0, le=1)] = 1
    """Parameter of Enable/Disable Axis (97) that enables; the other one disables. Seen at the status bit."""
    change: ChangeCodes | None = None
    """Without it a running sine is not changed."""

    @model_validator(mode="after")
    def _registers(self) -> RmcSettings:
        if self.axis >= MODELS[self.model].axes:
            raise WrongKeyError(f"an {self.model} has axes 0 to {MODELS[self.model].axes - 1}", "axis")
        for key in ("force", "stroke"):
            text = getattr(self, key)
            try:
                if text is not None:
                    parse_address(text)
            except ValueError as error:
                raise WrongKeyError(str(error), key) from None
        return self
