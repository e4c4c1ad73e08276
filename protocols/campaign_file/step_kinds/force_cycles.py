"""Cycles between two forces."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from bufferstand.foundation.settings import Within, WrongKeyError
from bufferstand.protocols.bounded_numbers import Cycles, Force, Speed, Stroke
from bufferstand.protocols.campaign_file.step_kinds.common import StepSettings
from bufferstand.protocols.steps import ForceCycles

LARGEST_TOLERANCE_PERCENT = 20.0
"""A wider one would let the cycles be others than those that were asked for."""


class ForceCyclesStep(StepSettings):
    """Load to ``force_max_kN`` at constant speed, unload to ``force_min_kN``, and so on; then release."""

    kind: Literal["force-cycles"]
    force_min_kN: Annotated[
        float, Field(ge=0), Within(0.0, 10_000.0, "a buffer cannot pull; above 10 MN is no stand")
    ]
    """Lower turn, 0 or more [kN]."""
    force_max_kN: Force
    """Upper turn; above ``force_min_kN`` by at least twice the tolerance [kN]."""
    speed_mm_per_s: Speed
    """Of the piston, both ways [mm/s]."""
    cycles: Cycles
    """The first begins at zero force."""
    stroke_limit_mm: Stroke | None = None
    """Turns here at the latest [mm]. Default: that which applies."""
    tolerance_percent: Annotated[
        float,
        Field(gt=0, le=LARGEST_TOLERANCE_PERCENT),
        Within(0.0001, LARGEST_TOLERANCE_PERCENT, "finer is below the noise, wider are other cycles"),
    ] = 2.0
    """Permitted error of a turn; at most 20. The plan notes a tolerance below 0.1 mm of the piston [% of
    ``force_max_kN``].
    """

    def motion(self, stroke_limit_mm: float) -> ForceCycles:
        """Return what the actuator does, up to the stroke limit in force [mm]."""
        return ForceCycles(
            self.force_min_kN, self.force_max_kN, stroke_limit_mm, self.speed_mm_per_s, self.cycles,
            self.tolerance_percent,
        )  # fmt: skip

    @model_validator(mode="after")
    def _forces_are_apart(self) -> Self:
        least_kN = 2.0 * 0.01 * self.tolerance_percent * self.force_max_kN
        if not self.force_max_kN > self.force_min_kN:
            raise WrongKeyError(
                f"force_max_kN = {self.force_max_kN:g} must be above force_min_kN = {self.force_min_kN:g}; "
                "force_min_kN is where it unloads to: write the smaller one there",
                "force_max_kN",
                "force_min_kN",
            )
        if self.force_max_kN - self.force_min_kN < least_kN:
            raise WrongKeyError(
                f"force_max_kN = {self.force_max_kN:g} and force_min_kN = {self.force_min_kN:g} are nearer "
                f"than twice tolerance_percent = {self.tolerance_percent:g} of force_max_kN "
                f"({least_kN:g} kN); put them further apart, or narrow the tolerance",
                "force_max_kN",
                "force_min_kN",
                "tolerance_percent",
            )
        return self
