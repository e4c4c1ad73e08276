"""A campaign over a wire, in virtual time, that SIGKILL ends amid its sine.

``python -m tests.daq.killed_over_a_wire CAMPAIGN OUT ROUND_TRIP_MS together|apart``
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.simulated.inprocess.stand import behind_a_wire, open_in_process
from tests.daq.run_in_process import facts_of, sample_plan
from tests.drivers.profiles import changed_ring

APART = "[wire]\nread_write = false\n\n[ring]"
CYCLES_DONE = 2
KEPT_BYTES = 20_000
"""What the journal holds at least: virtual time is over before a thread has written."""
PATIENCE_S = 60.0


def profile_of(how: str) -> Profile | None:
    """Return the register profile of a controller with function 23, or without."""
    return changed_ring({"[ring]": APART}) if how == "apart" else None


def main(campaign: Path, out: Path, round_trip_s: float, how: str) -> None:
    plan, stand_file = sample_plan(campaign)
    opened = open_in_process(stand_file)

    def trip_s() -> float:
        controller = opened.device.controller
        if controller.state is MotionState.WAVEFORM and controller.cycles_done >= CYCLES_DONE:
            journals = list((out / "runs").glob("*harmonic*.journal"))
            end_s = time.monotonic() + PATIENCE_S
            while journals and time.monotonic() < end_s:
                if sum(path.stat().st_size for path in journals) > KEPT_BYTES:
                    os.kill(os.getpid(), signal.SIGKILL)
                time.sleep(0.01)
        return round_trip_s

    stand = behind_a_wire(opened, stand_file, trip_s, profile_of(how))
    run_campaign(plan, stand, opened.clock, out, facts_of(stand_file))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]) / 1e3, sys.argv[4])
