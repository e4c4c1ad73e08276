"""A step that begins in a band of temperatures: too warm is waited for, too cold is refused or said."""

from __future__ import annotations

from collections.abc import Mapping

from bufferstand.daq.acquisition import Acquisition
from bufferstand.protocols.steps import PlannedStep, StartBand


def begins_with_a_wait(step: PlannedStep) -> bool:
    """Return whether a step waits at zero force first: a warm specimen does no harm meanwhile."""
    return step.only_waits or step.start_band is not None


def too_cold(step: PlannedStep, band: StartBand, readings_C: Mapping[str, float | None]) -> str:
    """Return which specimen sensor is below the band, and what to do; empty if none is.

    Parameters
    ----------
    step : PlannedStep
        That is to begin.
    band : StartBand
        In which it begins.
    readings_C : mapping of str to float or None
        Of every sensor that touches the specimen [°C], by its label.
    """
    for label, value_C in readings_C.items():
        if value_C is None or value_C >= band.low_C:
            continue
        remedy = "it is run all the same (too_cold = “run”)"
        if band.refuses_cold:
            middle_C = (band.low_C + band.high_C) / 2.0
            remedy = (
                f"put a step with kind = “warm-up” and temperature_C = {middle_C:g} before it, or give it "
                "too_cold = “run”"
            )
        where = f"before step {step.index} “{step.name}”"
        return f"{label} is at {value_C:.2f} °C {where}, below {band.text()}: {remedy}"
    return ""


def say_beginning(acquisition: Acquisition, band: StartBand) -> None:
    """Put into the run how warm the specimen was when the step began."""
    readings = acquisition.panel.specimen_temperatures()
    known = {label: value for label, value in readings.items() if value is not None}
    inside = all(band.low_C <= value <= band.high_C for value in known.values())
    acquisition.log.say(
        "temperature",
        f"begins at {', '.join(f'{label} {value:.2f} °C' for label, value in known.items())}, "
        f"{'within' if inside else 'outside'} {band.text()}",
        readings_C=list(known.values()),
        low_C=band.low_C,
        high_C=band.high_C,
        inside=inside,
    )
