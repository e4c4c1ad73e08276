"""A measuring channel as data: what it measures, its calibration, its delay and its uncertainty.

The same facts scale a reading in the acquisition loop and, years later, the raw counts in a run file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from bufferstand.foundation.channels.calibration import (
    Calibration,
)
from bufferstand.foundation.settings import Settings, Within, WrongKeyError

Quantity = Literal[
    "force", "stroke", "position", "command", "temperature", "speed", "pressure", "acceleration"
]
"""What a channel can measure; another one is a word here and its units in :data:`CHANNEL_UNITS`."""

CHANNEL_UNITS: Mapping[Quantity, tuple[str, ...]] = {
    "force": ("kN",),
    "stroke": ("mm",),
    "position": ("mm",),
    "command": ("mm",),
    "temperature": ("°C",),
    "speed": ("mm/s",),
    "pressure": ("bar", "MPa"),
    "acceleration": ("m/s²",),
}
"""The units that a calibrated channel of each quantity can be given in."""

Span = Annotated[tuple[float, float], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]
"""A TOML array of two numbers."""


Share = Annotated[float, Field(ge=0), Within(0.0, 100.0, "an error of more than the value is no measurement")]
Error = Annotated[
    float, Field(ge=0), Within(0.0, 1000.0, "an error larger than what a stand measures is no measurement")
]


class Plausibility(Settings):
    """What a reading must keep to be believed; beyond it transducer, wire or converter has failed."""

    counts: Annotated[Span, Within(-(2.0**32), 2.0**32, "no converter here has more than 32 bits")] | None = (
        None
    )
    """Lowest and highest counts that can be: at the ends the converter is saturated or a wire is broken."""
    overload: Annotated[float, Field(gt=0), Within(0.1, 20_000.0, "no transducer here bears more")] | None = (
        None
    )
    """Largest magnitude that the transducer bears, in the channel's unit."""
    rate_per_s: Annotated[float, Field(gt=0), Within(0.1, 1e6, "no channel is slower or faster")] | None = (
        None
    )
    """Fastest change that the thing measured can make, in the channel's unit per second."""

    @model_validator(mode="after")
    def _spans(self) -> Plausibility:
        if self.counts is not None and self.counts[0] >= self.counts[1]:
            raise WrongKeyError(f"counts = {list(self.counts)} is no span; write [lowest, highest]", "counts")
        return self


class ChannelUncertainty(Settings):
    """What the certificate and the data sheet say; half-widths of limits unless named standard (``u_``)."""

    accuracy_percent: Share | None = None
    """Limit of the relative error of the value (class), % of the value."""
    reversibility_percent: Share | None = None
    """Limit of the difference rising/falling, % of the value."""
    zero: Error | None = None
    """Limit of the zero error, in the channel's unit."""
    linearity: Error | None = None
    """Limit of the smooth deviation from the straight line, in the channel's unit."""
    u_delay_s: Annotated[float, Field(ge=0), Within(0.0, 1.0, "known no better it is not known")] | None = (
        None
    )
    """Standard uncertainty of the measured delay [s]."""
    drum_circumference_mm: (
        Annotated[float, Field(gt=0), Within(1.0, 5000.0, "no drum is smaller or larger")] | None
    ) = None
    """Travel of a draw wire in one turn of its drum [mm]: part of the deviation from the straight line
    repeats with it."""
    drift: Error | None = None
    """Limit of the change of a force channel's zero during a run, in the channel's unit."""

    @model_serializer(mode="wrap")
    def _short(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only some channels have: the record of any other stays as it was."""
        content: dict[str, Any] = handler(self)
        for name in ("drum_circumference_mm", "drift"):
            if getattr(self, name) is None:
                content.pop(name, None)
        return content


class Channel(Settings):
    """One channel of a stream of samples.

    The time at which a value was true is its device time stamp minus ``delay_s`` (filter, conversion),
    which is measured for each channel.
    """

    name: str = Field(
        pattern=r"^[a-z][a-z0-9_]*$", description="small letters, digits and _, e.g. “stroke_1”"
    )
    quantity: Quantity
    """What is measured."""
    unit: str
    """Unit of the value."""
    place: str = ""
    """Where it is, for reports and messages."""
    delay_s: Annotated[
        float, Within(-0.1, 0.5, "a channel that comes later follows no cycle; 0.1 s before is another clock")
    ] = 0.0
    """Measured delay of filter and conversion: a value was true so long before its time stamp [s]."""
    calibration: Calibration = Calibration()
    """How counts become a value."""
    uncertainty: ChannelUncertainty = ChannelUncertainty()
    """Limits of its errors."""
    plausible: Plausibility | None = None
    """What the channel can show: ``counts``, ``overload``, ``rate_per_s``."""

    @model_validator(mode="after")
    def _drifts(self) -> Channel:
        if self.uncertainty.drift is not None and self.quantity != "force":
            raise WrongKeyError(
                f"uncertainty.drift is for force channels, not for {self.quantity}; leave it out",
                "uncertainty",
            )
        return self

    @model_serializer(mode="wrap")
    def _short(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what is not stated: the record of a plain channel stays as it was."""
        content: dict[str, Any] = handler(self)
        if self.plausible is None:
            content.pop("plausible", None)
        return content
