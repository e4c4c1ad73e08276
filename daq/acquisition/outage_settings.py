"""How a campaign's outages are ridden out: by watchdog, ring and the guards in force."""

from __future__ import annotations

import time
from collections.abc import Callable

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.acquisition.outage import OutageHandler
from bufferstand.drivers.controllers import OutageLimit
from bufferstand.protocols.campaign_file import GuardTable


def rides_of(
    acquisition: Acquisition, watchdog_s: float, table: GuardTable, ask_anew: Callable[[], str]
) -> OutageHandler:
    """Return what decides of an acquisition's outages.

    Parameters
    ----------
    acquisition : Acquisition
        Whose controller is connected.
    watchdog_s : float
        The controller's watchdog [s of the wall].
    table : GuardTable
        ``[guards]`` in force.
    ask_anew : callable
        Looks at the stand as at a start (:meth:`bufferstand.daq.campaign.recheck.StandRecheck.look`).
    """
    controller = acquisition.stand.controller
    leeway = OutageLimit(watchdog_s, table.controller_silence_s, controller.facts.clock == "device")
    return OutageHandler(leeway, controller.other_writer, ask_anew, time.time)
