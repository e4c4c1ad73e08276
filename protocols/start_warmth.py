"""Refusals of steps that would begin at another temperature than they are to: no waiting mends that."""

from __future__ import annotations

from collections.abc import Sequence

from foundation.errors import BadInput
from protocols.campaign import Campaign
from protocols.estimate import OffBand


def demand_right_warmth(campaign: Campaign, cold: Sequence[OffBand], warm: Sequence[OffBand]) -> None:
    """Refuse a plan in which a step would begin too cold, or too warm for any time of waiting.

    Parameters
    ----------
    campaign : Campaign
    cold : sequence of OffBand
        Steps that are expected to begin below their band: waiting warms nothing.
    warm : sequence of OffBand
        Those that are expected to begin above one that ends below the air: waiting never cools so far.

    Raises
    ------
    BadInput
        If there is one, unless a step that is too cold says that it is run all the same.
    """
    for one in cold:
        band = one.request.step.start_band()
        if band is None or not band.refuses_cold:
            continue
        middle_C = (band.low_C + band.high_C) / 2.0
        raise BadInput(
            f"step {one.index} “{one.request.name}”: the specimen is expected to be at {one.sensor_C:.1f} °C "
            f"when it begins, below {band.text()}",
            file=campaign.path,
            place=campaign.place(one.request.number, one.request.nested),
            remedy=f"put a step with kind = “warm-up” and temperature_C = {middle_C:g} before it, correct "
            "[conditions], or give it too_cold = “run”",
        )
    for one in warm:
        band = one.request.step.start_band()
        if band is None:
            continue
        ambient_C = campaign.content.conditions.ambient_C
        raise BadInput(
            f"step {one.index} “{one.request.name}”: waiting never cools the specimen from "
            f"{one.sensor_C:.1f} °C into {band.text()}: the air has {ambient_C:g} °C",
            file=campaign.path,
            place=campaign.place(one.request.number, one.request.nested),
            remedy=f"give it a band that reaches above {ambient_C:g} °C, or correct ambient_C or "
            "specimen_C of [conditions]",
        )
