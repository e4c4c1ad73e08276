"""From the limits of a campaign to the guards that keep them."""

from __future__ import annotations

from collections.abc import Collection

from bufferstand.daq.guards.catalogue import kinds
from bufferstand.daq.guards.panel import GuardSet
from bufferstand.daq.guards.site import Site
from bufferstand.drivers import Stand
from bufferstand.protocols import Envelope, TestLimits
from bufferstand.protocols.campaign_file import GuardTable
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.prediction import Predictor


def guards_for(
    limits: TestLimits,
    envelope: Envelope,
    stand: Stand,
    *,
    ambient: Collection[str] = (),
    table: GuardTable | None = None,
    stand_tilt_mm: float | None = None,
    plan: Plan | None = None,
    predictor: Predictor | None = None,
    speed: float = 1.0,
) -> GuardSet:
    """Return the guards of a campaign on a stand: those of every kind in the catalogue.

    Parameters
    ----------
    limits, envelope, stand, ambient, table, stand_tilt_mm, plan, predictor, speed
        As of :class:`bufferstand.daq.guards.site.Site`.
    """
    site = Site(
        limits, envelope, stand, ambient, table or GuardTable(), stand_tilt_mm, plan, predictor, speed
    )
    return GuardSet(*(kind.made_for(site) for kind in kinds()))
