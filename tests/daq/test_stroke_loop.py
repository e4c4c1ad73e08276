"""The actuator's law: what slow lags tell of fast sines, and what responses tell of it, in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.position_loop import PositionLoop, fitted_loop
from bufferstand.daq.strokes.static_watch import RampWatch


def actuator(natural_Hz: float, servo_s: float, damping: float = 0.8) -> PositionLoop:
    return PositionLoop(1.0, natural_Hz**-2, 2.0 * damping / natural_Hz, 2.0 * math.pi * servo_s)


def slow_lag_s(loop: PositionLoop) -> float:
    return (loop.lag + loop.servo) / (2.0 * math.pi)


@pytest.mark.parametrize(
    ("natural_Hz", "servo_s", "within"),
    [(4.6, 0.02, 0.025), (6.9, 0.01, 0.01), (9.2, 0.003, 0.01), (17.0, 0.003, 0.003), (4.6, 0.003, 0.03)],
)
def test_a_slow_lag_tells_the_gain_of_a_fast_sine(natural_Hz: float, servo_s: float, within: float) -> None:
    true = actuator(natural_Hz, servo_s)
    known = fitted_loop({}, slow_lag_s(true))
    assert abs(known(2.5)) == pytest.approx(abs(true(2.5)), rel=within)


@pytest.mark.parametrize(("natural_Hz", "servo_s"), [(4.6, 0.02), (6.9, 0.01), (9.2, 0.003)])
def test_responses_at_two_frequencies_tell_those_between(natural_Hz: float, servo_s: float) -> None:
    true = actuator(natural_Hz, servo_s)
    known = fitted_loop({f: true(f) for f in (0.3, 2.5)}, slow_lag_s(true))
    for f in (0.5, 1.0, 1.5, 2.0):
        assert abs(known(f)) == pytest.approx(abs(true(f)), rel=0.007)


def test_nothing_known_is_an_actuator_that_does_what_it_is_told() -> None:
    assert fitted_loop({}, 0.0)(2.5) == 1.0


def test_a_ramp_shows_how_late_the_piston_is() -> None:
    watch, random = RampWatch(20.0), np.random.default_rng(3)
    for first in range(0, 2000, 10):
        time_s = (first + np.arange(10)) / 1000.0
        command = 20.0 * np.clip(time_s - 0.2, 0.0, 1.5)
        position = 20.0 * np.clip(time_s - 0.24, 0.0, 1.5) + 0.01 * random.standard_normal(10)
        values = {"command": command, "position": position}
        watch.take(ScaledBlock("controller", first, np.round(time_s * 1e6).astype(np.int64), values, 0, 0.0))
    assert watch.lag_s == pytest.approx(0.04, abs=0.001)
    assert RampWatch(20.0).lag_s == 0.0
