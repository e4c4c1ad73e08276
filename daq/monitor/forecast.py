"""Where the specimen's temperature goes: from the readings, by the model's heat law and what is planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from bufferstand.model import HeatBalance, heat_step, load_model
from bufferstand.protocols.campaign_file import load_campaign
from bufferstand.protocols.prediction import Temperatures as State
from bufferstand.protocols.prediction import sensor_after

POINTS = 120
"""Points of a forecast at most."""
LONGEST_S = 4.0 * 3600.0
"""No forecast reaches farther [s]: the air and the plan have changed by then."""


@dataclass(frozen=True)
class PlanStretch:
    """A part of the plan with its mean heating power [W] and how long it takes [s]."""

    power_W: float
    duration_s: float
    step: int


@dataclass(frozen=True)
class Forecast:
    """What the sensor will read.

    Parameters
    ----------
    points : tuple of (float, float)
        Time from now [s] and temperature [°C].
    reach_s : float or None
        When the stop threshold is reached [s from now], if it is.
    step : int
        During which step that is.
    """

    points: tuple[tuple[float, float], ...]
    reach_s: float | None
    step: int


def heat_balance_of(folder: Path, campaign_file: str) -> HeatBalance | None:
    """Return the heat law of a campaign's specimen, None where its files cannot be read."""
    try:
        campaign = load_campaign(folder / campaign_file)
        specimen = load_specimen(campaign.specimen_path).specimen
        if specimen.model is None:
            return None
        return load_model(campaign.specimen_path.parent / specimen.model).heat
    except (BadInput, OSError):
        return None


def stretches(
    steps: Sequence[Mapping[str, Any]], statuses: Sequence[str], present: int, left_s: float
) -> list[PlanStretch]:
    """Return what is left of a plan, beginning with the rest of the step under way.

    Parameters
    ----------
    steps : sequence of mapping
        Steps of ``campaign.json``'s plan.
    statuses : sequence of str
        Their states there.
    present : int
        Number of the step under way, 0 before the first.
    left_s : float
        What is left of all, as the campaign estimates it [s].
    """
    later = [
        _whole(step)
        for step, status in zip(steps, statuses, strict=True)
        if step["index"] > present and status not in ("complete", "skipped") and step["duration_s"] > 0.0
    ]
    if not 0 < present <= len(steps):
        return later
    now = steps[present - 1]
    here_s = left_s - sum(step["expected_duration_s"] for step in steps[present:])
    here_s = min(max(0.0, here_s), now["expected_duration_s"])
    here_s += max(0.0, now["duration_s"] - now["expected_duration_s"])  # beyond the stop that was expected
    if here_s <= 0.0 or now["duration_s"] <= 0.0:
        return later
    return [replace(_whole(now), duration_s=here_s), *later]


def _whole(step: Mapping[str, Any]) -> PlanStretch:
    """Return a step as if nothing stopped it; its heat is planned until the stop that does."""
    heated_s = min(step["duration_s"], step["expected_duration_s"])
    power_W = step["expected_heat_J"] / heated_s if heated_s > 0.0 else 0.0
    return PlanStretch(power_W, step["duration_s"], step["index"])


def foresee(
    heat: HeatBalance,
    sensor_C: float,
    slope_K_per_s: float,
    ambient_C: float,
    plan: Sequence[PlanStretch],
    stop_C: float | None,
) -> Forecast:
    """Return what a sensor will read while the rest of the plan goes on; it ends at the stop threshold.

    The mass's temperature follows from the sensor's, its slope and its lag (docs/model.md); from there
    eq. (7) is integrated with the mean power of every stretch.

    Parameters
    ----------
    heat : HeatBalance
        Of the specimen.
    sensor_C, slope_K_per_s : float
        Newest reading [°C] and how fast it changes [K/s].
    ambient_C : float
        Of the air [°C].
    plan : sequence of Stretch
        What is left.
    stop_C : float or None
        The threshold [°C].
    """
    mass_C = ambient_C + (sensor_C + heat.sensor_lag_s * slope_K_per_s - ambient_C) / heat.sensor_gain
    state, now_s = State(mass_C, sensor_C), 0.0
    points = [(0.0, sensor_C)]
    whole_s = min(LONGEST_S, sum(stretch.duration_s for stretch in plan))
    for stretch in plan:
        parts = max(1, round(POINTS * stretch.duration_s / max(whole_s, 1e-9)))
        for _ in range(parts):
            before = points[-1]
            state = _after(heat, state, ambient_C, stretch.power_W, stretch.duration_s / parts)
            now_s += stretch.duration_s / parts
            points.append((now_s, state.sensor_C))
            if stop_C is not None and state.sensor_C >= stop_C > before[1]:
                share = (stop_C - before[1]) / (state.sensor_C - before[1])
                reach_s = before[0] + share * (now_s - before[0])
                return Forecast((*points[:-1], (reach_s, stop_C)), reach_s, stretch.step)
            if now_s >= LONGEST_S:
                return Forecast(tuple(points), None, 0)
    return Forecast(tuple(points), None, 0)


def _after(heat: HeatBalance, start: State, ambient_C: float, power_W: float, duration_s: float) -> State:
    return State(
        heat_step(heat, start.mass_C, ambient_C, power_W, duration_s),
        sensor_after(heat, start, ambient_C, power_W, duration_s),
    )


def slope(readings: Sequence[tuple[float, float]], window_s: float = 60.0) -> float:
    """Return the straight line's slope through the readings of the last ``window_s`` [K/s]; 0 by too few."""
    last = [reading for reading in readings if readings[-1][0] - reading[0] <= window_s]
    if len(last) < 5:
        return 0.0
    mean_s = sum(at_s for at_s, _ in last) / len(last)
    mean_C = sum(value for _, value in last) / len(last)
    spread = sum((at_s - mean_s) ** 2 for at_s, _ in last)
    return sum((at_s - mean_s) * (value - mean_C) for at_s, value in last) / spread if spread else 0.0
