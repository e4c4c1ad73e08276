"""Cycles until the specimen is warm."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from protocols.evenness import LOOK_S
from protocols.kinds.common import Positive
from protocols.kinds.cyclic import SineOrSlow
from protocols.steps import Warmth


class WarmUpStep(SineOrSlow):
    """Cycle until the specimen sensors are within ``temperature_C`` ± ``band_K``, and wait for the rest."""

    kind: Literal["warm-up"]
    temperature_C: float
    band_K: Positive = 2.0
    sensors: Literal["every", "any"] = "every"
    max_cycles: int = Field(default=500, gt=0, le=100_000)
    soak_s: float = Field(default=0.0, ge=0)
    timeout_s: Positive = 7200.0

    @model_validator(mode="after")
    def _there_is_time(self) -> Self:
        if self.timeout_s <= self.soak_s + LOOK_S:
            raise ValueError(
                f"timeout_s = {self.timeout_s:g} is no longer than what it rests in any case: soak_s = "
                f"{self.soak_s:g}, and {LOOK_S:g} s in which it looks; raise timeout_s, or shorten soak_s"
            )
        return self

    def most_cycles(self) -> int:
        """Return how many cycles it can have."""
        return self.max_cycles

    def what(self) -> str:
        """Return what a person calls it."""
        return "warm-up"

    def warmth(self) -> Warmth:
        """Return when it is over, as the plan carries it."""
        return Warmth(self.temperature_C, self.band_K, self.sensors == "every", self.timeout_s)
