"""What is looked at before anything moves: refused, or said, each with its remedy."""

from __future__ import annotations

import shutil
from collections import namedtuple
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.panel import GuardSet
from bufferstand.daq.stand.start_checks import delivery_trouble, first_look, specimen_gaps, zero_trouble
from bufferstand.drivers.delivery_rate.blocks import Delivery
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.foundation.specimen.file import Specimen
from tests.daq.fake_stand import Orders
from tests.daq.test_runner import Case

Usage = namedtuple("Usage", "total used free")


def test_a_force_at_rest_refuses_and_a_small_one_is_said(tmp_path: Path) -> None:
    case = Case(tmp_path, orders=Orders(add={"force": lambda _: 7.0}))
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", 4), "7 kN may be on the specimen"
    assert "reads +7.00 kN, more than zero_force_max_kN = 5 kN: unload the specimen" in outcome.reason
    assert "enable" not in case.controller.calls
    small = Case(tmp_path / "small", orders=Orders(add={"force": lambda _: -2.0}))
    assert small.run().status == "complete"
    assert any("WARNING: at rest with the valve off the force reads -2.00 kN" in x for x in small.shown.lines)
    assert zero_trouble(0.9, 5.0) == ("", False)


class SeenWire:
    """An acquisition and its controller, whose blocks take so long, one pass after the other."""

    def __init__(self, *trips_s: float) -> None:
        self.clock = VirtualClock()
        self.stand = SimpleNamespace(controller=self)
        self.trips_s, self.passes = trips_s, 0

    def delivery(self) -> Delivery:
        trip_s = self.trips_s[min(self.passes, len(self.trips_s) - 1)]
        return Delivery(14, trip_s, 1000.0, trip_s, trip_s)

    def pump(self) -> None:
        self.passes += 1
        self.clock.sleep(0.125)


def test_a_wire_that_a_busy_computer_made_slow_is_looked_at_again() -> None:
    for trips_s, refused, passes in [
        ((0.010,), False, 0),
        ((0.012, 0.012, 0.012, 0.010), False, 3),
        ((0.012,), True, 8),  # a second
        ((0.014, 0.010), True, 0),  # no busy computer explains that
    ]:
        seen = SeenWire(*trips_s)
        why = delivery_trouble(cast(Acquisition, seen), seen.pump)
        assert ("does not keep up" in why, seen.passes) == (refused, passes)


def test_a_disk_that_cannot_take_the_plan_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = Case(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**9, 10**9 - 10**6, 10**6))
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", 4)
    assert "has 1 MB free, the plan needs" in outcome.reason
    assert "--out" in outcome.reason
    assert "enable" not in case.controller.calls


def test_what_the_specimen_file_lacks_is_said() -> None:
    assert "lacks category, max_stroke_mm, elastic_system, maker, serial" in specimen_gaps(Specimen(id="x"))
    whole = Specimen(
        id="x", category="A", max_stroke_mm=105.0, elastic_system="elastomer", maker="m", serial="1"
    )
    assert specimen_gaps(whole) == ""
    assert "category" not in specimen_gaps(Specimen(id="x", kind="draw-gear"))


def test_what_waited_in_the_ring_is_not_the_stand_at_rest() -> None:
    """After a kill the ring still has the end of the controller's own release: 80 kN going down to none."""
    clock = VirtualClock()
    panel = SimpleNamespace(guards=GuardSet(), latest_temperatures=dict)
    waiting = [80.0, 60.0, 30.0, 9.0]
    acquisition = SimpleNamespace(clock=clock, panel=panel, is_behind=True, latest=None)

    def pump() -> None:
        clock.sleep(0.05)
        acquisition.is_behind = bool(waiting)
        force_kN = waiting.pop(0) if waiting else 0.2
        acquisition.latest = SimpleNamespace(samples=10, values={"force": force_kN, "force_2": 0.1})

    rest = first_look(cast(Acquisition, acquisition), pump)
    assert rest["force"] == pytest.approx(0.2)
    assert rest["force_2"] == pytest.approx(0.1)
