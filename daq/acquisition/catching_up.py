"""Reads all samples up to now: the reader can be behind the stand."""

from __future__ import annotations

from collections.abc import Callable

from bufferstand.daq.acquisition.loop import Acquisition

CATCH_UP_S = 20.0
"""A reader that is behind the stand may stay so long without one newer sample [s of the wall]."""

NOT_CAUGHT_UP = f"no newer sample was read for {CATCH_UP_S:g} s, though the controller has taken some"


def catch_up(acquisition: Acquisition, tick: Callable[[], object], ended: Callable[[], bool]) -> bool:
    """Make passes until all is read that was sampled before now: the reader can be behind the stand.

    What is sampled meanwhile need not be read.

    Parameters
    ----------
    acquisition : Acquisition
        Whose samples are read.
    tick : callable
        Makes one pass.
    ended : callable
        Whether nothing more is to be waited for.

    Returns
    -------
    bool
        False where no newer sample came for :data:`CATCH_UP_S`: what is missing was not read.
    """
    clock = acquisition.clock
    acquisition.renew_status()
    tick()
    while acquisition.continuity.is_cut_off and not ended():  # what the status showed is of before
        tick()
    present_us, newest_s = acquisition.device_now_us, acquisition.latest.device_s
    until_s = clock.wall_s() + CATCH_UP_S
    while not acquisition.has_read_to(present_us) and not ended():
        if clock.wall_s() >= until_s:
            return False
        tick()
        if acquisition.latest.device_s != newest_s:
            newest_s, until_s = acquisition.latest.device_s, clock.wall_s() + CATCH_UP_S
    return True
