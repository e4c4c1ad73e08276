"""The table ``[simulation.miswired]``: which wire of the simulated stand is wrong, how, and from when on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, field_validator

from bufferstand.foundation.settings import Settings

SLOWEST_S = 60.0
"""Longest delay that a signal can be given [s]: so much of it is kept."""
_Moment = Annotated[float, Field(ge=0.0, le=1e7)]
_Scale = Annotated[float, Field(ge=-1e4, le=1e4)]
_Shift = Annotated[float, Field(ge=-1e4, le=1e4)]


class MiswiredSignal(Settings):
    """A signal that arrives wrong; the keys act in the order in which they stand here."""

    from_s: _Moment = 0.0
    """Stand time from which on delay, low pass, scale and zero are wrong [s]."""
    delay_s: float = Field(default=0.0, ge=0.0, le=SLOWEST_S)
    """So much later than it should [s]: a filter of the amplifier, a wrong number in the stand file."""
    low_pass_Hz: float | None = Field(default=None, gt=0.0, le=1e4)
    """Corner of a first-order low pass that should not be there."""
    scale: _Scale = 1.0
    """Its value is multiplied by this: −1 is the wrong sign, 0.1 a tenth, 4.448 kN taken for 1000 lbf."""
    zero: _Shift = 0.0
    """And this is added, in the channel's unit."""
    frozen_at_s: _Moment | None = None
    """From here on it stays as it is [s]: an unhooked wire, a connection that hangs."""

    @field_validator("scale")
    @classmethod
    def _not_nothing(cls, scale: float) -> float:
        if scale == 0.0:
            raise ValueError("a scale of 0 is no signal; write frozen_at_s for one that stands still")
        return scale


class MiswiredForce(MiswiredSignal):
    """The controller's force."""

    reads: Literal["stroke_1", "stroke_2", "stroke_3", "stroke_4", "position", "command"] | None = None
    """Its input has the value of another channel: mm are taken for kN."""
    controller_too: bool = True
    """Whether the controller itself acts on the wrong force, too (the cell is wired wrong), or only the
    computer reads it so (a wrong number in its stand file)."""


class MiswiredStroke(MiswiredSignal):
    """A draw wire, or the piston's encoder as the computer reads it; the position loop has the true one."""

    reads: Literal["force", "stroke_1", "stroke_2", "stroke_3", "stroke_4", "position", "command"] | None = (
        None
    )
    """Its input has the value of another channel; kN are taken for mm."""
    slip_mm: _Shift = 0.0
    """By so much it slips at once …"""
    slip_at_s: _Moment | None = None
    """… at this stand time [s]."""


class MiswiredThermometer(Settings):
    """A temperature sensor that does not sit where the stand file says."""

    feels: Literal["specimen", "ambient"] | None = None
    """What it feels in truth: ``ambient`` for one that was never attached, ``specimen`` for the room's that
    was; both for two that were swapped."""
    falls_off_at_s: _Moment | None = None
    """From here on it hangs in the air [s] …"""
    falls_s: float = Field(default=15.0, gt=0.0, le=1e4)
    """… and follows it with this time constant [s]."""
    frozen_at_s: _Moment | None = None
    """From here on it stays as it is [s]."""
    scale: _Scale = 1.0
    """What it shows in °C is multiplied by this: 1.8 with ``zero = 32`` is °F."""
    zero: _Shift = 0.0
    """And this is added [K]."""


class Miswired(Settings):
    """Everything about a simulated stand that is wired wrong; nothing where it is left out."""

    force: MiswiredForce = MiswiredForce()
    amplifier: MiswiredSignal = MiswiredSignal()
    """The second force."""
    stroke_1: MiswiredStroke = MiswiredStroke()
    stroke_2: MiswiredStroke = MiswiredStroke()
    stroke_3: MiswiredStroke = MiswiredStroke()
    stroke_4: MiswiredStroke = MiswiredStroke()
    position: MiswiredStroke = MiswiredStroke()
    thermometer: Mapping[str, MiswiredThermometer] = Field(default_factory=dict)
    """By the sensor's name: ``[simulation.miswired.thermometer.temperature_1]``."""
