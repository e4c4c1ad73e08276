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
    """Hold at this stroke [mm]. Without it and ``force_kN``: at zero force."""
    force_kN: Force | None = None
    """Hold where this force is reached [kN]. If ``stroke_max_mm`` comes first, it holds there."""
    duration_s: Duration
    """How long [s]."""
    approach_speed_mm_per_s: Speed = 1.0
    """With ``force_kN``: speed over the last tenth of the force [mm/s]."""
    record: bool = False
    """``true``: record as a ``static`` run."""

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
    """Until every specimen sensor is at or below this [°C]."""
    timeout_s: Timeout = 7200.0
    """The campaign stops if that takes longer [s]."""

    def has_its_place(self) -> bool:
        """Return whether it stays although the planner sets pauses of its own; it need not."""
        return False


class TouchStep(StepSettings):
    """Set stroke 0 to first contact anew: creep to a small force, take the position, back off.

    What is not given is as in ``[zero]``.
    """

    kind: Literal["touch"]
    touch_force_kN: TouchForce | None = None
    """Rise of the force at which the piston turns back [kN]. Default: that of ``[zero]``."""
    speed_mm_per_s: TouchSpeed | None = None
    """Piston speed of the touch [mm/s]. Default: that of ``[zero]``."""
