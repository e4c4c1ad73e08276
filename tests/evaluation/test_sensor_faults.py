"""Codes of failed temperature sensors are no readings; temperatures that look like codes are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.record.temperature_sensors import CODES, POSSIBLE_C, said, true_readings
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from tests.evaluation.signals import Floats, StaticTest

AT_S = np.arange(60.0)
WARM_C = 22.0 + 0.02 * AT_S
BEYOND = [
    -127.0,
    850.0,
    999.9,
    -999.9,
    9999.0,
    -9999.0,
    3276.7,
    -3276.8,
    6553.5,
    1e9,
    9.91e37,
    -9.91e37,
    1e30,
]


@pytest.mark.parametrize("code", [85.0, 127.9375, 0.0, *BEYOND])
@pytest.mark.parametrize("rows", [[0], [59], [17], [0, 1, 2], [30, 31, 32, 33, 34, 35, 36, 37], [3, 9, 40]])
def test_codes_among_readings_are_faults(code: float, rows: list[int]) -> None:
    shown = WARM_C.copy()
    shown[rows] = code
    true, faults = true_readings(AT_S, shown)
    assert np.flatnonzero(~true).tolist() == rows
    (fault,) = faults
    assert fault.shown_C == code
    assert fault.times_s == tuple(map(float, rows))


@given(
    st.sampled_from([code for code, _ in CODES]),
    st.floats(-0.3, 0.3),
    st.sampled_from([1.0 / 16.0, 0.1, 0.5]),
    st.sampled_from([1.0, 10.0, 60.0]),
)
def test_a_slow_history_through_a_code_is_true(
    code: float, K_per_reading: float, resolution_C: float, interval_s: float
) -> None:
    shown = code + np.round(K_per_reading * (np.arange(40) - 20.0) / resolution_C) * resolution_C
    shown[::7] = code if abs(K_per_reading) < 0.1 else shown[::7]
    assume(np.ptp(shown) > 0.0)
    true, faults = true_readings(interval_s * np.arange(40), shown)
    assert true.all()
    assert faults == ()


@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=60), st.floats(-40.0, 90.0))
def test_a_temperature_that_moves_by_two_kelvins_a_reading_is_believed(
    steps: list[float], start_C: float
) -> None:
    shown = np.clip(start_C + np.cumsum(steps), *POSSIBLE_C)
    true, _ = true_readings(np.arange(len(steps)) * 1.0, shown)
    assert true.all()


def test_readings_of_ten_minutes_may_jump() -> None:
    shown = np.array([70.0, 85.0, 100.0, 85.0, 60.0])
    true, _ = true_readings(600.0 * np.arange(5), shown)
    assert true.tolist() == [True] * 5


def test_nothing_but_the_power_on_value_is_no_temperature() -> None:
    assert not true_readings(AT_S, np.full(60, 85.0))[0].any()
    assert true_readings(AT_S, np.zeros(60))[0].all()  # a cold room


@pytest.mark.parametrize("shown_C", [63.2, -12.0, 120.0])
def test_a_disturbed_reading_is_one_that_its_neighbours_disprove(shown_C: float) -> None:
    shown = WARM_C.copy()
    shown[[20, 40, 41]] = shown_C
    true, (fault,) = true_readings(AT_S, shown)
    assert np.flatnonzero(~true).tolist() == [20, 40, 41]
    assert "disturbed" in fault.what


def test_a_step_that_stays_is_no_disturbed_reading() -> None:
    shown = np.where(AT_S < 30.0, 20.0, 45.0)  # the sensor was moved from the room to the specimen
    assert true_readings(AT_S, shown)[0].all()


def test_missing_readings_are_no_faults() -> None:
    shown = WARM_C.copy()
    shown[5:20] = np.nan
    shown[10] = 85.0
    true, (fault,) = true_readings(AT_S, shown)
    assert np.flatnonzero(~true).tolist() == [10]
    (text,) = said("temperature_1 (plate)", [fault], 46)
    code = "85 °C, the power-on value of a DS18B20: it was reset and has not converted"
    assert text == f"temperature_1 (plate): sensor fault: {code}; at 10 s; left out of all figures"


# --- through import and verdict -----------------------------------------------------------------------


def judged(tmp_path: Path, temperature: Floats, heading: str = "temperature [°C]") -> dict[str, Any]:
    time, stroke, force = StaticTest(rate_Hz=50.0).columns()
    shown = np.full(time.size, np.nan)
    shown[::50] = np.resize(temperature, shown[::50].size)
    cells = [
        ",".join("" if np.isnan(v) else f"{v:.6g}" for v in row)
        for row in zip(time, stroke, force, shown, strict=True)
    ]
    source = tmp_path / "static.csv"
    source.write_text("\n".join([f"time [s],stroke [mm],force [kN],{heading}", *cells, ""]), encoding="utf-8")
    (tmp_path / "static.toml").write_text(
        '[specimen]\nid = "B"\nmax_stroke_mm = 105.0\nelastic_system = "elastomer"\n'
        'assembled = 2026-01-01T00:00:00Z\n[test]\nkind = "static"\nstarted = 2026-02-01T00:00:00Z\n',
        encoding="utf-8",
    )
    made = import_file(source, tmp_path / "out", ImportOptions())
    (run,) = evaluate_paths([made.path], Options(draws=100))["runs"]
    return dict(run)


ROOM = np.full(200, 20.5)


@pytest.mark.slow
@pytest.mark.parametrize("code", [85.0, -127.0, 999.9, 9.91e37])
def test_one_code_of_a_sensor_does_not_break_the_temperature_condition(tmp_path: Path, code: float) -> None:
    shown = ROOM.copy()
    shown[30] = code
    run = judged(tmp_path, shown)
    assert run["verdict"] == "pass"
    assert max(cycle["temperature_C"]["max"] for cycle in run["cycles"]) == pytest.approx(20.5)
    (warning,) = [text for text in run["warnings"] if "sensor fault" in text]
    assert "at 30 s; left out of all figures" in warning


def test_codes_in_fahrenheit_are_the_same_codes(tmp_path: Path) -> None:
    shown = np.full(200, 69.0)
    shown[[30, 40]] = 185.0, -196.6
    run = judged(tmp_path, shown, "temperature [°F]")
    assert run["verdict"] == "pass"
    assert sum("sensor fault" in text for text in run["warnings"]) == 2


def test_codes_for_a_minute_leave_the_condition_inconclusive(tmp_path: Path) -> None:
    shown = ROOM.copy()
    shown[20:80] = -127.0
    run = judged(tmp_path, shown)
    assert run["verdict"] == "inconclusive"
    assert "60 of " in next(text for text in run["warnings"] if "sensor fault" in text)


@pytest.mark.slow
def test_a_specimen_that_is_too_warm_is_still_too_warm(tmp_path: Path) -> None:
    run = judged(tmp_path, 84.0 + 0.0625 * (np.arange(200) % 32))
    assert run["verdict"] == "invalid"
    assert not any("sensor fault" in text for text in run["warnings"])
