"""The temperature limits of one step: its own where it has some, else the campaign's."""

from __future__ import annotations

from bufferstand.protocols.campaign_file.step_kinds import StepSettings, WarmUpStep
from bufferstand.protocols.limits import TestLimits
from bufferstand.protocols.steps import PlannedStep


def limits_of(step: StepSettings | PlannedStep, test: TestLimits) -> TestLimits:
    """Return ``[limits]`` with the step's own thresholds of temperature.

    Parameters
    ----------
    step : StepSettings or PlannedStep
        As written, or as planned.
    test : TestLimits
        ``[limits]`` of the campaign.
    """
    own = {
        key: value
        for key in ("temperature_stop_C", "temperature_resume_C")
        if (value := getattr(step, key)) is not None
    }
    return test.model_copy(update=own) if own else test


def temperature_trouble(step: StepSettings, test: TestLimits) -> tuple[str, str] | None:
    """Return why a step's temperatures do not go together, and what to do; None if they do.

    Parameters
    ----------
    step : StepSettings
        As written.
    test : TestLimits
        ``[limits]`` of the campaign.
    """
    limits = limits_of(step, test)
    stop_C, resume_C = limits.temperature_stop_C, limits.temperature_resume_C
    if not resume_C < stop_C:
        return (
            f"temperature_resume_C = {resume_C:g} must be below temperature_stop_C = {stop_C:g}",
            "give this step both",
        )
    if isinstance(step, WarmUpStep) and step.warmth().high_C >= stop_C:
        problem = (
            f"temperature_C + band_K = {step.warmth().high_C:g} °C is not below the temperature stop of "
            f"{stop_C:g} °C, which stays a limit"
        )
        return problem, f"give this step temperature_stop_C above {step.warmth().high_C:g}"
    band = step.start_band()
    if band is not None and band.high_C >= stop_C:
        remedy = (
            f"lower the second to below {stop_C:g}, or give this step its own temperature_stop_C above "
            f"{band.high_C:g}"
        )
        return f"{band.text()} lets it begin at the temperature stop of {stop_C:g} °C", remedy
    return None
