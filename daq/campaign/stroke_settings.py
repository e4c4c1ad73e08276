"""By what terms the strokes of a campaign are commanded, and who says what becomes of them."""

from __future__ import annotations

from pathlib import Path

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.campaign.display import CampaignDisplay
from bufferstand.daq.strokes import StrokeBounds, StrokeCommandSettings, StrokeKnowledge, learned_in
from bufferstand.drivers import Stand
from bufferstand.protocols.planning import Plan


def terms_for(plan: Plan, stand: Stand, folder: Path) -> StrokeCommandSettings:
    """Return the terms of a campaign; what an earlier start learned is in its folder.

    The piston may go further than the specimen by what the machine, as the stand file states it, gives way
    under the greatest force that is allowed; never beyond the stand's own travel.
    """
    delays_s = {channel.name: channel.delay_s for channel in stand.controller.facts.channels}
    wires = [delay for name, delay in delays_s.items() if name.startswith("stroke_")]
    if wires:
        delays_s["stroke"] = sum(wires) / len(wires)
    return StrokeCommandSettings(
        plan.campaign.content.stroke, knowledge_in(folder, plan), bounds_of(plan), delays_s
    )


def knowledge_in(folder: Path, plan: Plan) -> StrokeKnowledge:
    """Return what a campaign's folder says of the stroke, or else what the stand file states."""
    knowledge = StrokeKnowledge(plan.limits.machine.give_mm_per_kN or None)
    if (learned := learned_in(folder)) is not None:
        knowledge.restore(learned)
    return knowledge


def bounds_of(plan: Plan) -> StrokeBounds:
    """Return what no command leaves."""
    limits = plan.limits
    furthest_mm = limits.stroke.value + limits.machine.give_mm_per_kN * limits.force.value
    return StrokeBounds(
        min(furthest_mm, plan.stand_limits.stroke_max_mm),
        limits.stroke.value,
        limits.force.value,
        min(limits.speed.value, plan.stand_limits.speed_max_mm_per_s),
    )


class SessionMessages:
    """Puts facts of the stroke into the run, and shows what must not be missed.

    Parameters
    ----------
    acquisition : Acquisition
    showing : Showing
    """

    def __init__(self, acquisition: Acquisition, showing: CampaignDisplay) -> None:
        self._acquisition = acquisition
        self._showing = showing

    def event(self, kind: str, text: str, **data: object) -> None:
        """Put an event into the run under way."""
        self._acquisition.log.say(kind, text, **data)

    def message(self, text: str) -> None:
        """Show a line."""
        self._showing.message(text)

    def warn(self, text: str) -> None:
        """Show a line that stays as a warning of the step."""
        self._showing.warn(text)
        self._showing.message(text)
