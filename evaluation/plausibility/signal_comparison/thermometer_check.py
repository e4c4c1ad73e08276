"""Checks of the thermometers: those on the specimen follow its heat, and do not cool as fast as air.

Rubber and elastomer cool over hours (a buffer of tens of kilograms: time constants beyond half an hour), a
bare DS18B20 in air within a quarter of a minute.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.facts import Finding, FindingKind
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SENSOR, doubt
from bufferstand.evaluation.record import Temperature
from bufferstand.foundation.numbers import median

FALL_S = 45.0
"""A sensor that falls off comes down in so long …"""
FALL_SHARE, FALL_K = 0.3, 2.0
"""… by this share of what it was above the air (a time constant of two minutes), and at least so much [K]."""
ALONE_K = 6.0
"""… and this where no thermometer shows the air [K]."""
LEAST_RISE_K = 4.0
"""Less than this that should have come tells nothing [K]."""
FOLLOWS = 0.2
"""A sensor that rises by less than this share of what should have come does not follow."""
AS_MUCH = 0.5
"""The room's rises by this share of it: it sits on the specimen."""
_FEWEST = 4
_BEGUN = 0.1


def thermometers(look: RunView) -> list[Finding]:
    """Return which thermometers do not sit where the stand file says.

    Parameters
    ----------
    look : Look
    """
    sensors = [sensor for sensor in look.record.temperatures if sensor.temperature_C.size >= _FEWEST]
    on_it = [sensor for sensor in sensors if sensor.role == "specimen"]
    in_air = [sensor for sensor in sensors if sensor.role == "ambient"]
    found = [finding for sensor in on_it if (finding := _falls(look, sensor, in_air)) is not None]
    fallen = {finding.channel for finding in found}
    return found + _does_not_follow(look, [s for s in on_it if s.name not in fallen], in_air)


def _falls(look: RunView, sensor: Temperature, in_air: Sequence[Temperature]) -> Finding | None:
    """Return where a sensor falls as only one does that hangs in the air."""
    time_s, shown_C = _smoothed(sensor)
    if time_s.size < _FEWEST:
        return None
    air_C = median(np.concatenate([s.temperature_C for s in in_air])) if in_air else float("-inf")
    after = np.clip(np.searchsorted(time_s, time_s + FALL_S, side="right") - 1, 0, time_s.size - 1)
    falls = shown_C - shown_C[after]
    above_K = shown_C - air_C if in_air else np.full(falls.size, ALONE_K / FALL_SHARE)
    limit = np.maximum(FALL_K if in_air else ALONE_K, FALL_SHARE * above_K)
    if not np.any(falls > limit):
        return None
    at = int(np.argmax(falls > limit))
    size = float(falls[at])
    at += int(np.argmax(shown_C[at:] < shown_C[at] - _BEGUN * size)) - 1
    text = (
        f"{_called(sensor)} falls by {size:.3g} K within {FALL_S:.0f} s from "
        f"{float(time_s[at]):.5g} s on, as no specimen cools: it has come off; fasten it again, and take the "
        "specimen for as warm as it was before, or warmer"
    )
    return doubt(look, "detached", sensor.name, size, "K", text)


def _smoothed(sensor: Temperature) -> tuple[FloatArray, FloatArray]:
    """Return the readings as medians of three, so that no single one counts."""
    there = np.isfinite(sensor.temperature_C)
    time_s, shown_C = sensor.time_s[there], sensor.temperature_C[there]
    if shown_C.size < 3:
        return time_s, shown_C
    before, here, after = shown_C[:-2], shown_C[1:-1], shown_C[2:]
    low, high = np.minimum(before, here), np.maximum(before, here)
    return time_s[1:-1], np.asarray(np.maximum(low, np.minimum(high, after)))


def _does_not_follow(
    look: RunView, on_it: Sequence[Temperature], in_air: Sequence[Temperature]
) -> list[Finding]:
    """Return the sensors that do not rise with the heat, and the room's that does."""
    rises = {sensor.name: _rise_K(sensor) for sensor in (*on_it, *in_air)}
    planned_K = _planned_K(look)
    most = max((rises[sensor.name] for sensor in on_it), default=0.0)
    due_K = max(planned_K, most)
    if due_K < LEAST_RISE_K:
        return []
    cold = [sensor for sensor in on_it if rises[sensor.name] < FOLLOWS * due_K]
    warm_air = [sensor for sensor in in_air if rises[sensor.name] > AS_MUCH * due_K]
    why = (
        f"the plan expected {planned_K:.2g} K for the energy that was taken up"
        if planned_K >= most
        else f"another sensor on it rose by {most:.2g} K"
    )
    found = []
    for sensor in cold:
        rose = rises[sensor.name]
        if warm_air:
            text = (
                f"{_called(sensor)} rose by {rose:.2g} K and {_called(warm_air[0])}, the room's, by "
                f"{rises[warm_air[0].name]:.2g} K: they are swapped; look at the ROMs and roles in {SENSOR}"
            )
            found.append(doubt(look, "swapped", sensor.name, rose, "K", text))
            continue
        text = (
            f"{_called(sensor)} rose by {rose:.2g} K, and {why}: it does not touch the specimen, or "
            f"hangs; look at where it sits, and at its ROM and role in {SENSOR}"
        )
        found.append(doubt(look, "not-following", sensor.name, rose, "K", text))
    for sensor in warm_air:
        text = (
            f"{_called(sensor)}, the room's, rose by {rises[sensor.name]:.2g} K as the specimen did: it "
            f"sits on the specimen; look at where it sits, and at its ROM and role in {SENSOR}"
        )
        kind: FindingKind = "swapped" if cold else "not-following"
        found.append(doubt(look, kind, sensor.name, rises[sensor.name], "K", text, effect="noted"))
    return found


def _rise_K(sensor: Temperature) -> float:  # noqa: N802 - the unit keeps its capital
    """Return by how much a sensor rises, from its first readings to its warmest."""
    _, shown_C = _smoothed(sensor)
    few = max(1, shown_C.size // 20)
    return float(np.max(shown_C)) - median(shown_C[:few])


def _planned_K(look: RunView) -> float:  # noqa: N802
    """Return by how much the plan expected the sensors to rise for the energy taken up [K]; 0: unknown."""
    step = look.facts.step
    start, end, heat = (
        step.get(name) for name in ("start_temperature_C", "sensor_end_temperature_C", "expected_heat_J")
    )
    numbers = [float(value) for value in (start, end, heat) if isinstance(value, int | float)]
    if len(numbers) < 3 or not np.all(np.isfinite(numbers)) or numbers[2] <= 0.0:
        return 0.0
    absorbed_J = sum(result.quantities.absorbed_energy_J or 0.0 for result in look.results)
    return min(1.0, max(0.0, absorbed_J / numbers[2])) * (numbers[1] - numbers[0])


def _called(sensor: Temperature) -> str:
    return f"{sensor.name} ({sensor.place})" if sensor.place else sensor.name
