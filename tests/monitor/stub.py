"""An acquisition that has seen nothing, for a publisher to look at."""

from __future__ import annotations

from typing import Any, cast

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from tests.daq.fake_stand import FakeClock, fake_stand


def acquisition_of(**options: Any) -> Acquisition:
    """Return an acquisition on a fake stand that was never read."""
    clock = FakeClock()
    stand, _ = fake_stand(clock, **options)
    guards = GuardSet((), (), ControllerGuard(1.0, 1.0, 1000.0))
    return cast(Acquisition, Acquisition(stand, clock, GuardPanel(guards, wall_s=0.0)))
