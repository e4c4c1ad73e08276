"""The forecast against the plan's own prediction, and what it makes of a plan under way."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.daq.monitor.forecast import PlanStretch, foresee, heat_balance_of, slope, stretches
from bufferstand.model.file import load_model
from bufferstand.model.spring import HeatBalance
from tests.daq.cases import SAMPLES
from tests.daq.run_in_process import sample_plan

HEAT = HeatBalance(20_000.0, 10.0, sensor_lag_s=30.0, sensor_gain=0.9)


def test_from_the_start_it_goes_where_the_plan_goes_to_and_stops_where_the_plan_expects_the_stop() -> None:
    plan, _ = sample_plan(SAMPLES / "demo.toml")
    heat = load_model(SAMPLES / "models" / "category-a-elastomer.toml").heat
    content = plan.as_dict()["steps"]
    left = stretches(content, ["pending"] * len(content), 0, plan.expected_duration_s)
    found = foresee(heat, 21.0, 0.0, 21.0, left, 40.0)
    times, values = np.array(found.points).T
    ends = np.cumsum([step["duration_s"] for step in content])[:-1]
    planned = [step["sensor_end_temperature_C"] for step in content[:-1]]
    assert np.interp(ends, times, values) == pytest.approx(planned, abs=0.35)
    assert found.step == len(content), "the last step means to run into the stop"
    assert found.reach_s == pytest.approx(ends[-1] + content[-1]["stops"][0]["at_s"], rel=0.08)
    assert found.points[-1] == (found.reach_s, 40.0)


def test_the_step_under_way_counts_with_what_is_left_of_it() -> None:
    plan, _ = sample_plan(SAMPLES / "demo.toml")
    content = plan.as_dict()["steps"]
    later_s = sum(step["expected_duration_s"] for step in content[3:])
    left = stretches(
        content, ["complete"] * 2 + ["running"] + ["pending"] * (len(content) - 3), 3, later_s + 5.0
    )
    assert (left[0].step, left[0].duration_s) == (3, pytest.approx(5.0))
    assert [stretch.step for stretch in left] == list(range(3, len(content) + 1))
    assert left[0].power_W == pytest.approx(content[2]["expected_heat_J"] / content[2]["expected_duration_s"])


def test_a_cold_wait_leads_back_to_the_air_and_more_power_gets_warmer_sooner() -> None:
    cooled = foresee(HEAT, 35.0, -0.01, 20.0, [PlanStretch(0.0, 14_000.0, 1)], 40.0)
    assert cooled.reach_s is None
    assert cooled.points[-1][1] == pytest.approx(20.0, abs=0.3)
    reached = [
        foresee(HEAT, 25.0, 0.0, 20.0, [PlanStretch(power, 14_000.0, 2)], 40.0).reach_s
        for power in (250, 500, 900)
    ]
    assert None not in reached
    assert reached == sorted(reached, reverse=True)  # type: ignore[type-var]
    assert foresee(HEAT, 25.0, 0.0, 20.0, [PlanStretch(50.0, 14_000.0, 2)], 40.0).reach_s is None
    assert foresee(HEAT, 25.0, 0.0, 20.0, [], 40.0).points == ((0.0, 25.0),)


def test_a_rising_sensor_means_a_warmer_mass() -> None:
    still, rising = (foresee(HEAT, 30.0, k, 20.0, [PlanStretch(0.0, 60.0, 1)], None) for k in (0.0, 0.05))
    assert rising.points[-1][1] > still.points[-1][1] + 0.5


def test_slope_is_the_straight_lines_of_the_last_minute() -> None:
    readings = [(float(t), 20.0 + 0.02 * t) for t in range(100)]
    assert slope(readings) == pytest.approx(0.02)
    assert slope([(t - 500.0, 90.0) for t, _ in readings[:40]] + readings) == pytest.approx(0.02)
    assert slope(readings[:3]) == 0.0


def test_a_campaign_without_readable_files_has_no_forecast(tmp_path: object) -> None:
    assert heat_balance_of(SAMPLES, "no-such.toml") is None
    assert heat_balance_of(SAMPLES, "demo.toml") is not None
