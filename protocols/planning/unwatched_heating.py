"""How far a specimen warms while no thermometer is heard, by the plan: bounds ``temperature_stale_s``."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import place_of, read_text
from bufferstand.protocols.campaign_file import UNSEEN_HEATING_K
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.steps import PlannedStep


@dataclass(frozen=True)
class FastestHeating:
    """Where a plan heats the specimen's mass fastest, and how fast [K/s]."""

    rate_K_per_s: float
    step: PlannedStep


def fastest_heating(plan: Plan) -> FastestHeating | None:
    """Return the largest planned heating rate of the specimen's mass; None where its heat is not known."""
    if not plan.knows_heat or not plan.steps:
        return None
    rates = [FastestHeating(_rate_K_per_s(step), step) for step in plan.steps]
    return max(rates, key=lambda found: found.rate_K_per_s)


def _rate_K_per_s(step: PlannedStep) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the largest rate within a step [K/s]: over each motion, and between the parts of a long sine."""
    fastest, before_C = 0.0, step.start_temperature_C
    for one in step.estimates:
        temperatures = one.cycle_C if len(one.cycle_C) > 1 else (before_C, one.end_temperature_C)
        if one.duration_s > 0.0:
            part_s = one.duration_s / (len(temperatures) - 1)
            fastest = max([fastest, *((after - at) / part_s for at, after in pairwise(temperatures))])
        before_C = one.end_temperature_C
    return fastest


def demand_heat_is_seen(plan: Plan) -> None:
    """Refuse a silence of the thermometers in which the specimen would warm too far, unseen.

    Parameters
    ----------
    plan : Plan
        With its estimates.

    Raises
    ------
    BadInput
        With key, value, bound, the step that heats fastest, and what to do.
    """
    found, stale_s = fastest_heating(plan), plan.campaign.limits.temperature_stale_s
    if found is None or found.rate_K_per_s * stale_s <= UNSEEN_HEATING_K:
        return
    most_s = UNSEEN_HEATING_K / found.rate_K_per_s
    raise BadInput(
        f"temperature_stale_s = {stale_s!r} is above its bound of {most_s:.3g} s: step {found.step.index} "
        f"“{found.step.name}” heats the specimen by {found.rate_K_per_s:.3g} K/s, which makes "
        f"{found.rate_K_per_s * stale_s:.3g} K in that time, unseen",
        file=plan.campaign.path,
        place=place_of(("limits", "temperature_stale_s"), read_text(plan.campaign.path)),
        remedy=f"write at most {most_s:.3g} ({UNSEEN_HEATING_K:g} K), or let that step heat more slowly",
    )
