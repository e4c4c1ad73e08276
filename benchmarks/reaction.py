"""How long from the sample that exceeds a limit to the stop command on the wire, over many trips.

The piston is moved up and down; in each trip it crosses a limit at a random place, the guard judges the
sample, the driver halts, and the safe stop gives its first command (hold), which the controller obeys.
Measured is from the time stamp of the first sample beyond the limit to the controller's acknowledgement of
the command, so the command's way on the wire is in it, there and back. Everything that is read is recorded
meanwhile. The p99 is set beside one pass of the loop, in which all blocks that wait are read, and 5 ms.

In process the time is the stand's own (virtual): what the loop's pacing costs, without the processor. Over
TCP it is the wall's, with the simulated stand in a process of its own; the device's clock is mapped to the
host's by the least delay seen, so that this least delay of a reply is not in the figure.

Where the cores are shared with other work, the wall's figure is the scheduler's, too: a sleep of 18 ms was
seen to take 110 ms. ``chrt --rr 1`` before the command (as root) puts this process and the stand first in
line, as it does with ``bufferstand run`` on a busy test-stand PC.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import PATIENCE_S, SAMPLE_STAND, Benchmark, record, tell
from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action
from bufferstand.daq.motions.motion_runner import Halt, MotionRunner
from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopSettings
from bufferstand.daq.operator.stop_request import StopRequest
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import Controller, SampleBlock, Stand
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import start_process, wires_folder
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.foundation.clock import Clock, WallClock
from bufferstand.foundation.motions import ControllerMotion, RampTo, StandStill

TOP_MM = 10.0
SPEED_MM_PER_S = 60.0


class Stopped(BaseException):
    """The first stop command was acknowledged: the rest of the safe stop is not measured."""


class Timed:
    """A controller that notes when its hold was acknowledged, ends the trip, and knows the least delay."""

    def __init__(self, controller: Controller, clock: Clock) -> None:
        self._controller = controller
        self._clock = clock
        self.acknowledged_s = 0.0
        self.hold = 0
        self.least_s = float("inf")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._controller, name)

    def read_block(self) -> SampleBlock | None:
        """Read, and note the delay of the newest sample."""
        block = self._controller.read_block()
        if block is not None:
            self.least_s = min(self.least_s, block.received_s - int(block.time_us[-1]) / 1e6)
        return block

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:
        """Begin a motion; of a hold, note the time, and end the trip."""
        number = self._controller.start(motion, hurry=hurry)
        if not isinstance(motion, StandStill):
            return number
        self.hold = number
        self.acknowledged_s = self._clock.now_s()
        raise Stopped


def reactions(stand: Stand, clock: Clock, trips: int, folder: Path) -> np.ndarray:
    """Return the reaction of each trip [s of the clock], shape (trips,); record in ``folder`` meanwhile."""
    random_, controller = random.Random(1), Timed(stand.controller, clock)
    controller.connect()
    rate_Hz = controller.facts.rate_Hz
    for sensor in stand.sensors:
        sensor.start()
    quiet = GuardSet((), (), ControllerGuard(PATIENCE_S, PATIENCE_S, rate_Hz))
    panel = GuardPanel(quiet, wall_s=clock.wall_s())
    timed = Stand(controller, stand.sensors)
    acquisition = Acquisition(timed, clock, panel)
    driver = MotionRunner(acquisition, StopRequest(), acquisition.tick)
    safe_stop = SafeStop(timed.controller, clock, SafeStopSettings(20.0, 2.0))
    while not acquisition.up_to_date:
        driver.pump()
    recorder = record(timed, folder)
    acquisition.attach(recorder)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=int(1e3 * PATIENCE_S))
    found: list[float] = []
    for trip in range(trips):
        up = trip % 2 == 0
        limit_mm = random_.uniform(0.3, 0.7) * TOP_MM
        panel.reset()
        panel.change(_guards(limit_mm, up, rate_Hz))
        controller.start(RampTo(target_mm=TOP_MM if up else 0.0, speed_mm_per_s=SPEED_MM_PER_S))
        try:
            while True:
                driver.pump()
        except Halt as halt:
            safe_stop.arm()
            try:
                safe_stop.run()
            except Stopped:
                found.append(controller.acknowledged_s - (halt.trip.time_us or 0) / 1e6)
        panel.change(quiet)
        panel.reset()
        _until(driver, acquisition, controller.hold)
        target_mm = TOP_MM if up else 0.0
        _until(driver, acquisition, controller.start(RampTo(target_mm=target_mm, speed_mm_per_s=200.0)))
    controller.disable()
    recorder.close("complete")
    return np.array(found) - controller.least_s


def _until(driver: MotionRunner, acquisition: Acquisition, sequence: int) -> None:
    while (status := acquisition.latest.status) is None or status.done_sequence != sequence:
        driver.pump()


def _guards(limit_mm: float, up: bool, rate_Hz: float) -> GuardSet:
    upper, lower = (limit_mm, None) if up else (None, limit_mm)
    guard = ChannelGuard("position", "position", upper, lower, "mm", "piston", Action.STOP)
    return GuardSet((guard,), (), ControllerGuard(PATIENCE_S, PATIENCE_S, rate_Hz))


def in_process(trips: int, folder: Path) -> np.ndarray:
    """Return the reactions on the stand in virtual time."""
    opened = open_in_process(load_stand(SAMPLE_STAND), log_truth=False)
    return reactions(opened.stand, opened.clock, trips, folder)


def over_tcp(trips: int, folder: Path) -> np.ndarray:
    """Return the reactions on the simulated stand in a process of its own, in real time."""
    stand_file = load_stand(SAMPLE_STAND)
    with (
        wires_folder() as wires,
        start_process(SAMPLE_STAND, directory=wires, speed=1.0) as process,
    ):
        wired, clock = with_endpoints(stand_file, process.served.endpoints()), WallClock(1.0)
        stand = Stand(build_controller(wired, clock), build_sensors(wired, clock))
        try:
            return reactions(stand, clock, trips, folder)
        finally:
            stand.close()


def measure(folder: Path, *, trips: int) -> Sequence[float]:
    """Measure both ways."""
    bound_ms = 1e3 * LoopPace().tick_s + 5.0
    ratios = []
    for way in (in_process, over_tcp):
        (folder / way.__name__).mkdir()
        ms = way(trips, folder / way.__name__) * 1e3
        p50, p99 = np.percentile(ms, (50, 99))
        tell(f"{way.__name__}: p50 {p50:.1f} ms, p99 {p99:.1f} ms, worst {ms.max():.1f} ms")
        ratios.append(float(p99) / bound_ms)
    return ratios


BENCHMARK = Benchmark(
    {
        "p99 / a pass of the loop and 5 ms, virtual time": 1.0,
        "p99 / a pass of the loop and 5 ms, wall, over TCP": 1.0,
    },
    full=partial(measure, trips=1000),
    smoke=partial(measure, trips=4),
)
