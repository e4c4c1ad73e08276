"""The contract of a whole stand: one suite over physics in process, all kinds of wires, and a real stand.

What must hold of each device by itself is in the suites beside this one; here they are together, as the
acquisition and ``bufferstand check`` have them. Nothing is moved, so ``--hardware STAND.toml`` is harmless.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.check.devices import check_devices
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.interfaces import MotionState, SampleBlock, SensorFault, Stand
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from tests.contract.stand import backends
from tests.contract.stand.backends import BACKENDS, Bench

PATIENCE_S = 120.0
LONG = "polled over RTU, Modbus RTU amplifier, 1-Wire folder"


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.hardware)
        if name == "hardware"
        else pytest.param(name, marks=pytest.mark.long)
        if name == LONG
        else name
        for name in BACKENDS
    ],
)
def made(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[], Bench]]:
    """Give a way to the drivers of one stand; the stand itself stays as long as its tests."""
    folder = tmp_path_factory.mktemp("stand")
    if request.param == "in process":
        yield lambda: backends.in_process(folder)
    elif request.param == "hardware":
        file: StandFile = load_stand(Path(request.config.getoption("--hardware")))
        yield lambda: backends.bench_on("hardware", file)
    else:
        with backends.served(request.param, folder) as file:
            yield lambda: backends.bench_on(request.param, file)


@pytest.fixture
def bench(made: Callable[[], Bench]) -> Iterator[Bench]:
    one = made()
    yield one
    one.close()


def collect(
    bench: Bench, enough: Callable[[dict[str, list[SampleBlock]]], bool]
) -> dict[str, list[SampleBlock]]:
    """Read everything as the acquisition does until there is enough; a fault of a sensor is a failure."""
    got: dict[str, list[SampleBlock]] = {
        bench.controller.facts.name: [],
        **{sensor.facts.name: [] for sensor in bench.sensors},
    }
    end_s = bench.clock.wall_s() + PATIENCE_S
    while not enough(got):
        assert bench.clock.wall_s() < end_s, {name: len(blocks) for name, blocks in got.items()}
        for _ in range(20):
            block = bench.controller.read_block()
            if block is None:
                break
            got[block.stream].append(block)
        for sensor in bench.sensors:
            for item in sensor.drain():
                assert not isinstance(item, SensorFault), item.what
                got[item.stream].append(item)
        bench.clock.sleep(0.02)
    return got


def opened(bench: Bench) -> Bench:
    bench.controller.connect()
    for sensor in bench.sensors:
        sensor.start()
    return bench


def test_the_check_finds_nothing_wrong(bench: Bench) -> None:
    for _ in range(3):  # a busy machine reads late, and a simulated device answers late on it
        rows = check_devices(bench.file, bench.controller, bench.sensors, bench.clock, watch_s=2.0)
        wrong = [
            f"{row.device} {row.item}: {row.value}: {row.remark}"
            for row in rows
            if row.verdict is Verdict.FAULT and not row.item.endswith("rate")
        ]
        if not wrong:
            break
    assert wrong == []
    devices = {row.device for row in rows}
    assert devices >= {"controller", *(sensor.facts.name for sensor in bench.sensors)}


def test_every_stream_comes_with_its_own_channels_and_rising_stamps(bench: Bench) -> None:
    got = collect(opened(bench), lambda now: all(len(blocks) >= 2 for blocks in now.values()))
    channels = {one.facts.name: one.facts.channels for one in (bench.controller, *bench.sensors)}
    for name, blocks in got.items():
        following = blocks[0].first_sequence
        last_us = -1
        for number, block in enumerate(blocks):
            assert block.first_sequence == following + (block.lost if number else 0), name
            following = block.first_sequence + len(block.time_us)
            assert set(block.counts) == {channel.name for channel in channels[name]}
            assert all(column.shape == block.time_us.shape for column in block.counts.values())
            assert np.all(np.diff(block.time_us) > 0)
            assert block.time_us[0] > last_us
            last_us = int(block.time_us[-1])


def test_at_rest_the_values_agree_with_each_other(bench: Bench) -> None:
    got = collect(opened(bench), lambda now: all(blocks for blocks in now.values()))
    values: dict[str, float] = {}
    for one in (bench.controller, *bench.sensors):
        block = got[one.facts.name][-1]
        for channel in one.facts.channels:
            values[channel.name] = float(np.mean(channel.calibration.apply(block.counts[channel.name])))
    assert abs(values["stroke_1"] - values["stroke_2"]) < 2.0
    assert abs(values["force"] - values["force_2"]) < 0.02 * bench.file.limits.force_max_kN
    temperatures = [value for name, value in values.items() if name.startswith("temperature_")]
    assert temperatures
    assert all(-25.0 < value < 85.0 for value in temperatures)


def test_what_is_at_rest_says_so_and_lives(bench: Bench) -> None:
    opened(bench)
    first = bench.controller.status()
    assert first.state in (MotionState.OFF, MotionState.READY, MotionState.HOLDING)
    bench.clock.sleep(0.2)
    assert bench.controller.status().heartbeat != first.heartbeat


def test_closing_twice_is_quiet_and_leaves_no_thread(bench: Bench) -> None:
    opened(bench)
    stand = Stand(bench.controller, bench.sensors)
    stand.close()
    stand.close()
    left = {thread.name for thread in threading.enumerate() if thread is not threading.main_thread()}
    assert not left & {"amplifier", "1-wire"}
    assert not {name for name in left if name.startswith("bus")}
