"""The keys of every step about temperatures: start temperature and temperature stop."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from bufferstand.foundation.settings import Settings, WrongKeyError
from bufferstand.protocols.bounded_numbers import Temperature, Timeout, bounds_of
from bufferstand.protocols.steps import StartBand


def _as_pair(value: object) -> object:
    """Take a TOML array of two for a pair; another number of entries is said in one sentence."""
    if isinstance(value, list | tuple):
        if len(value) != 2:
            raise ValueError(f"a list of {len(value)} is no band; give two temperatures, [lowest, highest]")
        return tuple(value)
    return value


class StepTemperatureSettings(Settings):
    """Keys of a step that say how warm it begins and how warm it may get."""

    start_temperature_C: (
        Annotated[tuple[float, float], BeforeValidator(_as_pair), bounds_of(Temperature)] | None
    ) = None
    """``[lowest, highest]`` for every specimen sensor at the start. Too warm: wait at zero force. The plan
    refuses a range below the air temperature. EN 15551: ``[15.0, 25.0]`` [°C].
    """
    start_timeout_s: Timeout = 7200.0
    """The campaign stops if cooling takes longer [s]."""
    too_cold: Literal["refuse", "run"] = "refuse"
    """Below the range: the plan is refused, or the campaign stops (exit status 3); put a ``warm-up`` before
    the step. ``"run"``: run nevertheless, with a record of it.
    """
    temperature_stop_C: Temperature | None = None
    """The step's own temperature stop [°C]. Default: that of ``[limits]``."""
    temperature_resume_C: Temperature | None = None
    """Its own resume threshold [°C]. Default: that of ``[limits]``."""

    @model_validator(mode="after")
    def _temperatures_fit_together(self) -> Self:
        band = self.start_temperature_C
        if band is None:
            for key in ("start_timeout_s", "too_cold"):
                if getattr(self, key) != type(self).model_fields[key].default:
                    raise WrongKeyError(
                        f"{key} has a meaning with start_temperature_C only; add that, or leave it out",
                        key,
                    )
        elif not band[0] < band[1]:
            raise WrongKeyError(
                f"start_temperature_C = [{band[0]:g}, {band[1]:g}]: the first must be below the second",
                "start_temperature_C",
            )
        return self

    def start_band(self) -> StartBand | None:
        """Return the band in which the step begins, as the plan carries it."""
        if self.start_temperature_C is None:
            return None
        low_C, high_C = self.start_temperature_C
        return StartBand(float(low_C), float(high_C), self.start_timeout_s, self.too_cold == "refuse")

    def temperatures(self) -> dict[str, Any]:
        """Return the keys that were given, for the steps that a sweep or a repetition is made of."""
        given = self.model_fields_set & StepTemperatureSettings.model_fields.keys()
        return {key: getattr(self, key) for key in sorted(given)}
