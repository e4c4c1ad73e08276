"""A LabJack beside a controller on real wires: the simulated stand's own twin of it, and its driver."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.connect import open_stand
from bufferstand.drivers.interfaces import OwnClock, SampleBlock
from bufferstand.drivers.simulated.serving import start_process
from bufferstand.drivers.stand_file import load_stand, with_endpoints
from bufferstand.foundation import WallClock
from tests.two_clocks.stands import written

pytestmark = pytest.mark.slow


def test_the_served_twin_is_read_by_the_driver(tmp_path: Path) -> None:
    written(tmp_path)
    stand_file = load_stand(tmp_path / "stand.toml")
    clock = WallClock()
    blocks: list[SampleBlock] = []
    readings = []
    with start_process(tmp_path / "stand.toml", directory=tmp_path / "run") as process:
        stand = open_stand(with_endpoints(stand_file, process.served.endpoints()), clock)
        try:
            (device,) = (one for one in stand.sensors if isinstance(one, OwnClock))
            end_s = clock.wall_s() + 4.0
            while clock.wall_s() < end_s:
                blocks += [one for one in device.drain() if isinstance(one, SampleBlock)]  # type: ignore[attr-defined]
                readings += device.clock_readings()
                clock.sleep(0.02)
        finally:
            stand.close()
    assert sum(len(one.time_us) for one in blocks) > 1000
    assert sum(one.lost for one in blocks) == 0
    stroke = np.concatenate([one.counts["stroke_3"] for one in blocks])
    assert np.std(stroke) < 0.05 / 50.0  # at rest, with the noise of the wires
    assert len(readings) > 20
    late_s = [one.received_s - float(one.time_us[-1]) * 1e-6 for one in blocks[5:]]
    offset_s = min(one.host_s - one.device_us * 1e-6 for one in readings)
    # What comes in was sampled before, by both clocks: some packets, and never in the future.
    assert -0.003 < min(late_s) - offset_s < 0.5
