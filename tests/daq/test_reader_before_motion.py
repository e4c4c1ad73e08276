"""Samples that wait are read before a motion begins, and between the requests of its command."""

from __future__ import annotations

import struct

import pytest

from benchmarks.common.runaway_causes import Stiff
from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action
from bufferstand.daq.motions.motion_runner import Halt, MotionRunner
from bufferstand.daq.operator.stop_request import StopRequest
from bufferstand.drivers.simulated.inprocess.register_wire import Lost
from bufferstand.drivers.simulated.inprocess.stand import behind_a_wire, open_in_process
from bufferstand.drivers.simulated.wires.modbus_requests import WRITE_ONE
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.motions import ControllerMotion, RampTo
from tests.drivers.conftest import SAMPLE_STAND

EXECUTE = 84
TRIP_S = 0.01
BLOCK_S = 0.014


class Bench:
    """A stand behind a round trip of 10 ms; keeps how old the newest sample was at each execution."""

    def __init__(self) -> None:
        stand_file = load_stand(SAMPLE_STAND)
        self.opened = open_in_process(stand_file, spring=Stiff(0.0), log_truth=False)
        self.clock = self.opened.clock
        stand = behind_a_wire(self.opened, stand_file, lambda: TRIP_S, lost=self.look)
        self.controller = stand.controller
        self.controller.connect()
        self.guards = GuardSet((), (), ControllerGuard(5.0, 5.0, 1000.0))
        self.panel = GuardPanel(self.guards, wall_s=self.clock.wall_s())
        self.acquisition = Acquisition(stand, self.clock, self.panel)
        self.driver = MotionRunner(self.acquisition, StopRequest(), self.acquisition.tick)
        self.ages_s: list[float] = []
        self.controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=2000)

    def look(self, request: bytes) -> Lost:
        """Look at a request."""
        if request[0] == WRITE_ONE and struct.unpack_from(">H", request, 1)[0] == EXECUTE:
            newest_s = self.acquisition.latest.device_s
            assert newest_s is not None
            shown_us = self.opened.device.tick_us(self.clock.now_s())
            self.ages_s.append(shown_us / 1e6 - newest_s)
        return ""


@pytest.mark.parametrize("paused_s", [0.0, 0.7])
def test_a_motion_begins_with_a_reader_that_is_up_to_date(paused_s: float) -> None:
    bench = Bench()
    bench.driver.wait(0.2)
    bench.clock.sleep(paused_s)
    if paused_s:
        bench.acquisition.tick()
        assert bench.acquisition.is_behind
    bench.driver.perform(RampTo(0.5, 5.0), 1.0)
    assert len(bench.ages_s) == 1
    assert bench.ages_s[0] <= 2.0 * TRIP_S + 2.0 * BLOCK_S
    assert bench.driver.command_s == pytest.approx(6 * TRIP_S, rel=0.01), "what was read is not counted"


def test_a_guard_that_trips_between_two_requests_ends_the_command() -> None:
    bench = Bench()
    bench.driver.wait(0.2)
    calm = bench.acquisition.latest.values["force"]
    guard = ChannelGuard("force", "force", calm + 50.0, None, "kN", "force", Action.STOP)
    bench.panel.change(GuardSet(bench.guards, guard))
    before = bench.controller.start

    def pushed(motion: ControllerMotion, *, hurry: bool = False) -> int:
        bench.opened.device.actuator.position_mm = 10.0  # 200 kN, while the ramp is being armed
        return before(motion, hurry=hurry)

    bench.controller.start = pushed  # type: ignore[method-assign]
    with pytest.raises(Halt, match="exceeds the limit"):
        bench.driver.perform(RampTo(20.0, 5.0), 5.0)
    assert bench.ages_s == [], "it was not begun"
