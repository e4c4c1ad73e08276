"""The adapter of the spring model: the sensor's lag against an ODE solver."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from bufferstand.model.prediction import heat_step
from bufferstand.model.spring import HeatBalance
from bufferstand.protocols.prediction.predictor import Temperatures, sensor_after


def solved(
    heat: HeatBalance, start: Temperatures, ambient_C: float, power_W: float, duration_s: float
) -> tuple[float, float]:
    def rate(_: float, state: NDArray[np.float64]) -> list[float]:
        mass, sensor = state
        target = ambient_C + heat.sensor_gain * (mass - ambient_C)
        warming = (power_W - heat.loss_W_per_K * (mass - ambient_C)) / heat.capacity_J_per_K
        return [warming, (target - sensor) / heat.sensor_lag_s]

    found = solve_ivp(rate, (0.0, duration_s), [start.mass_C, start.sensor_C], "LSODA", rtol=1e-9, atol=1e-9)
    return float(found.y[0, -1]), float(found.y[1, -1])


@given(
    capacity=st.floats(2000.0, 20_000.0),
    loss=st.one_of(st.just(0.0), st.floats(0.1, 50.0)),
    lag=st.floats(1.0, 500.0),
    gain=st.floats(0.5, 1.0),
    mass=st.floats(10.0, 50.0),
    sensor=st.floats(10.0, 50.0),
    power=st.floats(0.0, 5000.0),
    duration=st.floats(0.1, 2000.0),
)
def test_mass_and_sensor_go_as_the_differential_equations_say(
    capacity: float,
    loss: float,
    lag: float,
    gain: float,
    mass: float,
    sensor: float,
    power: float,
    duration: float,
) -> None:
    heat = HeatBalance(capacity, loss, sensor_lag_s=lag, sensor_gain=gain)
    start = Temperatures(mass, sensor)
    expected = solved(heat, start, 21.0, power, duration)
    found = (
        heat_step(heat, mass, 21.0, power, duration),
        sensor_after(heat, start, 21.0, power, duration),
    )
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-4)


def test_equal_time_constants_are_no_special_case() -> None:
    heat = HeatBalance(10_000.0, 10.0, sensor_lag_s=1000.0)
    start = Temperatures(40.0, 30.0)
    at = sensor_after(heat, start, 21.0, 500.0, 300.0)
    beside = sensor_after(HeatBalance(10_000.0, 10.0, sensor_lag_s=1000.0001), start, 21.0, 500.0, 300.0)
    assert at == pytest.approx(beside, abs=1e-4)
    assert at == pytest.approx(solved(heat, start, 21.0, 500.0, 300.0)[1], abs=1e-4)


def test_a_sensor_without_lag_reads_its_share_of_the_mass() -> None:
    heat = HeatBalance(10_000.0, 10.0, sensor_gain=0.8)
    start = Temperatures(40.0, 0.0)
    mass_C = heat_step(heat, 40.0, 21.0, 500.0, 300.0)
    assert sensor_after(heat, start, 21.0, 500.0, 300.0) == pytest.approx(
        21.0 + 0.8 * (mass_C - 21.0), rel=1e-9
    )


@given(first=st.floats(0.0, 500.0), second=st.floats(0.0, 500.0))
def test_two_waits_are_one_long_wait(first: float, second: float) -> None:
    heat = HeatBalance(10_000.0, 10.0, sensor_lag_s=40.0)
    start = Temperatures(35.0, 25.0)
    between = Temperatures(
        heat_step(heat, 35.0, 21.0, 800.0, first), sensor_after(heat, start, 21.0, 800.0, first)
    )
    in_two = sensor_after(heat, between, 21.0, 800.0, second)
    assert in_two == pytest.approx(sensor_after(heat, start, 21.0, 800.0, first + second), rel=1e-9)
