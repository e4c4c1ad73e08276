"""Specimens without a spring model: a catalogue's curve, what one slow stroke shows, and nothing at all."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.foundation.specimen.maker_data import Catalogue
from bufferstand.model.file import load_model
from bufferstand.model.simulation import simulate
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.curve_predictor import (
    CurvePredictor,
    UnknownSpecimenPredictor,
    curve_of_stroke,
)
from bufferstand.protocols.prediction.predictor import Temperatures
from tests.protocols.conftest import SPECIMEN, STAND, Load, harmonic

MODEL = Path(__file__).parents[2] / "sample_runs/models/category-a-elastomer.toml"
LINEAR = CurvePredictor(((0.0, 10.0), (50.0, 110.0), (100.0, 210.0)), 0.5, 10_000.0, 1.15, "a test")
"""F = 10 kN + 2 kN/mm x."""
SLOW = '[[step]]\nkind = "static"\nspeed_mm_per_s = 5.0\n'


def test_a_linear_curve_by_hand() -> None:
    cycle = LINEAR.harmonic(50.0, 20.0, 1.0, 21.0)
    assert cycle.peak_force_kN == pytest.approx(150.0)
    assert cycle.lower_force_kN == pytest.approx(0.5 * 70.0)
    assert cycle.absorbed_energy_J == pytest.approx(0.5 * 40.0 * 110.0, rel=1e-4)
    slow = LINEAR.static(150.0, 105.0, 5.0, 21.0)
    assert (slow.end_stroke_mm, slow.peak_force_kN) == pytest.approx((70.0, 150.0), rel=1e-4)
    assert slow.absorbed_energy_J == pytest.approx(0.5 * (10.0 * 70.0 + 70.0**2), rel=1e-3)
    behind = LINEAR.harmonic(50.0, 20.0, 1.0, 21.0, 1.0 / 100.0)
    assert behind.stroke.upper_mm == pytest.approx((70.0 - 0.1) / 1.02, abs=1e-3)
    warm = LINEAR.temperatures_after(Temperatures(21.0, 21.0), 21.0, 1000.0, 20.0)
    assert warm.mass_C == pytest.approx(23.0)


def test_a_limit_is_judged_with_the_margin_and_the_rest_is_the_curve() -> None:
    bounding = LINEAR.bounding()
    assert bounding.harmonic(50.0, 20.0, 1.0, 21.0).peak_force_kN == pytest.approx(1.15 * 150.0)
    path = np.array([1.0, 50.0, 70.0])
    assert bounding.forces(path, path, 21.0) == pytest.approx(1.15 * (10.0 + 2.0 * path))


@given(
    st.lists(st.floats(0.5, 30.0), min_size=2, max_size=8),
    st.lists(st.floats(0.5, 200.0), min_size=8, max_size=8),
    st.floats(0.0, 50.0),
)
def test_the_curve_rises_wherever_its_points_do(
    rises: list[float], forces: list[float], preload: float
) -> None:
    strokes = np.concatenate([[0.0], np.cumsum(rises)])
    points = tuple(
        zip(strokes, preload + np.concatenate([[0.0], np.cumsum(forces[: len(rises)])]), strict=True)
    )
    curve = CurvePredictor(points, 0.4, None, 1.15, "a test")
    at = np.linspace(1e-6, strokes[-1] * 1.1, 300)
    force = curve.forces(at, at, 21.0)
    assert np.all(np.diff(force) > 0.0)
    assert force[0] >= preload - 1e-9


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**31), noise_kN=st.floats(0.0, 0.5), top=st.floats(40.0, 95.0))
def test_one_slow_stroke_shows_the_spring(seed: int, noise_kN: float, top: float) -> None:
    """Against the model that made it: 3 % of force, the share of its loop, and nothing of what follows."""
    model = load_model(MODEL)
    stroke = np.concatenate(
        [np.zeros(50), np.linspace(0.0, top, 4000), np.linspace(top, 0.0, 4000), np.zeros(50)]
    )
    stroke = np.concatenate([stroke, stroke])
    time = np.arange(len(stroke)) * 0.005
    found = simulate(model, time, stroke, temperature_C=21.0, ambient_C=21.0)
    rng = np.random.default_rng(seed)
    curve = curve_of_stroke(
        stroke + rng.normal(0.0, 0.005, len(stroke)), found.force_kN + rng.normal(0.0, noise_kN, len(stroke))
    )
    assert curve is not None
    assert curve.known_to_mm == pytest.approx(top, abs=0.1)
    for share in (0.2, 0.5, 0.8, 1.0):
        row = 50 + round(share * 3999)
        assert curve.harmonic(stroke[row] / 2, stroke[row] / 2, 1.0, 21.0).peak_force_kN == pytest.approx(
            found.force_kN[row], rel=0.03, abs=1.0
        )
    half = slice(50, 4050)
    whole = slice(50, 8050)
    stored, absorbed = (float(np.trapezoid(found.force_kN[part], stroke[part])) for part in (half, whole))
    assert curve.absorbed_share == pytest.approx(absorbed / stored, abs=0.02)


def test_what_is_no_stroke_shows_no_curve() -> None:
    nothing = np.zeros(1000)
    assert curve_of_stroke(nothing, nothing) is None
    assert curve_of_stroke(np.full(5, np.nan), np.full(5, np.nan)) is None
    assert curve_of_stroke(np.linspace(0.0, 50.0, 500), np.zeros(500)) is None


def planned(load: Load, text: str, predictor: CurvePredictor | UnknownSpecimenPredictor) -> Plan:
    return make_plan(load(text), STAND, predictor, SPECIMEN)


def test_a_catalogue_s_plan_says_what_it_rests_on(load: Load) -> None:
    plan = planned(load, SLOW + harmonic(50.0, 20.0), LINEAR)
    assert plan.steps[1].expected_peak_force_kN == pytest.approx(1.15 * 150.0)
    assert "known to 100 mm; limits are judged with 15 % more" in plan.assumptions[0]
    assert plan.knows_heat
    with pytest.raises(BadInput, match="the stroke of 104 mm is beyond 100 mm, to which its force is known"):
        planned(load, harmonic(60.0, 44.0), LINEAR)
    with pytest.raises(BadInput, match=r"= 184 kN is above force_max_kN = 180 kN"):
        planned(load, "[limits]\nforce_max_kN = 180.0\n" + harmonic(50.0, 25.0), LINEAR)


def test_a_value_that_is_proposed_is_round_and_is_taken(load: Load) -> None:
    shown = CurvePredictor(((0.0, 0.0), (62.0317, 180.0)), 0.5, None, 1.0, "a test")
    with pytest.raises(BadInput, match="to which its force is known") as caught:
        planned(load, SLOW.replace("5.0", "5.0\nstroke_limit_mm = 60.0") + harmonic(70.0, 5.0), shown)
    told = re.fullmatch(r"nearest admissible: prestress_mm = (\d+\.\d\d)", caught.value.remedy)
    assert told, caught.value.remedy
    text = SLOW.replace("5.0", "5.0\nstroke_limit_mm = 60.0") + harmonic(float(told[1]), 5.0)
    assert planned(load, text, shown).steps[1].prestress_mm == float(told[1])


def test_temperatures_that_nobody_knows_are_not_given(load: Load) -> None:
    cold = CurvePredictor(LINEAR.points, 0.5, None, 1.15, "a test")
    plan = planned(load, SLOW + harmonic(50.0, 20.0, cycles=500), cold)
    assert not plan.steps[1].stops
    assert {row[11] for row in plan.rows()} == {"not known"}
    content = plan.as_dict()
    assert content["steps"][1]["end_temperature_C"] is None
    assert content["totals"]["max_temperature_C"] is None
    assert any("only a thermometer on it can stop the test" in text for text in content["assumptions"])


def test_of_a_specimen_of_which_nothing_is_known_a_slow_stroke_comes_first(load: Load) -> None:
    nothing = UnknownSpecimenPredictor()
    assert planned(load, SLOW, nothing).steps[0].expected_peak_force_kN == 600.0
    plan = planned(load, SLOW + harmonic(50.0, 20.0), nothing)
    assert plan.steps[1].expected_peak_force_kN is None
    assert "nothing is known" in plan.assumptions[0]
    with pytest.raises(BadInput, match="nothing is known of the specimen's forces") as caught:
        planned(load, harmonic(50.0, 20.0) + SLOW, nothing)
    assert "put a step kind = “static” at 10 mm/s or less before it" in caught.value.remedy
    with pytest.raises(BadInput, match="is too fast for its first stroke") as caught:
        planned(load, SLOW.replace("5.0", "40.0"), nothing)
    assert caught.value.remedy == "nearest admissible: speed_mm_per_s = 10"
    unrecorded = '[[step]]\nkind = "conditioning"\nspeed_mm_per_s = 5.0\n'
    with pytest.raises(BadInput, match="nothing is known"):
        planned(load, unrecorded + harmonic(50.0, 20.0), nothing)
    assert planned(load, unrecorded + "record = true\n" + harmonic(50.0, 20.0), nothing).steps
    with pytest.raises(BadInput, match="above stroke_max_mm"):
        planned(load, SLOW + harmonic(60.0, 50.0), nothing)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("[[0.0, 15.0]]", "write a list of two or more pairs of numbers"),
        ("[[5.0, 15.0], [50.0, 100.0]]", "points begin at 5 mm; the first is [0.0, preload_kN]"),
        ("[[0.0, -1.0], [50.0, 100.0]]", "is below 0; it is the preload"),
        ("[[0.0, 15.0], [50.0, 10.0]]", "point 2 [50, 10] is not beyond [0, 15]"),
    ],
)
def test_points_that_are_no_curve_are_refused(tmp_path: Path, points: str, message: str) -> None:
    path = tmp_path / "specimen.toml"
    path.write_text(f'[specimen]\nid = "X"\n[catalogue]\npoints = {points}\n', encoding="utf-8")
    with pytest.raises(BadInput) as caught:
        load_specimen(path)
    assert message in str(caught.value)
    assert "catalogue" in str(caught.value)


def test_a_catalogue_as_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "specimen.toml"
    path.write_text('[specimen]\nid = "X"\n[catalogue]\npoints = [[0, 15], [50, 100]]\n', encoding="utf-8")
    found = load_specimen(path).catalogue
    assert found == Catalogue(points=((0.0, 15.0), (50.0, 100.0)))
    assert found is not None
    curve = CurvePredictor.of_catalogue(found)
    assert (curve.known_to_mm, curve.knows_heat) == (50.0, False)
    assert math.isclose(curve.margin, 1.15)
