"""Temperatures of cycles: readings that cover them, and what follows where they do not."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.quantities.temperature.coverage import (
    READING_INTERVAL_S,
    covers,
    longest_hole,
    readings_of,
)
from bufferstand.evaluation.quantities.temperature.of_cycles import temperatures_of
from bufferstand.evaluation.record.record import Temperature
from bufferstand.evaluation.requirements.limit_set import LimitSet, shipped_limit_set
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import Floats, StaticTest


def test_temperatures() -> None:
    at = np.arange(0.0, 100.0)
    sensors = (
        Temperature("temperature_1", at, 20.0 + 0.1 * at),
        Temperature("temperature_2", at, 30.0 - 0.1 * at),
        Temperature("temperature_3", at, np.full(100, 90.0), role="ambient"),
    )
    start, highest = temperatures_of(sensors, np.array([10.5, 500.0]), np.array([40.0, 510.0]))
    assert start == pytest.approx([28.95, np.nan], nan_ok=True)
    assert highest == pytest.approx([28.95, np.nan], nan_ok=True)
    assert np.all(np.isnan(temperatures_of(sensors[2:], np.array([10.0]), np.array([20.0]))))


def chain(time_s: Floats, start_s: float, end_s: float) -> float:
    """Return the longest distance between neighbours, found the slow way."""
    inside = [t for t in time_s if start_s <= t <= end_s]
    if inside:
        points = [start_s, *inside, end_s]
        return max(two - one for one, two in pairwise(points))
    return min([t - start_s for t in time_s if t > end_s] + [end_s - t for t in time_s if t < start_s])


@given(
    st.lists(st.floats(0.0, 300.0), min_size=1, max_size=25, unique=True),
    st.lists(st.tuples(st.floats(0.0, 300.0), st.floats(0.1, 100.0)), min_size=1, max_size=10),
)
def test_cover_is_that_of_the_longest_hole(readings: list[float], cycles: list[tuple[float, float]]) -> None:
    time_s = np.array(sorted(readings))
    starts = np.array([start for start, _ in cycles])
    ends = starts + np.array([length for _, length in cycles])
    found = covers(time_s, starts, ends)
    for start, end, covered in zip(starts.tolist(), ends.tolist(), found.tolist(), strict=True):
        hole = longest_hole(time_s, start, end)
        assert hole is not None
        assert hole.length_s == pytest.approx(chain(time_s, start, end))
        assert covered == (hole.length_s <= READING_INTERVAL_S)


@given(st.lists(st.floats(0.0, 100.0), min_size=2, max_size=20), st.floats(0.0, 80.0), st.data())
def test_a_further_reading_never_uncovers(readings: list[float], start_s: float, data: Any) -> None:
    """Tendency: more readings, shorter holes."""
    time_s = np.array(sorted(readings))
    before = longest_hole(time_s, start_s, start_s + 20.0)
    inside = data.draw(st.floats(start_s, start_s + 20.0))
    after = longest_hole(np.sort(np.append(time_s, inside)), start_s, start_s + 20.0)
    assert before is not None
    assert after is not None
    assert after.length_s <= max(before.length_s, 20.0)
    if np.any((time_s >= start_s) & (time_s <= start_s + 20.0)):
        assert after.length_s <= before.length_s


def test_readings_are_put_in_order_and_holes_in_them_leave() -> None:
    sensor = Temperature("t", np.array([3.0, 1.0, np.nan, 2.0]), np.array([30.0, 10.0, 5.0, np.nan]))
    time_s, value_C = readings_of(sensor)
    assert time_s.tolist() == [1.0, 3.0]
    assert value_C.tolist() == [10.0, 30.0]


GOOD = replace(StaticTest(), noise_kN=0.02)
FORCES = {"preload", "force-at-25mm", "force-at-60mm", "force-at-100mm"}
GOVERNED = FORCES | {"stored-energy", "absorbed-energy-ratio"}


def judged(sensors: list[Temperature], limits: LimitSet | None = None) -> RunEvaluation:
    record = replace(GOOD.record(), temperatures=tuple(sensors))
    return evaluate_run(record, GOOD.facts(), Options(draws=200), limits)


def rows(run: RunEvaluation) -> list[RequirementResult]:
    return [r for r in run.requirements if r.id == "temperature-range"]


def sensor(at: Floats, value: float = 20.0, name: str = "temperature_1") -> Temperature:
    return Temperature(name, at, np.full(at.size, value), accuracy_C=0.5)


CYCLES = [(c.cycle.start_s, c.cycle.end_s) for c in GOOD.evaluate(draws=0).cycles]
"""Some 41 s each."""
ALL = np.arange(0.0, CYCLES[-1][1] + 3.0, 1.0)


def without(first_s: float, last_s: float) -> Floats:
    return ALL[(first_s > ALL) | (last_s < ALL)]


def test_temperature_known_in_the_first_second_of_each_cycle_only() -> None:
    at = np.concatenate([ALL[(start - 1.0 <= ALL) & (start + 1.0 >= ALL)] for start, _ in CYCLES])
    run = judged([sensor(at)])
    assert [r.verdict for r in rows(run)] == ["inconclusive"] * 3
    assert "temperature_1 has no reading from" in rows(run)[0].why
    assert "permitted 15 s" in rows(run)[0].why
    assert {r.verdict for r in run.requirements if r.id in GOVERNED} == {"inconclusive"}
    assert run.verdict == "inconclusive"
    for result in run.cycles:
        assert result.quantities.temperature_start_C == pytest.approx(20.0)
        assert result.quantities.temperature_max_C is None
    assert any(
        "cycles 1 to 3: no highest temperature: temperature_1 has no reading" in w for w in run.warnings
    )


def test_a_far_reading_after_a_cycle_does_not_speak_for_its_end() -> None:
    """A specimen that is warmed in a pause without readings was not warm before it."""
    end = CYCLES[-1][1]
    at = np.append(ALL[end - 10.0 >= ALL], end + 14.0)
    warmed = Temperature("temperature_1", at, np.where(at > end, 40.0, 20.0), accuracy_C=0.5)
    run = judged([warmed])
    assert [r.verdict for r in rows(run)] == ["pass"] * 3
    assert run.cycles[-1].quantities.temperature_max_C == pytest.approx(20.0)


def test_a_hole_of_30_s_in_one_cycle() -> None:
    start, _ = CYCLES[1]
    run = judged([sensor(without(start + 5.0, start + 35.0))])
    assert [r.verdict for r in rows(run)] == ["pass", "inconclusive", "pass"]
    governed = {r.cycle: r.verdict for r in run.requirements if r.id in GOVERNED}
    assert governed == {1: "pass", 2: "inconclusive", 3: "pass"}
    assert [r.quantities.temperature_max_C is None for r in run.cycles] == [False, True, False]


@pytest.mark.slow
@pytest.mark.parametrize(("length_s", "verdict"), [(13.0, "pass"), (16.0, "inconclusive")])
@pytest.mark.parametrize("place", [0.0, 0.4, 1.0])
def test_limit_of_the_interval(place: float, length_s: float, verdict: str) -> None:
    start, end = CYCLES[0]
    first = start + place * (end - start - length_s)
    kept = ALL[(first >= ALL) | (first + length_s <= ALL)] if 0.0 < place < 1.0 else ALL
    if place == 0.0:
        kept = ALL[start + length_s <= ALL]
    if place == 1.0:
        kept = np.concatenate((ALL[end - length_s >= ALL], ALL[CYCLES[1][0] < ALL]))
    assert rows(judged([sensor(kept)]))[0].verdict == verdict


@pytest.mark.slow
def test_the_limit_set_may_say_otherwise() -> None:
    """One reading in 20 s: too few by default, enough for a set that says 30 s; figures follow."""
    conditions = shipped_limit_set().conditions.model_copy(update={"reading_interval_max_s": 30.0})
    patient = shipped_limit_set().model_copy(update={"conditions": conditions})
    slow = [sensor(np.arange(1.0, 200.0, 20.0))]
    assert {r.verdict for r in rows(judged(slow))} == {"inconclusive"}
    run = judged(slow, patient)
    assert {r.verdict for r in rows(run)} == {"pass"}
    assert all(c.quantities.temperature_max_C == pytest.approx(20.0) for c in run.cycles)
    assert patient.sha256 != shipped_limit_set().sha256


@pytest.mark.slow
def test_a_reading_out_of_range_breaks_it_whatever_is_missing() -> None:
    start, _ = CYCLES[1]
    at = without(start + 5.0, start + 35.0)
    hot = replace(sensor(at), temperature_C=np.where(np.abs(at - (start + 3.0)) < 0.6, 26.0, 20.0))
    run = judged([hot])
    assert [r.verdict for r in rows(run)] == ["pass", "fail", "pass"]
    assert rows(run)[1].measured == pytest.approx(26.0)


@pytest.mark.slow
def test_one_sensor_that_covers_is_enough_and_the_other_still_counts() -> None:
    start, _ = CYCLES[1]
    gappy = without(start + 5.0, start + 35.0)
    run = judged([sensor(ALL), sensor(gappy, 23.0, "temperature_2")])
    assert [r.verdict for r in rows(run)] == ["pass"] * 3
    assert "temperature_2 has no reading" in rows(run)[1].why
    assert run.cycles[1].quantities.temperature_max_C == pytest.approx(23.0)
    warm = judged([sensor(ALL), sensor(gappy, 26.0, "temperature_2")])
    assert [r.verdict for r in rows(warm)] == ["fail"] * 3


@pytest.mark.slow
def test_no_reading_near_a_cycle() -> None:
    run = judged([sensor(ALL[CYCLES[0][1] > ALL])])
    assert [r.verdict for r in rows(run)] == ["pass", "inconclusive", "inconclusive"]
    assert rows(run)[2].measured is None


@pytest.mark.slow
def test_fast_cycles_between_two_readings() -> None:
    """Cycles of 0.4 s with a reading every 10 s are covered; those in a hole of a minute are not."""
    starts = np.arange(0.0, 200.0, 0.4)
    at = np.concatenate((np.arange(0.0, 101.0, 10.0), np.arange(160.0, 211.0, 10.0)))
    first, highest = temperatures_of([sensor(at, 21.0)], starts, starts + 0.4)
    known = ~np.isnan(highest)
    lost = (starts > 114.7) & (starts < 144.9)
    np.testing.assert_array_equal(known, ~lost)
    assert np.all(np.isnan(first[(starts > 115.0) & (starts < 144.9)]))
