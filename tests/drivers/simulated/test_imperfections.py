"""Drift, missed cycles and round trips of the simulated stand, each against its closed form."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.simulated.imperfections.drift import TransducerDrift
from bufferstand.drivers.simulated.imperfections.latency import LEAST_WAIT_S, DelayedConnection, Latency
from bufferstand.drivers.simulated.imperfections.missed_cycles import NEVER, MissedCycles
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.foundation.motions import RampTo
from tests.drivers.simulated.standing import STAND, FrictionSpring, LinearSpring, device, stand_file

HOUR_S = 3600.0
QUIET: dict[str, Any] = {
    "force_noise_kN": 0.0,
    "stroke_noise_mm": 0.0,
    "wire_linearity_mm": 0.0,
    "wire_tilt": 0.0,
}


def test_zero_and_gain_follow_time_and_temperature() -> None:
    drift = TransducerDrift(
        (0.4, 1.0, -1.0), (0.2, 0.01, 0.0), (0.0126, 0.0, 0.004), (2e-5, 0.0, 1e-4), 5.0, 1800.0
    )
    time_s = np.array([0.0, 1800.0, 100.0 * HOUR_S])
    values = np.tile([600.0, 80.0, 80.0], (3, 1))
    drift.feel(time_s, values)
    warmth = np.array([0.0, 5.0 * (1.0 - math.exp(-1.0)), 5.0])
    np.testing.assert_allclose(drift.warmth_K(time_s), warmth, rtol=1e-12)
    hours = time_s / HOUR_S
    force = 600.0 * (1.0 + 2e-5 * warmth) + 0.4 + 0.2 * hours + 0.0126 * warmth
    np.testing.assert_allclose(values[:, 0], force, rtol=1e-12)
    np.testing.assert_allclose(values[:, 1], 81.0 + 0.01 * hours, rtol=1e-12)
    np.testing.assert_allclose(values[:, 2], 80.0 * (1.0 + 1e-4 * warmth) - 1.0 + 0.004 * warmth, rtol=1e-12)


def test_both_amplifiers_and_both_wires_read_the_drift_and_the_truth_does_not(tmp_path: Path) -> None:
    drifting: dict[str, Any] = {
        "warm_up_K": 10.0,
        "warm_up_s": 10.0,
        "force_zero_kN_per_K": 0.5,
        "force_gain_per_K": 1e-3,
    }
    drifting |= {"wire_zero_mm_per_K": (0.1, -0.1), "wire_drift_mm_per_h": (36.0, 0.0)}
    stand = device(tmp_path, LinearSpring(), **QUIET, **drifting)
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=20.0, speed_mm_per_s=20.0))
    stand.controller.execute(1)
    stand.advance(40_000)
    channels = {channel.name: channel for channel in stand_file(tmp_path).controller.channel}
    _, counts = stand.ring.window(39_000, 1000)
    read = {
        name: channels[name].calibration.apply(counts[name].astype(float))
        for name in counts
        if name != "tick"
    }
    truth = {name: column[39_000:] for name, column in stand.truth.arrays().items()}  # type: ignore[union-attr]
    made_s = (truth["sequence"] + 1) * stand.period_s
    warmth = 10.0 * (1.0 - np.exp(-made_s / 10.0))
    force = truth["force_kN"] * (1.0 + 1e-3 * warmth) + 0.5 * warmth
    np.testing.assert_allclose(read["force"], force, atol=2e-4)
    np.testing.assert_allclose(read["stroke_1"], truth["stroke_mm"] + 0.1 * warmth + 0.01 * made_s, atol=5e-3)
    np.testing.assert_allclose(read["stroke_2"], truth["stroke_mm"] - 0.1 * warmth, atol=5e-3)
    last = list(stand.instruments[0].frames)[-1]
    assert last.counts[-1] * 7.885695443832332e-05 == pytest.approx(force[-1], abs=0.02)
    assert stand.controller.step(0.0, 20.0) == 20.0  # what it acts on has a tare of its own


def test_missed_cycles_are_as_frequent_as_is_said_and_the_same_for_the_same_seed() -> None:
    def first(number: int, seed: int) -> list[int]:
        schedule, found = MissedCycles(36.0, 1000.0, np.random.SeedSequence(seed)), []
        for _ in range(number):
            found.append(schedule.next)
            schedule.draw()
        return found

    many = first(4000, 1)
    apart = np.diff(many)
    assert np.mean(apart) == pytest.approx(100_000, rel=0.05)  # 100 s each; ± 1.6 % (standard error)
    assert np.std(apart) == pytest.approx(100_000, rel=0.1)  # exponential: they know nothing of each other
    assert many == first(4000, 1)
    assert many[:5] != first(5, 2)
    assert MissedCycles(0.0, 1000.0, np.random.SeedSequence(1)).next == NEVER


def test_a_missed_cycle_is_a_period_without_a_sample_in_which_the_stand_goes_on(tmp_path: Path) -> None:
    stand = device(tmp_path, LinearSpring(), **QUIET, missed_cycles_per_h=18_000.0)
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=100.0, speed_mm_per_s=20.0))
    stand.controller.execute(1)
    stand.advance(3500)
    assert stand.ring.missed > 5
    assert stand.ring.periods == 3500
    assert stand.time_s == pytest.approx(3500 * stand.period_s)
    truth = stand.truth.arrays()  # type: ignore[union-attr]
    steps = np.diff(truth["time_us"])
    assert np.count_nonzero(steps == 2000) + 2 * np.count_nonzero(steps == 3000) >= stand.ring.missed - 1
    assert set(steps) <= {1000, 2000, 3000}
    assert truth["time_us"][-1] <= 3_500_000
    assert np.array_equal(truth["sequence"], np.arange(stand.ring.total))
    # The command waits for the controller, the piston does not wait for the command.
    gap = int(np.flatnonzero(steps == 2000)[-1])
    assert truth["command_mm"][gap + 1] - truth["command_mm"][gap] == pytest.approx(0.02)
    assert truth["position_mm"][gap + 1] - truth["position_mm"][gap] == pytest.approx(0.04, abs=0.005)
    assert int(stand.tick_us(stand.time_s)) == pytest.approx(3_500_000, abs=1)


def test_missed_cycles_are_the_same_in_slices_of_any_length(tmp_path: Path) -> None:
    whole, pieces = (device(tmp_path, FrictionSpring(), missed_cycles_per_h=18_000.0) for _ in range(2))
    for stand in (whole, pieces):
        stand.controller.control(0x000F)
        stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=30.0))
        stand.controller.execute(1)
    whole.advance(2000)
    for count in (1, 199, 250, 3, 547, 1000):
        pieces.advance(count)
    assert whole.ring.missed == pieces.ring.missed > 3
    for name, column in whole.ring.window(0, 2000)[1].items():
        np.testing.assert_array_equal(column, pieces.ring.window(0, 2000)[1][name])


def test_ways_take_half_the_floor_and_an_exponential_excess() -> None:
    latency = Latency(3e-4, 1e-4, seed=1)
    ways = np.array([latency.way_s() for _ in range(20_000)])
    assert ways.min() >= 1.5e-4
    assert np.mean(ways) - 1.5e-4 == pytest.approx(5e-5, rel=0.05)
    assert np.std(ways) == pytest.approx(5e-5, rel=0.05)
    again = Latency(3e-4, 1e-4, seed=1)
    assert [again.way_s() for _ in range(100)] == ways[:100].tolist()
    assert Latency(0.0, 0.0, seed=1).way_s() == 0.0


def test_in_virtual_time_each_request_takes_its_round_trip(tmp_path: Path) -> None:
    text = STAND + "reply_latency_s = 0.004\n"
    made = open_in_process(stand_file(tmp_path, text), spring=LinearSpring())
    controller, clock = made.stand.controller, made.clock
    controller.connect()
    assert clock.now_s() == pytest.approx(0.004)
    controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=2000)
    began_s = clock.now_s()
    block = controller.read_block()
    assert block is not None
    assert clock.now_s() - began_s == pytest.approx(0.004)
    # What is read was sampled before the reply was on its way.
    assert block.received_s - block.time_us[-1] * 1e-6 == pytest.approx(0.002, abs=0.0011)
    began_s = clock.now_s()
    status = controller.status()
    assert status.tick_us == pytest.approx((began_s + 0.002) * 1e6, abs=100)


def test_the_same_seed_gives_the_same_stand_waits_and_all(tmp_path: Path) -> None:
    def played(seed: int) -> list[tuple[float, int, bytes]]:
        text = STAND.replace("seed = 1", f"seed = {seed}")
        text += "reply_latency_s = 0.0003\nreply_jitter_s = 0.0005\nmissed_cycles_per_h = 36000.0\n"
        made = open_in_process(stand_file(tmp_path, text), spring=FrictionSpring())
        controller = made.stand.controller
        heard: list[tuple[float, int, bytes]] = []
        controller.connect()
        controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=2000)
        controller.start(RampTo(target_mm=30.0, speed_mm_per_s=20.0))
        for _ in range(100):
            made.clock.sleep(0.01)
            controller.feed_watchdog()
            while (block := controller.read_block()) is not None:
                heard.append((block.received_s, block.lost, block.counts["force"].tobytes()))
        return heard

    one = played(1)
    assert one == played(1)
    assert sum(lost for _, lost, _ in one) > 0
    other = played(2)
    assert [at_s for at_s, *_ in other] != [at_s for at_s, *_ in one]


@pytest.mark.slow
@pytest.mark.parametrize("ways", [[0.0] * 5, [0.01, 0.0, 0.002, 0.0, 0.0]])
def test_what_is_sent_arrives_in_its_order_and_not_before_its_time(ways: list[float]) -> None:
    async def main() -> list[tuple[int, float]]:
        loop, came = asyncio.get_running_loop(), []
        left = iter(ways)
        way, began_s = DelayedConnection(lambda: next(left)), loop.time()
        for number in range(len(ways)):
            way.send(lambda number=number: came.append((number, loop.time() - began_s)))  # type: ignore[misc]
        at_once = len(came)
        while len(came) < len(ways):
            await asyncio.sleep(0.001)
        assert at_once == (len(ways) if ways[0] < LEAST_WAIT_S else 0)
        return came

    came = asyncio.run(main())
    assert [number for number, _ in came] == list(range(len(ways)))
    assert all(after_s >= max(ways[: number + 1]) for number, after_s in came)
