"""A thermometer that has shown its heat and then stands still is named; a right one is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.recording.runfile.file import open_run
from tests.daq.stopped_bench import Body, right_alarms, stopped_at_s
from tests.daq.touch_stands import run_stand
from tests.daq.wiring_bench import Case, Floats, Signals, judge, signals_of, thermometers

FREEZES_S = 320.0
STOPPED = "[simulation.miswired.thermometer.temperature_1]\nfrozen_at_s = 60.0\n"
WAVEFORM = """
[[step]]
kind = "harmonic"
prestress_mm = 50.0
amplitude_mm = 25.0
frequency_Hz = 1.0
cycles = 200
"""
RIGHT = range(60)


@pytest.mark.parametrize(("power_W", "within_s"), [(3000.0, 45.0), (1000.0, 90.0), (300.0, 240.0)])
@pytest.mark.parametrize("lag_s", [5.0, 20.0])
@pytest.mark.parametrize("stated_times", [1.0, None])
def test_one_that_stops_amid_the_heating_is_named(
    power_W: float,
    within_s: float,
    lag_s: float,
    stated_times: float | None,
) -> None:
    body = Body(lag_s=lag_s, stated_times=stated_times, heating=((power_W, 1.0, 900.0),), freezes_s=FREEZES_S)
    at_s = stopped_at_s(body)
    assert at_s is not None
    assert 0.0 < at_s - FREEZES_S < within_s
    assert stopped_at_s(replace(body, freezes_s=None)) is None


@pytest.mark.parametrize("lag_s", [60.0, 120.0, 300.0])
def test_one_that_lags_by_minutes_is_named_within_five(lag_s: float) -> None:
    body = Body(lag_s=lag_s, heating=((1000.0, 1.0, 900.0),), freezes_s=FREEZES_S)
    at_s = stopped_at_s(body)
    assert at_s is not None
    assert at_s - FREEZES_S < 300.0


@pytest.mark.slow
def test_sixty_right_ones_at_random_are_not_doubted() -> None:
    assert right_alarms(RIGHT) == []


@pytest.mark.long
def test_two_thousand_right_ones_at_random_are_not_doubted() -> None:
    assert right_alarms(range(2000)) == []


@pytest.mark.slow
@pytest.mark.parametrize("cools_s", [600.0, 1000.0, 3000.0])
@pytest.mark.parametrize("stated_times", [0.6, 1.6, None])
def test_a_specimen_whose_losses_equal_its_heat_is_not_doubted(
    cools_s: float, stated_times: float | None
) -> None:
    heating = ((400.0, 1.0, 6.0 * cools_s), (0.0, 1.0, 300.0), (400.0, 1.0, 2.0 * cools_s))
    assert stopped_at_s(Body(cools_s=cools_s, stated_times=stated_times, heating=heating)) is None


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [1.0, pytest.param(10.0, marks=pytest.mark.long)])
def test_a_stand_in_virtual_time_names_it_with_its_facts(seconds: float) -> None:
    """Readings come every second, or every ten, as at ten times the speed of the wall."""
    case = Case(sines=((50.0, 25.0, 1.0, 240),), static_first=False, static_mm=1.0, block_s=0.2)
    signals = signals_of(case)
    slow = slice(None, None, int(seconds))
    signals = replace(
        signals,
        reading_s=signals.reading_s[slow],
        readings_C={name: values[slow] for name, values in signals.readings_C.items()},
    )

    def stops(own: Signals) -> Floats:
        value = own.readings_C["temperature_1"].copy()
        first = int(np.argmax(own.reading_s > 100.0))
        value[first:] = value[first]
        return value

    assert judge(signals).trip is None
    verdict = judge(thermometers(temperature_1=stops)(signals))
    assert verdict.trip is not None
    assert (verdict.trip.sensor, verdict.trip.doubt) == ("temperature_1", "still")
    assert "temperature_1" in verdict.trip.setting
    assert verdict.at_s - 100.0 < 60.0 + 4.0 * seconds


@pytest.mark.slow
def test_a_campaign_ends_with_its_sensor_and_it_is_data_of_the_run(tmp_path: Path) -> None:
    ran = run_stand(tmp_path, miswired=STOPPED, steps=WAVEFORM)
    assert ran.outcome.exit_status == 4, ran.outcome.reason
    assert (ran.trip["sensor"], ran.trip["doubt"]) == ("temperature_1", "still")
    trip = next(event for event in open_run(ran.outcome.runs[-1]).events if event.kind == "trip")
    assert trip.data["doubt"] == "still"
    assert "temperature_1 has shown" in ran.outcome.reason
    assert "it stands still" in ran.outcome.reason
