"""Refuses steps that would begin outside of their start temperature, or could never reach it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from bufferstand.foundation import BadInput
from bufferstand.protocols.campaign_file import Campaign
from bufferstand.protocols.planning.estimate import BeginsOffBand, Estimator, NeverWarm
from bufferstand.protocols.planning.expansion import Request

OffT = TypeVar("OffT", BeginsOffBand, NeverWarm)


def demand_right_warmth(campaign: Campaign, estimator: Estimator, over: Sequence[Request]) -> None:
    """Refuse a plan in which a step would not begin, or a warm-up not end, as warm as it is to be.

    Parameters
    ----------
    campaign : Campaign
    estimator : Estimator
        That has planned the steps.
    over : sequence of Request
        What is complete: it is not refused any more.

    Raises
    ------
    BadInput
        If there is one; a step that is too cold may say that it is run all the same.
    """

    def left(found: Sequence[OffT]) -> list[OffT]:
        return [one for one in found if not any(one.request is request for request in over)]

    _demand_start(campaign, left(estimator.too_cold), left(estimator.never_cool))
    for one in left(estimator.never_warm):
        raise BadInput(
            f"step {one.index} “{one.request.name}”: {one.problem}",
            file=campaign.path,
            place=campaign.place(one.request.number, one.request.nested),
            remedy=one.remedy,
        )


def _demand_start(campaign: Campaign, cold: Sequence[BeginsOffBand], warm: Sequence[BeginsOffBand]) -> None:
    """Refuse steps that begin below their band, or above one below the air: no waiting mends that."""
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
