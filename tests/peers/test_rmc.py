"""The RMC's driver against an RMC that another author wrote from the manual alone: campaigns, faults."""

from __future__ import annotations

import json
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers import build_controller
from bufferstand.drivers.controllers.rmc import parse_address
from bufferstand.drivers.interfaces import Controller, ControllerStatus, EndReason, MotionState, SampleBlock
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import (
    DeviceFault,
    Harmonic,
    NotInCharge,
    RampTo,
    Release,
    StandStill,
    WallClock,
    WireLost,
)
from tests.contract.controller.backends import Bench
from tests.peers.campaigns import armed, bufferstand, command, write_campaign
from tests.peers.delta_rmc import Unsaid
from tests.peers.rmc_stand import RmcStand, rmc_stand


def reached(stand: RmcStand) -> Bench:
    clock = WallClock()
    controller = build_controller(load_stand(stand.path), clock)
    controller.connect()
    bench = Bench("another author's", controller, clock)
    bench.enable()
    return bench


def samples(blocks: list[SampleBlock]) -> tuple[np.ndarray, np.ndarray]:
    numbers = np.concatenate([one.first_sequence + np.arange(len(one.time_us)) for one in blocks])
    return numbers, np.concatenate([one.counts["position"] for one in blocks])


def true_positions(stand: RmcStand) -> np.ndarray:
    with stand.server.lock:
        return np.array([row[1] for row in stand.rmc.truth], dtype=np.float32)


def lag_to_truth(stand: RmcStand, numbers: np.ndarray, position: np.ndarray) -> int:
    """Return by how many samples the truth is numbered higher, found by the first moving ones."""
    truth = true_positions(stand)
    moving = int(np.flatnonzero(np.abs(np.diff(position)) > 1e-3)[20])
    at = numbers[moving]
    close = np.flatnonzero(truth == position[moving])
    for candidate in close:
        shift = int(candidate - at)
        several = slice(moving, moving + 50)
        if np.array_equal(truth[numbers[several] + shift], position[several]):
            return shift
    raise AssertionError("what was recorded never was")


