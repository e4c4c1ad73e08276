"""Why a cycle has no temperature, in words."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.quantities.temperature.coverage import longest_hole, readings_of
from bufferstand.evaluation.record import Temperature


def why_no_temperature(
    temperatures: Sequence[Temperature], start_s: float, end_s: float, interval_s: float
) -> str:
    """Return why the sensors on the specimen do not tell the temperature of a cycle.

    Parameters
    ----------
    temperatures : sequence of Temperature
    start_s, end_s : float
        Of the cycle.
    interval_s : float
        How far readings may be from each other to cover it [s].
    """
    sensors = [sensor for sensor in temperatures if sensor.role == "specimen"]
    holes = [
        (sensor, hole)
        for sensor in sensors
        if (hole := longest_hole(readings_of(sensor)[0], start_s, end_s)) is not None
    ]
    if not sensors:
        return "no sensor on the specimen is on record"
    if not holes:
        return "the sensors on the specimen have no valid reading"
    best, hole = min(holes, key=lambda one: one[1].length_s)
    return f"{best.name} has {hole.text(interval_s)}"
