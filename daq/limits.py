"""From the limits of a campaign to the guards that keep them."""

from __future__ import annotations

from collections.abc import Collection

from bufferstand.daq.guard_catalogue import kinds
from bufferstand.daq.guard_site import Site
from bufferstand.daq.panel import GuardSet
from bufferstand.drivers.interfaces import Stand
from bufferstand.protocols.guard_table import GuardTable
from bufferstand.protocols.limits import Envelope, TestLimits
from bufferstand.protocols.plan import Plan
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
        As of :class:`bufferstand.daq.guard_site.Site`.
    """
    site = Site(
        limits, envelope, stand, ambient, table or GuardTable(), stand_tilt_mm, plan, predictor, speed
    )
    return GuardSet(*(kind.made_for(site) for kind in kinds()))
