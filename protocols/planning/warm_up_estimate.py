"""The expected course of a warm-up: its duration, or why it cannot end."""

from __future__ import annotations

from bufferstand.foundation import counted, duration_text
from bufferstand.protocols.campaign_file.step_kinds import WarmUpStep
from bufferstand.protocols.planning.heating import Walk
from bufferstand.protocols.steps import Heating

SENSOR_STEP_K = 0.0625
"""What a DS18B20 tells apart at 12 bit [K]."""
MODEL_FACTOR = 2.0
"""By so much at most a model's heat is believed to be wrong: capacities are known to some 40 %."""
_REACHED_K = 0.01
"""A wait is found to a millionth of its time; so near its end it has come there [K]."""


def never_warm(
    step: WarmUpStep, walk: Walk, begins_C: float, ambient_C: float, *, knows_heat: bool
) -> tuple[str, str] | None:
    """Return why a warm-up cannot end, and what to do; None where it can, as far as is known.

    Parameters
    ----------
    step : WarmUpStep
        As written.
    walk : Walk
        What the heat law expects of it.
    begins_C : float
        The sensor as it begins [°C].
    ambient_C : float
        The air [°C].
    knows_heat : bool
        Whether temperatures can be predicted.
    """
    warmth = step.warmth()
    if begins_C > warmth.high_C and warmth.high_C < ambient_C:
        problem = (
            f"waiting never cools the specimen from {begins_C:.1f} °C to {warmth.low_C:g} … "
            f"{warmth.high_C:g} °C: the air has {ambient_C:g} °C"
        )
        above = f"give it a temperature_C above {ambient_C:g}"
        return problem, f"{above}, or correct ambient_C or specimen_C of [conditions]"
    if not knows_heat:
        return None
    highest_C = max(walk.highest.mass_C, walk.end.sensor_C)  # a sensor shows later what the spring has
    if MODEL_FACTOR * (highest_C - begins_C) < warmth.low_C - begins_C and not walk.ended:
        problem = (
            f"by the model the spring only comes to {highest_C:.1f} °C in {walk.cycles:.0f} cycles, not half "
            f"the way from {begins_C:.1f} °C to {warmth.low_C:g} °C"
        )
        return problem, "cycle with more amplitude or faster, or raise max_cycles"
    lasts_s = sum(one.duration_s for one in walk.estimates)
    if lasts_s > MODEL_FACTOR * step.timeout_s:
        return (
            f"by the model it takes {duration_text(lasts_s)}, more than twice timeout_s = {step.timeout_s:g}",
            "cycle with more amplitude or faster, or raise timeout_s",
        )
    return None


def warm_up_notes(step: WarmUpStep, walk: Walk, heating: Heating | None, *, knows_heat: bool) -> list[str]:
    """Return what the user should know of a warm-up before it begins; parameters as :func:`never_warm`.

    Parameters
    ----------
    heating : Heating or None
        What the model says of its cycles.
    """
    warmth = step.warmth()
    notes = [note] if (note := _duration_note(step, walk, knows_heat=knows_heat)) else []
    if warmth.band_K < SENSOR_STEP_K:
        notes.append(
            f"band_K = {warmth.band_K:g} is less than the sensors tell apart (steps of "
            f"{SENSOR_STEP_K:g} K): a reading may never lie in {warmth.low_C:g} … {warmth.high_C:g} °C"
        )
    if heating is not None and heating.least_K is not None and heating.least_K > 2.0 * warmth.band_K:
        notes.append(
            f"the shortest go of cycles heats by {heating.least_K:.2f} K, more than the band of "
            f"{2.0 * warmth.band_K:g} K is wide: it overshoots and waits to cool; cycle more gently"
        )
    return notes


def _duration_note(step: WarmUpStep, walk: Walk, *, knows_heat: bool) -> str:
    """Return how many cycles it should take, or that these may be too many; empty if none."""
    warmth = step.warmth()
    band = f"{warmth.low_C:g} … {warmth.high_C:g} °C"
    if not knows_heat:
        return (
            f"nobody states the specimen's heat: how many cycles it takes to {band} is not known; at most "
            f"{step.max_cycles}"
        )
    highest_C = max(walk.highest.sensor_C, walk.end.sensor_C)
    if highest_C < warmth.low_C - _REACHED_K:
        return (
            f"by the model the sensor only comes to {highest_C:.1f} °C in {walk.cycles:.0f} cycles, not to "
            f"{warmth.low_C:g} °C; cycle with more amplitude or faster, or raise max_cycles"
        )
    if sum(one.duration_s for one in walk.estimates) > step.timeout_s:
        return f"takes longer by the model than timeout_s = {step.timeout_s:g}"
    if walk.cycles > 0.0:
        cycles = f"about {counted(round(walk.cycles), 'cycle')}"
        return (
            f"{cycles} and {duration_text(walk.expected_duration_s)} to {band}, by the "
            "model, with the rest in which the sensor becomes even with the spring"
        )
    return ""
