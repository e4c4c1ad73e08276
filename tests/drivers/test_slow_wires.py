"""Real wires that are slow, serial, or without function 23: every sample comes, and once."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.foundation.clock import WallClock
from tests.daq.cases import ListRecorder
from tests.drivers.profiles import RING_TEXT
from tests.drivers.simulated.standing import STAND

MODEL = Path(__file__).parents[2] / "sample_runs/models/category-a-elastomer.toml"
APART = RING_TEXT.replace("\n[ring]", "\n[wire]\nread_write = false\n\n[ring]", 1)
ENOUGH = 1500
PATIENCE_S = 60.0
TCP = 'host = "127.0.0.1"\nport = 15020'
LINE = 'serial = "wires/controller"\nbaud = 115200'

WIRES = {
    "tcp, 2 ms": (TCP, "ring", "ring", 0.002),
    "tcp, 5 ms": (TCP, "ring", "ring", 0.005),
    "tcp, written and read apart": (TCP, "apart.toml", "apart.toml", 0.0),
    "tcp, function 23 found missing": (TCP, "apart.toml", "ring", 0.0),
    "rtu": (LINE, "ring", "ring", 0.0),
    "rtu, function 23 found missing": (LINE, "apart.toml", "ring", 0.0),
}


@pytest.mark.dose(3)
@pytest.mark.parametrize(("wire", "served", "told", "delay_s"), WIRES.values(), ids=WIRES)
def test_every_sample_comes_once(tmp_path: Path, wire: str, served: str, told: str, delay_s: float) -> None:
    (tmp_path / "apart.toml").write_text(APART, encoding="utf-8")
    text = STAND.replace(TCP, wire)
    for name, profile in (("served", served), ("told", told)):
        content = text.replace('profile = "ring"', f'profile = "{profile}"')
        (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
    faults = [f"controller=delay@0,delay_s={delay_s}"] if delay_s else []
    with start_process(
        tmp_path / "served.toml", directory=tmp_path / "run", model=MODEL, faults=faults
    ) as running:
        stand_file = with_endpoints(load_stand(tmp_path / "told.toml"), running.served.endpoints())
        clock = WallClock()
        controller = build_controller(stand_file, clock)
        controller.connect()
        controller.skip_backlog()
        guards = GuardSet((), (), ControllerGuard(30.0, 30.0, controller.facts.rate_Hz))
        acquisition = Acquisition(Stand(controller, ()), clock, GuardPanel(guards, wall_s=clock.wall_s()))
        recorder = ListRecorder()
        acquisition.attach(recorder)
        end_s = time.monotonic() + PATIENCE_S
        while acquisition.latest.samples < ENOUGH:
            assert time.monotonic() < end_s, "it did not come"
            acquisition.tick()
            acquisition.rest()
        delivery = controller.delivery()
        controller.close()
    assert acquisition.panel.trip is None
    sequence = np.concatenate([block[1] + np.arange(len(block[2])) for block in recorder.blocks])
    lost = acquisition.latest.lost  # the ring holds a minute: even a starved reader loses nothing
    assert np.all(np.diff(sequence) == 1)
    assert lost == 0
    assert delivery is not None
    assert delivery.round_trip_s >= delay_s
    assert delivery.status_s >= delay_s
    # 264 and 70 bytes of 11 bits (even parity): a block, and a status without the 16 of feeding
    byte_s = 11 / 115200 if "serial" in wire else 0.0
    assert delivery.line_s == pytest.approx(264 * byte_s)
    # On a line a status is asked for by a number, which is written first: feeding is the half of that.
    trips = 2 if "serial" in wire and served != "ring" else 1
    assert delivery.feed_s == pytest.approx(max(delivery.status_s - 54 * byte_s, 0.0) / trips)
    assert (delivery.gap_s == 0.0) is (byte_s == 0.0 and served == "ring")
    said = [event[2] for event in recorder.events if "does not know function 23" in event[2]]
    assert len(said) <= 1
    slower = replace(delivery, round_trip_s=0.02, status_s=0.02, feed_s=0.02)
    assert not slower.keeps_up
