"""How a campaign's outages are ridden out: by watchdog, ring and the guards in force."""

from __future__ import annotations

import time

from daq.acquisition import Acquisition
from daq.ride_out import RideOut
from daq.stand_use import use_trouble
from drivers.interfaces import Identity
from drivers.leeway import Leeway
from protocols.guard_table import GuardTable


def rides_of(acquisition: Acquisition, watchdog_s: float, table: GuardTable, identity: Identity) -> RideOut:
    """Return what decides of an acquisition's outages.

    Parameters
    ----------
    acquisition : Acquisition
        Whose controller is connected.
    watchdog_s : float
        The controller's watchdog [s of the wall].
    table : GuardTable
        ``[guards]`` in force.
    identity : Identity
        Who answered.
    """
    controller = acquisition.stand.controller

    def ask_anew() -> str:
        now = controller.connect()
        if now.serial != identity.serial:
            return f"controller {now.serial} answers where {identity.serial} did"
        if why := use_trouble(controller, acquisition.clock, table.zero_force_max_kN):
            return why
        controller.skip_backlog()
        acquisition.panel.ask_anew(acquisition.clock.wall_s())
        acquisition.renew_status()
        return ""

    leeway = Leeway(watchdog_s, table.controller_silence_s, controller.facts.clock == "device")
    return RideOut(leeway, controller.other_writer, ask_anew, time.time)
