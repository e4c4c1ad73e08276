"""What every kind of thermometers must do: in-process physics, the kernel's folder, serial devices."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests.contract.temperature.backends import BACKENDS, PLACES, Backend
from tests.drivers.amplifiers import PATIENCE_S, Collector


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Backend]:
    one = BACKENDS[request.param](tmp_path)
    yield one
    for sensor in one.sensors:
        sensor.close()
    one.close()


def begun(backend: Backend) -> list[Collector]:
    for sensor in backend.sensors:
        sensor.start()
    return [Collector(sensor) for sensor in backend.sensors]


def last_C(collector: Collector) -> list[float]:  # noqa: N802 - the unit keeps its capital
    """Return what a sensor has shown last [°C], empty before it has shown anything."""
    (channel,) = collector.sensor.facts.channels
    return [float(channel.calibration.apply(count)) for count in collector.take().counts[-1:]]


def until(backend: Backend, done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline_s
        backend.wait()


def test_each_sensor_has_its_name_its_place_and_its_address(backend: Backend) -> None:
    sensors = zip(backend.sensors, PLACES, backend.addresses, strict=True)
    for number, (sensor, place, address) in enumerate(sensors, 1):
        (channel,) = sensor.facts.channels
        assert (sensor.facts.name, channel.name, channel.place) == (f"temperature_{number}",) * 2 + (place,)
        assert (channel.quantity, channel.unit) == ("temperature", "°C")
        assert sensor.facts.clock == "host"
        assert address in sensor.facts.device
        assert sensor.facts.readings is not None
        assert sensor.facts.readings.low_C < 0.0
        assert sensor.facts.readings.high_C > 100.0


def test_readings_follow_what_each_sensor_feels(backend: Backend) -> None:
    got = begun(backend)
    wanted_C = (25.0, -1.0, 40.0)
    for index, shown_C in enumerate(wanted_C):
        backend.show(index, shown_C)
    until(backend, lambda: all(last_C(c) == [shown_C] for c, shown_C in zip(got, wanted_C, strict=True)))
    for collector in got:
        channel = collector.sensor.facts.channels[0]
        block = collector.blocks[-1]
        assert block.stream == channel.name
        sequence = [block.first_sequence for block in collector.blocks]
        assert sequence == list(range(len(sequence)))
        stamps = [int(block.time_us[0]) for block in collector.blocks]
        assert all(a < b for a, b in pairwise(stamps))
        assert collector.said == []


@pytest.mark.parametrize("fault", ["power-on", "silence"])
def test_a_sensor_that_fails_is_named_the_others_go_on_and_it_may_come_back(
    backend: Backend, fault: str
) -> None:
    if fault not in backend.faults:
        pytest.skip("sensors of this kind cannot fail so")
    got = begun(backend)
    until(backend, lambda: all(c.take().blocks for c in got))
    set_fault = backend.power_on if fault == "power-on" else backend.silence
    set_fault(1, lasts=True)
    until(backend, lambda: bool(got[1].take().said))
    said = got[1].said[0]
    assert said.startswith("temperature_2 (")
    assert ("power-on value" in said) == (fault == "power-on")
    assert "look at" in said
    got[1].take()
    before = [len(c.take().blocks) for c in got]
    until(backend, lambda: all(len(got[i].take().blocks) > before[i] for i in (0, 2)))
    assert len(got[1].blocks) == before[1]
    set_fault(1, lasts=False)
    until(backend, lambda: len(got[1].take().blocks) > before[1])
    assert got[0].said == got[2].said == []


def test_no_power_on_value_is_ever_a_reading(backend: Backend) -> None:
    if "power-on" not in backend.faults:
        pytest.skip("sensors of this kind have no power-on value")
    for index in range(3):
        backend.power_on(index, lasts=True)
        got = begun(backend)
        until(backend, lambda got=got, index=index: bool(got[index].take().said))  # type: ignore[misc]
        assert got[index].sensor.facts.readings is not None
        assert got[index].sensor.facts.readings.power_on_C == 85.0
        assert 85 * 16 not in got[index].counts
        backend.power_on(index, lasts=False)


def test_a_drain_never_waits(backend: Backend) -> None:
    got = begun(backend)
    began_s = time.process_time()
    for _ in range(200):
        for collector in got:
            collector.sensor.drain()
    assert time.process_time() - began_s < 1.0


def test_starting_and_closing_twice_is_quiet(backend: Backend) -> None:
    begun(backend)
    begun(backend)
    for sensor in backend.sensors:
        sensor.close()
        sensor.close()
