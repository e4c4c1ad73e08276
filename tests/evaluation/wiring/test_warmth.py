"""Thermometers that do not sit where the stand file says, and those that do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.wiring.bench import SINE, Recorded, evaluated, recorded

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]
ONE, TWO, ROOM = "temperature_1", "temperature_2", "temperature_3"


def rising(by_K: float) -> Change:
    """Return a sensor that rises evenly from 21 °C."""
    return lambda time_s, _: 21.0 + by_K * (time_s - time_s[0]) / (time_s[-1] - time_s[0])


def falling(at_s: float, tau_s: float, from_C: float = 33.0) -> Change:
    """Return a sensor that comes off at a time and follows the air."""
    return lambda time_s, _: 21.0 + (from_C - 21.0) * np.exp(-np.maximum(time_s - at_s, 0.0) / tau_s)


def air(time_s: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.full(time_s.size, 21.0)


RIGHT = {ONE: rising(7.0), TWO: rising(5.0), ROOM: air}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A record whose plan expected 7 K for the energy that was taken up."""
    made = recorded(tmp_path_factory.mktemp("warm"), SINE)
    step = {**made.document["step"], "start_temperature_C": 21.0, "sensor_end_temperature_C": 28.0}
    return Recorded({**made.document, "step": step}, made.streams, made.anchors)


def told(run: Recorded, folder: Path, shown: Mapping[str, Change]) -> set[tuple[str, str, str]]:
    found = evaluated(run.with_thermometers(shown).written(folder)).findings
    assert all(one.text.startswith(one.channel) for one in found)
    return {(one.kind, one.channel, one.effect) for one in found}


CASES: Mapping[str, tuple[dict[str, Change], set[tuple[str, str, str]]]] = {
    "right": ({}, set()),
    "a room that warms by a kelvin": ({ROOM: rising(1.0)}, set()),
    "swapped": ({ONE: air, ROOM: rising(7.0)}, {("swapped", ONE, "spoils"), ("swapped", ROOM, "noted")}),
    "never attached": ({ONE: air}, {("not-following", ONE, "spoils")}),
    "none attached": (
        {ONE: air, TWO: air},
        {("not-following", ONE, "spoils"), ("not-following", TWO, "spoils")},
    ),
    "the room's on the specimen": ({ROOM: rising(6.0)}, {("not-following", ROOM, "noted")}),
    "frozen": ({TWO: lambda t, _: np.full(t.size, 24.0)}, {("not-following", TWO, "spoils")}),
    "fallen off": ({ONE: falling(8.0, 15.0)}, {("detached", ONE, "spoils")}),
    "fallen off, at once": ({ONE: falling(8.0, 0.3, 35.0)}, {("detached", ONE, "spoils")}),
}


@pytest.mark.parametrize("name", CASES)
def test_a_thermometer_is_named_by_what_it_does(run: Recorded, tmp_path: Path, name: str) -> None:
    changed, expected = CASES[name]
    assert told(run, tmp_path, {**RIGHT, **changed}) == expected


@pytest.mark.parametrize("tau_s", [600.0])
def test_a_specimen_that_cools_is_no_sensor_that_fell_off(
    run: Recorded, tmp_path: Path, tau_s: float
) -> None:
    cooling = falling(2.0, tau_s, 60.0)
    kinds = {kind for kind, _, _ in told(run, tmp_path, {ONE: cooling, TWO: cooling, ROOM: air})}
    assert "detached" not in kinds


def test_where_the_plan_expected_no_rise_nothing_can_be_told(run: Recorded, tmp_path: Path) -> None:
    step = {**run.document["step"], "sensor_end_temperature_C": 23.0}
    calm = Recorded({**run.document, "step": step}, run.streams, run.anchors)
    assert told(calm, tmp_path, {ONE: rising(2.0), TWO: air, ROOM: air}) == set()


def test_the_temperature_of_a_fallen_sensor_is_no_pass(run: Recorded, tmp_path: Path) -> None:
    shown = {**RIGHT, ONE: falling(8.0, 15.0)}
    made = evaluated(run.with_thermometers(shown).written(tmp_path))
    assert made.extremes["temperature_max_C"].doubt or made.extremes["temperature_max_C"].channel != ONE
    (finding,) = made.findings
    assert finding.start_s <= 8.0
    assert "it has come off" in " ".join(made.warnings)