def test_every_sample_is_the_truth_and_none_is_left_out(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        bench.done(bench.controller.start(RampTo(target_mm=12.0, speed_mm_per_s=20.0)))
        bench.done(
            bench.controller.start(Harmonic(mean_mm=12.0, amplitude_mm=5.0, frequency_Hz=2.0, cycles=3))
        )
        bench.finish()
        numbers, position = samples(bench.blocks)
        assert sum(block.lost for block in bench.blocks) == 0
        np.testing.assert_array_equal(np.diff(numbers), 1)
        shift = lag_to_truth(stand, numbers, position)
        np.testing.assert_array_equal(true_positions(stand)[numbers + shift], position)
        bench.rest()
        bench.controller.close()


@pytest.mark.parametrize("moves", [True, False])
def test_lost_replies_lose_no_sample_whatever_they_do_to_the_index(tmp_path: Path, moves: bool) -> None:
    with rmc_stand(tmp_path, Unsaid(index_moves_when_lost=moves)) as stand:
        bench = reached(stand)
        number = bench.controller.start(RampTo(target_mm=18.0, speed_mm_per_s=10.0))
        for _ in range(3):  # amid the ramp, or behind it where the computer is busy
            bench.controller.status()
            stand.server.lose(1)
            bench.drain()
            bench.feed()
        bench.done(number)
        bench.finish()
        numbers, position = samples(bench.blocks)
        assert sum(block.lost for block in bench.blocks) == 0
        shift = lag_to_truth(stand, numbers, position)
        np.testing.assert_array_equal(true_positions(stand)[numbers + shift], position)
        assert any("no reply" in event for event in bench.controller.events())
        bench.rest()
        bench.controller.close()


def lose_the_reply_to(stand: RmcStand, command: int, replies: int) -> None:
    """Lose the reply to the next such command, and so many in all."""
    answer = stand.server._reply
    left = [replies]

    def reply(wire: object, transaction: int, unit: int, body: bytes) -> None:
        is_command = body[0] == 16 and struct.unpack(">H", body[1:3])[0] == parse_address("%MD40.0").wire
        if is_command and left[0] and struct.unpack(">f", body[8:10] + body[6:8])[0] == command:
            stand.server.lose(left[0])
            left[0] = 0
        answer(wire, transaction, unit, body)  # type: ignore[arg-type]

    stand.server._reply = reply  # type: ignore[method-assign, assignment]


TROUBLES = {
    "late": lambda server: server.delay(0.3, 2),
    "later than the time limit": lambda server: server.delay(0.7, 1),
    "dropped": lambda server: server.drop(),
    "two lost": lambda server: server.lose(2),
}


@pytest.mark.parametrize("trouble", TROUBLES)
def test_trouble_on_the_wire_amid_a_sine_costs_no_sample(tmp_path: Path, trouble: str) -> None:
    """What a controller's ring outlasts, a plot of 4 s does, too; the sine is the one that was begun."""
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        bench.done(bench.controller.start(RampTo(target_mm=12.0, speed_mm_per_s=20.0)))
        motion = Harmonic(mean_mm=12.0, amplitude_mm=5.0, frequency_Hz=2.0, cycles=6)
        number = bench.controller.start(motion)
        bench.until(lambda status: status.cycles_done >= 1)
        TROUBLES[trouble](stand.server)
        for _ in range(3):  # a wire that is lost is asked again by whoever runs the campaign
            try:
                bench.feed()
                bench.drain()
                break
            except WireLost:
                assert trouble == "two lost"
        done = bench.done(number)
        assert (done.end_reason, done.cycles_done) == (EndReason.REACHED, 6)
        bench.finish()
        numbers, position = samples(bench.blocks)
        assert sum(block.lost for block in bench.blocks) == 0
        np.testing.assert_array_equal(np.diff(numbers), 1)
        shift = lag_to_truth(stand, numbers, position)
        np.testing.assert_array_equal(true_positions(stand)[numbers + shift], position)
        assert len([one for one in stand.rmc.log if one[1] == 72]) == 1
        bench.rest()
        bench.controller.close()


def test_a_controller_that_boots_anew_is_told_apart(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        bench.until(lambda _: len(bench.blocks) > 5)
        stand.server.reset()
        with pytest.raises(NotInCharge):
            bench.until(lambda _: False)
        assert not stand.rmc.axis.enabled
        bench.controller.close()


def test_an_overrun_is_counted_by_the_clock_and_told(tmp_path: Path) -> None:
    with rmc_stand(tmp_path, Unsaid(plot_samples=400)) as stand:
        bench = reached(stand)
        bench.until(lambda _: len(bench.blocks) > 5)
        begun_s, begun = bench.clock.now_s(), len(bench.blocks)
        while bench.clock.now_s() < begun_s + 1.0:  # the plot holds 0.4 s
            bench.feed()
            bench.clock.sleep(0.1)
        bench.until(lambda _: len(bench.blocks) > begun + 20)
        lost = sum(block.lost for block in bench.blocks[begun:])
        assert 500 <= lost <= 1500
        events = [event for event in bench.controller.events() if "overran" in event]
        assert len(events) == 1
        time_us = np.concatenate([block.time_us for block in bench.blocks])
        assert np.all(np.diff(time_us) > 0)
        bench.rest()
        bench.controller.close()


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_command_whose_reply_is_lost_is_done_once(tmp_path: Path, lost: int) -> None:
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        lose_the_reply_to(stand, 72, lost)
        bench.done(bench.controller.start(RampTo(target_mm=12.0, speed_mm_per_s=20.0)))
        before = len([one for one in stand.rmc.log if one[1] == 72])
        motion = Harmonic(mean_mm=12.0, amplitude_mm=3.0, frequency_Hz=2.0, cycles=2)
        done = bench.done(bench.controller.start(motion))
        assert (done.end_reason, done.cycles_done) == (EndReason.REACHED, 2)
        sines = [one for one in stand.rmc.log if one[1] == 72]
        assert len(sines) == before + 1
        assert sines[-1][2][:5] == (12.0, 3.0, 2.0, 4.0, 1.0), "two cycles besides, for its first and last"
        assert sines[-1][2][5] == 56 * 4096 + 118
        bench.rest()
        bench.controller.close()


def test_both_word_orders_are_told_apart_before_anything_is_sent(tmp_path: Path) -> None:
    with rmc_stand(tmp_path, Unsaid(low_word_first=False)) as stand:
        controller = build_controller(load_stand(stand.path), WallClock())
        with pytest.raises(DeviceFault, match='write word_order = "big"'):
            controller.connect()
        controller.close()
        assert [one[1] for one in stand.rmc.log] == [103], "the program's own"
    folder = tmp_path / "right"
    folder.mkdir()
    with rmc_stand(folder, Unsaid(low_word_first=False), word_order="big") as stand:
        controller = build_controller(load_stand(stand.path), WallClock())
        assert controller.connect().sample_rate_Hz == 1000.0
        controller.close()


def test_without_the_program_nothing_is_enabled(tmp_path: Path) -> None:
    with rmc_stand(tmp_path, with_program=False) as stand:
        controller = build_controller(load_stand(stand.path), WallClock())
        with pytest.raises(DeviceFault, match="the watchdog program is not loaded"):
            controller.connect()
        assert stand.rmc.log == []
        controller.close()


def test_a_stop_amid_a_sine_and_a_limit_of_the_device(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        controller: Controller = bench.controller
        bench.done(controller.start(RampTo(target_mm=12.0, speed_mm_per_s=20.0)))
        controller.start(Harmonic(mean_mm=12.0, amplitude_mm=5.0, frequency_Hz=1.0, cycles=20))
        bench.until(lambda status: status.cycles_done >= 1)
        held = bench.done(controller.start(StandStill()))
        assert held.state is MotionState.HOLDING
        assert abs(held.position_mm - 12.0) < 6.0
        bench.done(controller.start(Release(speed_mm_per_s=20.0)))

        controller.enable(force_limit_kN=10.0, stroke_limit_mm=20.0, watchdog_ms=5000)
        number = controller.start(RampTo(target_mm=15.0, speed_mm_per_s=10.0))
        tripped: ControllerStatus = bench.until(lambda status: status.state is MotionState.FAULT)
        assert (tripped.fault_code, tripped.end_reason) == (2, EndReason.DEVICE_LIMIT)
        assert tripped.done_sequence == number
        assert abs(tripped.force_kN) < 1.0
        controller.reset_fault()
        assert controller.status().fault_code == 0
        controller.give_back()
        controller.close()


def test_an_axis_that_halts_is_unloaded_and_can_be_reset(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        bench = reached(stand)
        number = bench.controller.start(RampTo(target_mm=15.0, speed_mm_per_s=5.0))
        bench.until(lambda status: status.position_mm > 5.0)
        with stand.server.lock:
            stand.rmc.axis.fault(0)  # following error
        tripped = bench.until(lambda status: status.state is MotionState.FAULT)
        assert (tripped.fault_code, tripped.done_sequence) == (4, number)
        with stand.server.lock:
            assert not stand.rmc.axis.enabled
            assert stand.rmc.force_kN == 0.0
        bench.controller.reset_fault()
        bench.enable()
        assert bench.controller.status().state is MotionState.HOLDING
        bench.rest()
        bench.controller.close()


def test_check_says_what_answers(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        done = bufferstand("check", stand.path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "delta-rmc" in done.stdout
    assert "12 samples of 4 data sets" in done.stdout
    assert "little, as the stand file says" in done.stdout
    assert "124 registers: 14 samples of 4 data sets" in done.stdout


def test_check_finds_out_how_much_one_read_may_be(tmp_path: Path) -> None:
    """A stand file that asks for too much is told by how much, before anything else fails for it."""
    with rmc_stand(tmp_path, unsaid=Unsaid(largest_read=101)) as stand:
        done = bufferstand("check", stand.path, "--json")
        assert done.returncode == 4
        rows = {row["item"]: row for row in json.loads(done.stdout)["findings"]}
        found = rows["largest read"]
        assert found["figures"] == {"largest_read": 100.0}
        assert found["verdict"] == "fault"
        assert "write largest_read = 100" in found["remark"]
        text = stand.path.read_text(encoding="utf-8")
        keys = "[controller.rmc]\n"
        assert keys in text
        stand.path.write_text(text.replace(keys, f"{keys}largest_read = 100\n"), encoding="utf-8")
        done = bufferstand("check", stand.path, "--json")
        rows = {row["item"]: row for row in json.loads(done.stdout)["findings"]}
        assert rows["largest read"]["verdict"] == "ok"


@pytest.mark.slow
def test_a_campaign_runs_on_it_and_evaluates(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        campaign = write_campaign(tmp_path)
        out = tmp_path / "out"
        done = bufferstand("run", campaign, "--out", out, *armed("run"))
        assert done.returncode == 0, done.stdout + done.stderr
        with stand.server.lock:
            assert not stand.rmc.axis.enabled
            assert stand.rmc.force_kN == 0.0
    runs = sorted(out.rglob("*.h5"))
    assert len(runs) == 2
    document = json.loads(bufferstand("evaluate", out, "--json", "-").stdout)
    kinds = {run["run"]["kind"]: run for run in document["runs"]}
    harmonic = kinds["harmonic"]
    steady = [cycle for cycle in harmonic["cycles"] if cycle["steady"]]
    assert len(steady) >= 3
    for cycle in steady:
        assert cycle["amplitude_mm"] == pytest.approx(8.0, rel=0.02)
        assert cycle["frequency_Hz"] == pytest.approx(2.5, rel=0.01)
        assert cycle["absorbed_energy_J"] > 0.0
    static = kinds["static"]
    assert static["extremes"]["stroke_max_mm"]["value"] == pytest.approx(15.0, abs=0.3)


@pytest.mark.slow
def test_a_killed_campaign_ends_by_the_watchdog_program(tmp_path: Path) -> None:
    with rmc_stand(tmp_path) as stand:
        campaign = write_campaign(tmp_path, cycles=200)
        words = command("run", campaign, "--out", tmp_path / "out", *armed("run"))
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            clock = WallClock()
            while not any(one[1] == 72 for one in stand.rmc.log):
                assert process.poll() is None, "it ended before its sine"
                assert clock.now_s() < 120.0
                clock.sleep(0.05)
            clock.sleep(1.0)
            process.kill()
        killed_s = clock.now_s()
        while stand.rmc.axis.enabled:
            assert clock.now_s() < killed_s + 2.0 + 20.0, "watchdog, and the way back at 20 mm/s"
            clock.sleep(0.02)
        assert stand.rmc.force_kN == 0.0
        moves = [one for one in stand.rmc.log if one[1] == 20]
        assert moves[-1][2][:2] == (-5.0, 20.0)
