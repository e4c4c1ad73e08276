"""The objects of a session that exist once the controller has identified itself."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.daq.acquisition import Acquisition, OutageHandler
from bufferstand.daq.campaign_folder import StandOrigin
from bufferstand.daq.guards import GuardPanel, GuardSet
from bufferstand.daq.motions import MotionRunner, SafeStop
from bufferstand.daq.zero import Zeroing
from bufferstand.drivers import Identity


@dataclass(frozen=True)
class ConnectedStand:
    """A stand that is connected, and everything that works on it.

    Parameters
    ----------
    identity : Identity
        Of the controller.
    reached : Reached
        Whether the stand is a simulated one, and how that is known.
    base : GuardSet
        By the campaign's limits.
    guards : GuardSet
        Of the present step, by its own.
    panel : GuardPanel
    acquisition : Acquisition
    driver : Driver
    safe_stop : SafeStop
    zeroing : Zeroing
    rides : RideOut
        What becomes of outages.
    """

    identity: Identity
    reached: StandOrigin
    base: GuardSet
    guards: GuardSet
    panel: GuardPanel
    acquisition: Acquisition
    driver: MotionRunner
    safe_stop: SafeStop
    zeroing: Zeroing
    rides: OutageHandler
