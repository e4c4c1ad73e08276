"""The stand in virtual time: the interfaces the acquisition sees, determinism, faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.interfaces import (
    Controller,
    EndReason,
    MotionState,
    SampleBlock,
    Sensor,
    SensorFault,
)
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.foundation.errors import CommandRejected, DeviceFault
from bufferstand.foundation.motions import Harmonic, RampTo, Release
from tests.drivers.simulated.standing import STAND, FrictionSpring, stand_file


def opened(folder: Path, *faults: ScheduledFault, text: str = STAND) -> InProcessStand:
    made = open_in_process(stand_file(folder, text), spring=FrictionSpring(), faults=faults)
    made.stand.controller.connect()
    for sensor in made.stand.sensors:
        sensor.start()
    return made


def enable(made: InProcessStand) -> None:
    made.stand.controller.enable(force_limit_kN=600.0, stroke_limit_mm=105.0, watchdog_ms=2000)


def drive(made: InProcessStand, sequence: int, most_s: float = 60.0) -> list[SampleBlock]:
    """Wait as the acquisition does: feed, read, look."""
    controller = made.stand.controller
    blocks: list[SampleBlock] = []
    until_s = made.clock.now_s() + most_s
    while made.clock.now_s() < until_s:
        made.clock.sleep(0.02)
        controller.feed_watchdog()
        while block := controller.read_block():
            blocks.append(block)
        if controller.status().done_sequence == sequence:
            return blocks
    pytest.fail("the motion has not ended")


def test_it_is_what_the_interfaces_say(tmp_path: Path) -> None:
    made = opened(tmp_path)
    controller: Controller = made.stand.controller
    sensors: tuple[Sensor, ...] = made.stand.sensors
    assert controller.facts.clock == "device"
    assert [c.name for c in controller.facts.channels] == [
        "force",
        "stroke_1",
        "stroke_2",
        "position",
        "command",
    ]
    assert [s.facts.name for s in sensors] == ["amplifier", "temperature_1", "temperature_2"]
    assert {s.facts.clock for s in sensors} == {"host"}
    assert controller.read_block() is None
    made.stand.close()


def test_a_harmonic_campaign_in_virtual_time(tmp_path: Path) -> None:
    made = opened(tmp_path)
    controller = made.stand.controller
    enable(made)
    blocks = drive(made, controller.start(RampTo(target_mm=40.0, speed_mm_per_s=50.0)))
    blocks += drive(
        made, controller.start(Harmonic(mean_mm=40.0, amplitude_mm=20.0, frequency_Hz=1.27, cycles=5))
    )
    status = controller.status()
    assert (status.cycles_done, status.end_reason, status.state) == (
        5,
        EndReason.REACHED,
        MotionState.HOLDING,
    )
    blocks += drive(made, controller.start(Release(speed_mm_per_s=50.0)))
    controller.disable()
    assert controller.status().state is MotionState.OFF
    sequence = np.concatenate([b.first_sequence + np.arange(b.time_us.size) for b in blocks])
    assert sequence.tolist() == list(range(sequence.size))
    time_us = np.concatenate([b.time_us for b in blocks])
    assert set(np.diff(time_us)) == {1000}
    log = made.truth.arrays()
    assert time_us.tolist() == log["time_us"][: time_us.size].tolist()
    assert {b.lost for b in blocks} == {0}
    assert controller.events() == []


def test_loop_area_of_the_samples_is_the_work_of_the_truth(tmp_path: Path) -> None:
    """Two ways to one energy: counts, calibrated and shifted by the stated delay, and ∫F dx inside."""
    made = opened(tmp_path)
    controller = made.stand.controller
    enable(made)
    drive(made, controller.start(RampTo(target_mm=40.0, speed_mm_per_s=50.0)))
    blocks = drive(
        made, controller.start(Harmonic(mean_mm=40.0, amplitude_mm=20.0, frequency_Hz=2.0, cycles=6))
    )
    channels = {c.name: c for c in controller.facts.channels}
    counts = {name: np.concatenate([b.counts[name] for b in blocks]) for name in channels}
    values = {name: c.calibration.apply(counts[name]) for name, c in channels.items()}
    time_s = np.concatenate([b.time_us for b in blocks]) / 1e6
    stroke = 0.5 * (values["stroke_1"] + values["stroke_2"])
    force = np.interp(time_s, time_s - channels["force"].delay_s, values["force"])
    window = slice(1000, 3000)  # four whole cycles at full amplitude
    measured_J = np.sum(0.5 * (force[window][1:] + force[window][:-1]) * np.diff(stroke[window]))
    log = made.truth.arrays()
    first = blocks[0].first_sequence
    work = log["work_J"][first:]
    true_J = work[window][-1] - work[window][0]
    assert true_J > 4 * 2 * 70.0 * 30.0
    assert measured_J == pytest.approx(true_J, rel=5e-3)


def test_same_seed_same_bytes_other_seed_other_noise(tmp_path: Path) -> None:
    def record(text: str) -> np.ndarray:
        made = opened(tmp_path, text=text)
        enable(made)
        blocks = drive(made, made.stand.controller.start(RampTo(target_mm=20.0, speed_mm_per_s=50.0)))
        return np.concatenate([b.counts["force"] for b in blocks])

    one = record(STAND)
    assert np.array_equal(one, record(STAND))
    assert not np.array_equal(one, record(STAND.replace("seed = 1", "seed = 2")))


def test_sensors_deliver_at_their_rates(tmp_path: Path) -> None:
    made = opened(tmp_path)
    amplifier, specimen, _ = made.stand.sensors
    got = {"amplifier": 0, "temperature_1": 0}
    for _ in range(101):
        made.clock.sleep(0.1)
        for sensor in (amplifier, specimen):
            for item in sensor.drain():
                assert isinstance(item, SampleBlock)
                assert item.first_sequence == got[item.stream]
                got[item.stream] += item.time_us.size
    assert got["temperature_1"] == 10
    assert got["amplifier"] == pytest.approx(2525, abs=10)


def test_silence_and_power_on_are_faults_while_they_last(tmp_path: Path) -> None:
    made = opened(
        tmp_path,
        ScheduledFault("temperature_1", "silent", 2.5, 4.5),
        ScheduledFault("temperature_1", "power-on", 4.5, 5.5),
        ScheduledFault("amplifier", "silent", 3.0),
    )
    amplifier, specimen, _ = made.stand.sensors
    made.clock.sleep(2.9)
    assert amplifier.drain()
    made.clock.sleep(3.2)
    items = specimen.drain()
    assert [isinstance(item, SensorFault) for item in items] == [False, False, True, True, True, False]
    texts = [item.what for item in items if isinstance(item, SensorFault)]
    assert "empty" in texts[0]
    assert "85.0" in texts[2]
    late = [item for item in amplifier.drain() if isinstance(item, SampleBlock)]
    assert all(item.time_us[-1] < 3.05e6 for item in late)


def test_a_lost_link_fails_after_its_timeout_and_the_stand_saves_itself(tmp_path: Path) -> None:
    made = opened(tmp_path)
    controller = made.stand.controller
    enable(made)
    drive(made, controller.start(RampTo(target_mm=60.0, speed_mm_per_s=50.0)))
    made.device.faults.add(ScheduledFault("controller", "lost", made.clock.now_s(), made.clock.now_s() + 8.0))
    before_s = made.clock.now_s()
    with pytest.raises(DeviceFault, match="no reply within"):
        controller.status()
    assert made.clock.now_s() == pytest.approx(before_s + 1.0)
    made.clock.sleep(8.0)
    status = controller.status()
    assert (status.fault_code, status.watchdog_trips, status.state) == (1, 1, MotionState.FAULT)
    assert status.force_kN < 0.2
    enable(made)
    assert controller.events()[-1].endswith("of the controller was reset")
    assert controller.status().state is MotionState.HOLDING


@pytest.mark.slow
def test_rejections_name_command_and_reason(tmp_path: Path) -> None:
    controller = opened(tmp_path).stand.controller
    with pytest.raises(
        CommandRejected, match=r"ramp to 20 mm at 50 mm/s .*: not possible in the present state"
    ):
        controller.start(RampTo(target_mm=20.0, speed_mm_per_s=50.0))
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=105.0, watchdog_ms=2000)
    with pytest.raises(CommandRejected, match="a parameter is out of range"):
        controller.start(RampTo(target_mm=106.0, speed_mm_per_s=50.0))
    with pytest.raises(DeviceFault, match=r"writing limits .*illegal data value"):
        controller.enable(force_limit_kN=700.0, stroke_limit_mm=105.0, watchdog_ms=2000)


@pytest.mark.slow
def test_reading_too_late_counts_what_is_lost(tmp_path: Path) -> None:
    made = opened(tmp_path)
    made.clock.sleep(0.1)
    before = made.stand.controller.read_block()
    assert before is not None
    made.clock.sleep(70.0)
    block = made.stand.controller.read_block()
    assert block is not None
    assert block.first_sequence == made.device.ring.total - 65536
    assert block.lost == block.first_sequence - len(before.time_us)


@pytest.mark.slow
def test_the_truth_need_not_be_kept(tmp_path: Path) -> None:
    made = open_in_process(stand_file(tmp_path), spring=FrictionSpring(), log_truth=False)
    made.clock.sleep(1.0)
    assert made.device.ring.total == 1000
    assert made.truth.arrays()["force_kN"].size == 0


@pytest.mark.slow
def test_virtual_clock_never_steps_back() -> None:
    clock = VirtualClock()
    seen: list[float] = []
    clock.listen(seen.append)
    clock.sleep(0.12)
    clock.sleep(-1.0)
    assert seen == pytest.approx([0.05, 0.10, 0.12])
    assert clock.now_s() == clock.wall_s() == pytest.approx(0.12)
