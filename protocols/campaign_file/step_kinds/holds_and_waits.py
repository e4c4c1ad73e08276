"""Steps in which hardly anything moves: holds, waits for cooling, and touching off."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from bufferstand.foundation.settings import WrongKeyError
from bufferstand.protocols.bounded_numbers import Duration, Force, Speed, Stroke, Temperature, Timeout
from bufferstand.protocols.campaign_file.step_kinds.common import StepSettings
from bufferstand.protocols.campaign_file.zero_table import TouchForce, TouchSpeed


class HoldStep(StepSettings):
    """Stand still: at a stroke, where a force is reached, or (without either) at zero force."""

    kind: Literal["hold"]
    stroke_mm: Stroke | None = None
    force_kN: Force | None = None
    duration_s: Duration
    approach_speed_mm_per_s: Speed = 1.0
    record: bool = False

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.stroke_mm is not None and self.force_kN is not None:
            raise WrongKeyError(
                "give stroke_mm or force_kN, not both: it stands still at one place", "stroke_mm", "force_kN"
            )
        if self.force_kN is None and "approach_speed_mm_per_s" in self.model_fields_set:
            raise WrongKeyError(
                "approach_speed_mm_per_s has a meaning with force_kN only; leave it out",
                "approach_speed_mm_per_s",
                "force_kN",
            )
        return self


class CoolDownStep(StepSettings):
    """Wait at zero force until every specimen sensor is at or below ``temperature_C``."""

    kind: Literal["cool-down"]
    temperature_C: Temperature
    timeout_s: Timeout = 7200.0

    def has_its_place(self) -> bool:
        """Return whether it stays although the planner sets pauses of its own; it need not."""
        return False


class TouchStep(StepSettings):
    """Set stroke 0 to first contact anew: creep to a small force, take the position, back off.

    What is not given is as in ``[zero]``.
    """

    kind: Literal["touch"]
    touch_force_kN: TouchForce | None = None
    speed_mm_per_s: TouchSpeed | None = None
