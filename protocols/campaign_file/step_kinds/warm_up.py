"""Cycles until the specimen is warm."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from bufferstand.foundation.settings import Within, WrongKeyError
from bufferstand.protocols.bounded_numbers import Cycles, Pause, Temperature, Timeout
from bufferstand.protocols.campaign_file.step_kinds.cyclic import SineOrSlow
from bufferstand.protocols.prediction import LOOK_S
from bufferstand.protocols.steps import Warmth


class WarmUpStep(SineOrSlow):
    """Cycle until the specimen sensors are within ``temperature_C`` ± ``band_K``, and wait for the rest."""

    kind: Literal["warm-up"]
    temperature_C: Temperature
    """Target; with the band it must be below the step's temperature stop [°C]."""
    band_K: Annotated[
        float, Field(gt=0), Within(0.01, 20.0, "thermometers resolve 0.06 K, and 20 K off is not warm")
    ] = 2.0
    """Tolerance ±; the plan warns below 0.0625 K, the step of a DS18B20 [K]."""
    sensors: Literal["every", "any"] = "every"
    """``"every"`` specimen sensor must be within the band, or ``"any"`` of them."""
    max_cycles: Cycles = 500
    """The campaign stops if it is not warm by then."""
    soak_s: Pause = 0.0
    """Rest at zero force before each check [s]."""
    timeout_s: Timeout = 7200.0
    """The campaign stops if it is not warm after this time, all rests included [s]."""

    @model_validator(mode="after")
    def _there_is_time(self) -> Self:
        if self.timeout_s <= self.soak_s + LOOK_S:
            raise WrongKeyError(
                f"timeout_s = {self.timeout_s:g} is no longer than what it rests in any case: soak_s = "
                f"{self.soak_s:g}, and {LOOK_S:g} s in which it looks; raise timeout_s, or shorten soak_s",
                "timeout_s",
                "soak_s",
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
