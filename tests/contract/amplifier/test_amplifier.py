"""What every amplifier must do, whatever its wire: in-process physics, two serial protocols, Modbus."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.contract.amplifier.backends import BACKENDS, Backend
from tests.drivers.amplifiers import Collector, until

RISING = tuple(range(1000, 5000, 200))
AFTER = (7, 8, 9, 10)  # a GSV-2's frame is certain when the next has begun


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Backend]:
    one = BACKENDS[request.param](tmp_path)
    yield one
    one.sensor.close()
    one.close()


def begun(backend: Backend) -> Collector:
    """Start, and forget what was there before the test gives values."""
    backend.sensor.start()
    backend.give(1, 2)
    got = Collector(backend.sensor)
    until(lambda: bool(got.take().blocks))
    time.sleep(0.05)
    got.take()
    return Collector(backend.sensor)


def test_it_says_what_it_is(backend: Backend) -> None:
    facts = backend.sensor.facts
    assert (facts.name, facts.clock) == ("amplifier", "host")
    (channel,) = facts.channels
    assert (channel.name, channel.quantity, channel.unit) == ("force_2", "force", "kN")
    assert facts.rate_Hz > 0
    assert facts.device


def test_nothing_comes_before_it_is_started(backend: Backend) -> None:
    assert list(backend.sensor.drain()) == []


def test_every_value_comes_once_in_order_with_rising_stamps(backend: Backend) -> None:
    got = begun(backend)
    backend.give(*RISING)
    backend.give(*AFTER)
    until(lambda: set(RISING) <= set(got.take().counts))
    values = [count for count in got.counts if count in set(RISING)]
    assert values == list(RISING)
    assert got.said == []
    time_us = np.concatenate([block.time_us for block in got.blocks])
    assert np.all(np.diff(time_us) > 0)
    following = got.blocks[0].first_sequence
    for block in got.blocks:
        assert block.stream == "amplifier"
        assert block.first_sequence == following + block.lost or block is got.blocks[0]
        following = block.first_sequence + len(block.time_us)
        assert set(block.counts) == {"force_2"}
        assert block.counts["force_2"].shape == block.time_us.shape
        assert block.counts["force_2"].dtype.kind in "if"


def test_starting_twice_does_nothing(backend: Backend) -> None:
    got = begun(backend)
    backend.sensor.start()
    backend.give(11, 12, 13, 14)
    until(lambda: {11, 12} <= set(got.take().counts))
    assert got.counts.count(11) == 1


def test_silence_gives_no_values(backend: Backend) -> None:
    got = begun(backend)
    time.sleep(0.1)
    assert [count for count in got.take().counts if count not in {1, 2}] == []


def test_a_drain_never_waits(backend: Backend) -> None:
    begun(backend)
    began_s = time.process_time()
    for _ in range(200):
        backend.sensor.drain()
    assert time.process_time() - began_s < 1.0


def test_an_overdriven_input_is_said_and_says_where_to_look(backend: Backend) -> None:
    got = begun(backend)
    backend.saturate()
    backend.saturate()
    until(lambda: bool(got.take().said))
    driven = [text for text in got.said if "is saturated" in text or "is overdriven" in text]
    assert driven
    assert all("look at" in text for text in driven)


def test_an_overloaded_transducer_is_said_once(backend: Backend) -> None:
    got = begun(backend)
    too_much = round(650.0 / backend.sensor.facts.channels[0].calibration.coefficients[1])
    backend.give(5000, 2_000_000, 4_000_000, 6_000_000, 7_500_000)
    backend.give(*[too_much] * 4)
    until(lambda: any("overloaded" in text for text in got.take().said))
    (said,) = [text for text in got.said if "overloaded" in text]
    assert "kN, the transducer bears 640; unload, and check its zero afterwards" in said


def test_closing_twice_is_quiet(backend: Backend) -> None:
    begun(backend)
    backend.sensor.close()
    backend.sensor.close()
    backend.sensor.drain()
    assert list(backend.sensor.drain()) == []
