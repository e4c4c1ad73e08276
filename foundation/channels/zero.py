"""The zero of a specimen on a stand, as data: what the channels read at first contact, unloaded.

It is subtracted last, as the channel's tare, so that strokes count from first contact and forces from rest.
It is found by touching off (the piston creeps to a small force and back) or by a tare (what is read at rest,
nothing moves), and travels in every run with its uncertainty.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.settings import (
    FIGURE,
    FORCE_KN,
    SIGNED_FORCE_KN,
    SPEED_MM_PER_S,
    Moment,
    Settings,
    WrongKeyError,
)

How = Literal["touch", "tare"]


class ChannelZero(Settings):
    """What one channel reads at the zero."""

    name: str
    unit: str
    value: Annotated[float, FIGURE]
    """Subtracted from the calibrated value."""
    u: Annotated[float, Field(ge=0), FIGURE]
    """Standard uncertainty of the zero so set, the limit that the certificate states for it included."""


class Touch(Settings):
    """How the touch went."""

    speed_mm_per_s: Annotated[float, SPEED_MM_PER_S]
    touch_force_kN: Annotated[float, SIGNED_FORCE_KN]
    """Force over that at rest at which it turned back."""
    peak_force_kN: Annotated[float, SIGNED_FORCE_KN]
    """Greatest force over that at rest."""
    position_mm: Annotated[float, FIGURE]
    """Piston position of first contact, on the controller's scale."""
    u_position_mm: Annotated[float, Field(ge=0), FIGURE]
    """Standard uncertainty of the place of the contact by the fit alone."""
    stiffness_kN_per_mm: Annotated[float, FIGURE]
    """Of the first rise of the force over the piston's way: frame and specimen in series."""
    rest_force_kN: Annotated[float, SIGNED_FORCE_KN]
    noise_kN: Annotated[float, Field(ge=0), FORCE_KN]
    """Standard deviation of the force at rest."""


class Zero(Settings):
    """A zero that was found: for the run file, and for the stand's zero file."""

    how: How
    found: Moment
    taken_over: bool = False
    """Whether it was found before this start of the campaign."""
    specimen: str = ""
    """Id of the specimen that was in the stand; empty where it was not said."""
    operator: str = ""
    channel: Annotated[
        tuple[ChannelZero, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
    ]
    touch: Touch | None = None

    @model_validator(mode="after")
    def _each_once(self) -> Zero:
        names = [one.name for one in self.channel]
        if len(set(names)) < len(names):
            raise WrongKeyError("a channel has two zeros", "channel")
        if (self.how == "touch") != (self.touch is not None):
            raise WrongKeyError(
                "a zero that was touched off states how the touch went, and no other does", "how", "touch"
            )
        return self

    def of(self, name: str) -> ChannelZero | None:
        """Return the zero of a channel; None where it has none."""
        return next((one for one in self.channel if one.name == name), None)

    def value(self, name: str) -> float:
        """Return what is subtracted from a channel, 0 where it has no zero."""
        found = self.of(name)
        return 0.0 if found is None else found.value

    def apply(self, channel: Channel) -> Channel:
        """Return the channel with this zero as part of its tare, and the zero's limit as its own.

        The limit is that of a rectangular error with the same standard deviation, √3 u, rounded up to two
        digits.
        """
        found = self.of(channel.name)
        if found is None:
            return channel
        calibration = channel.calibration.model_copy(update={"tare": channel.calibration.tare + found.value})
        uncertainty = channel.uncertainty.model_copy(update={"zero": rounded_up(math.sqrt(3.0) * found.u)})
        return channel.model_copy(update={"calibration": calibration, "uncertainty": uncertainty})

    def document(self) -> dict[str, Any]:
        """Return it for the run's metadata."""
        content = self.model_dump(mode="json")
        if self.touch is None:
            content.pop("touch")
        return content

    def sentence(self) -> str:
        """Return it as a person says it: each channel with U (k = 2)."""
        parts = [
            f"{one.name} {one.value:+.3f} ± {2.0 * one.u:.3f} {one.unit}"
            for one in self.channel
            if one.name != "command"
        ]
        return ", ".join(parts)


def rounded_up(value: float) -> float:
    """Return a limit with two significant digits, never a smaller one."""
    if value <= 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.ceil(value / step - 1e-9) * step, 12)
