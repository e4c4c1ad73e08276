"""Conditions of EN 15551 that a plan will miss, and the stroke history that it shows."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from bufferstand.foundation.motions import Harmonic
from bufferstand.foundation.specimen.file import Specimen
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.planning.standard_conditions import missed_conditions
from bufferstand.protocols.planning.stroke_history import POINTS_PER_CYCLE, stroke_over_time
from tests.protocols.conftest import SPECIMEN, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

BEGINS = datetime(2026, 3, 5, 8, 0, tzinfo=UTC)
GOOD = '[[step]]\nkind = "static"\ncycles = 3\npause_s = 10\n'
MANY = (
    GOOD
    + '[[step]]\nkind = "hold"\nforce_kN = 320\nduration_s = 5\n'
    + '[[step]]\nkind = "inner-loops"\nmean_mm = [20, 50]\namplitude_mm = 5\nfrequency_Hz = 0.5\n'
    + harmonic(20, 20)
    + '[[step]]\nkind = "cool-down"\ntemperature_C = 25\n'
)


def missed(made: Plan, hours: float | None = 100.0) -> list[str]:
    assembled = None if hours is None else BEGINS - timedelta(hours=hours)
    return missed_conditions(made.steps, SPECIMEN.model_copy(update={"assembled": assembled}), BEGINS)


def test_a_test_by_the_standard_misses_nothing(plan: MakePlan) -> None:
    assert missed(plan(GOOD + harmonic(20, 20, cycles=3))) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace("cycles = 3", "cycles = 2"), "2 cycles (3 needed)"),
        (GOOD + "speed_mm_per_s = 60\n", "60 mm/s (at most 50)"),
        (GOOD.replace("= 10", "= 900"), "pauses of 15 min 00 s (at most 10 min 00 s)"),
        ("[conditions]\nambient_C = 12\n" + GOOD, "12.0 °C expected (at least 15)"),
        ("[conditions]\nambient_C = 26\n" + GOOD, "°C expected (at most 25)"),
    ],
)
def test_each_condition_that_will_be_missed_is_said(plan: MakePlan, text: str, said: str) -> None:
    (warning,) = missed(plan(text))
    assert said in warning
    assert warning.startswith("step 1 “static, ")
    assert "is no test by EN 15551" in warning


def test_the_age_counts_when_the_step_begins(plan: MakePlan) -> None:
    assert "71 h after assembly (at least 72 h)" in missed(plan(GOOD), 71.0)[0]
    assert missed(plan(GOOD), 72.0) == []
    waits = '[[step]]\nkind = "hold"\nduration_s = 4000\n'
    assert missed(plan(waits + GOOD), 71.0) == []
    assert "does not say when it was assembled" in missed(plan(GOOD), None)[0]
    assert missed_conditions(plan(GOOD).steps, SPECIMEN) == []


def test_other_tests_and_other_specimens_are_not_looked_at(plan: MakePlan) -> None:
    proof = '[[step]]\nkind = "static"\nproof_load = "F2"\nforce_limit_kN = 510\n'
    assert missed(plan(proof)) == []
    short = GOOD.replace("cycles = 3", "cycles = 1")
    hook = Specimen(id="H", kind="draw-gear")
    assert missed_conditions(plan(short).steps, hook, BEGINS) == []


def test_the_stroke_history_is_the_plans(plan: MakePlan) -> None:
    """Time adds up, strokes stay within the motions' own, and every step begins and ends unloaded."""
    made = plan(MANY, spring=ClosedFormSpring(capacity_J_per_K=1e12))
    for step in made.steps:
        time_s, stroke_mm = stroke_over_time(step)
        assert time_s[-1] == pytest.approx(step.duration_s, rel=1e-9)
        assert np.all(np.diff(time_s) >= 0.0)
        assert stroke_mm[0] == 0.0
        assert stroke_mm[-1] == pytest.approx(0.0, abs=1e-9)
        assert stroke_mm.min() > -1e-9
    tops = [float(stroke_over_time(step)[1].max()) for step in made.steps]
    end_mm = ClosedFormSpring().static(600.0, 105.0, 5.0, 21.0).end_stroke_mm
    force_mm = ClosedFormSpring().static(320.0, 105.0, 1.0, 21.0).end_stroke_mm
    assert tops == pytest.approx([end_mm, force_mm, 55.0, 40.0, 0.0], rel=1e-3)


def test_a_sine_in_the_history_has_its_frequency(plan: MakePlan) -> None:
    (step,) = plan(harmonic(20, 10, "frequency_Hz = 2.0", cycles=6)).steps
    time_s, stroke_mm = stroke_over_time(step)
    sine = step.motions[1]
    assert isinstance(sine, Harmonic)
    inside = stroke_mm[2 : 2 + 8 * POINTS_PER_CYCLE]
    times = time_s[2 : 2 + 8 * POINTS_PER_CYCLE]
    peaks = times[1:-1][(inside[1:-1] > inside[:-2]) & (inside[1:-1] >= inside[2:])]
    assert np.diff(peaks)[1:-1] == pytest.approx(0.5, abs=0.02)
    assert inside.max() == pytest.approx(30.0, abs=1e-9)
