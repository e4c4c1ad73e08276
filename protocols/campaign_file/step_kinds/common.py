"""Common parts of the kinds of steps."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.foundation.settings import Numbers, Settings, Within, WrongKeyError
from bufferstand.protocols.bounded_numbers import Cycles, Percent
from bufferstand.protocols.campaign_file.step_kinds.strokes import StrokeSettings
from bufferstand.protocols.campaign_file.step_kinds.temperatures import StepTemperatureSettings
from bufferstand.protocols.steps import Steadiness

Positive = Annotated[float, Field(gt=0)]


def as_tuple(value: object) -> object:
    """Take a TOML array for a tuple."""
    return tuple(value) if isinstance(value, list) else value


class Named(Settings):
    """What everything has that can be written as ``[[step]]``."""

    name: str = ""
    """Free text for tables and reports."""
    keep_order: bool | None = None
    """Whether ``order = "soonest"`` leaves the step in its place. Default: false for ``harmonic``,
    ``sweep`` (unless ``order = "random"``) and ``cool-down`` without a temperature range, true for all
    others.
    """


_NOT_ASKED = (
    "name", "keep_order", "purpose", "start_timeout_s", "timeout_s", "too_cold", "temperature_stop_C",
    "temperature_resume_C", "compensate",
)  # fmt: skip
"""Keys of a step that do not make it another test."""


class StepSettings(Named, StepTemperatureSettings, StrokeSettings):
    """What every step has that moves or waits."""

    def asked(self) -> dict[str, Any]:
        """Return what it asks for, by its keys: without names, waits and limits, and without defaults."""
        content = self.model_dump(mode="json", exclude=set(_NOT_ASKED), exclude_defaults=True)
        return {"kind": getattr(self, "kind", "")} | content

    def stays(self) -> bool:
        """Return whether it must stay where it is written; one that begins in a band of temperatures must."""
        if self.keep_order is not None:
            return self.keep_order
        return self.start_temperature_C is not None or self.has_its_place()

    def has_its_place(self) -> bool:
        """Return whether a step of this kind stays where it is written, unless it says otherwise.

        A sine may go anywhere; a static test, a proof load, conditioning, a hold or a user's own motion has
        its place for a reason.
        """
        return True


class UntilSteady(Settings):
    """``[step.until_steady]``: the step ends when its cycles have settled."""

    damping_percent: Percent = 1.0
    """Settled: largest less smallest damping of the window is within this share of its mean [%]."""
    stiffness_percent: Percent = 1.0
    """The same for the stiffness [%]."""
    window: Annotated[int, Field(ge=2), Within(2, 1000, "two can be compared, a thousand is no window")] = 3
    """Number of last cycles that are compared."""
    min_cycles: Cycles = 5
    """The step does not end before."""
    max_cycles: Cycles = 30
    """The step ends here at the latest."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.min_cycles < self.window:
            raise WrongKeyError(
                f"min_cycles = {self.min_cycles} is fewer than window = {self.window}: "
                f"so few cycles cannot be compared; write min_cycles = {self.window} or more",
                "min_cycles",
                "window",
            )
        if self.max_cycles < self.min_cycles:
            raise WrongKeyError(
                f"max_cycles = {self.max_cycles} must not be below min_cycles = {self.min_cycles}; "
                f"write max_cycles = {self.min_cycles} or more, or fewer min_cycles",
                "max_cycles",
                "min_cycles",
            )
        return self

    def criterion(self) -> Steadiness:
        """Return it as the plan carries it."""
        return Steadiness(**self.model_dump())


class HarmonicRateStep(StepSettings):
    """How fast a harmonic motion is: one of frequency and peak speed, v = 2π f A."""

    @staticmethod
    def exactly_one(frequency: object, speed: object) -> None:
        """Refuse both, and neither."""
        if (frequency is None) == (speed is None):
            raise WrongKeyError(
                "give exactly one of frequency_Hz and peak_speed_mm_per_s",
                "frequency_Hz",
                "peak_speed_mm_per_s",
            )


def _one_or_more(value: object) -> object:
    """Take a single number for a list of one."""
    return (value,) if isinstance(value, int | float) and not isinstance(value, bool) else value


SweepNumbers = Annotated[Numbers, Field(min_length=1), BeforeValidator(_one_or_more)]
