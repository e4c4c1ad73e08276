"""Warming up to a temperature, in the plan."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic, StaticCycles
from bufferstand.model.file import load_model
from bufferstand.protocols.planning.plan import HEADER, make_plan
from bufferstand.protocols.planning.stroke_history import stroke_over_time
from bufferstand.protocols.prediction.curve_predictor import CurvePredictor
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.protocols.steps.conditions import Warmth
from bufferstand.protocols.steps.motions import Hold
from tests.daq.cases import SAMPLES
from tests.protocols.conftest import SPECIMEN, STAND, Load, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

SINE = "prestress_mm = 50.0\namplitude_mm = 20.0\nfrequency_Hz = 1.0\n"
OWN_STOP = "temperature_stop_C = 85.0\n"
EASY = ClosedFormSpring(capacity_J_per_K=5_000.0, loss_W_per_K=2.0)
"""It comes to 75 °C although it softens by 1 % a kelvin: 500 W are left there, and 108 W are lost."""
SPRING = ClosedFormSpring(capacity_J_per_K=10_000.0, loss_W_per_K=10.0)


def warm_up(to_C: float = 75.0, more: str = OWN_STOP, motion: str = SINE) -> str:
    return f'[[step]]\nkind = "warm-up"\ntemperature_C = {to_C}\n{motion}{more}\n'


def test_the_plan_says_how_many_cycles_it_takes(plan: MakePlan) -> None:
    found = plan(warm_up(35.0, ""), spring=SPRING)
    (step,) = found.steps
    assert step.motions[1] == Harmonic(50.0, 20.0, 1.0, 500)
    assert step.warmth == Warmth(35.0, 2.0, True, 7200.0)
    # 1000 J a cycle at 25 °C, falling with the softening; 10 kJ/K and 10 W/K from 21 °C to the middle of the
    # band, and what it cools in the 15 s in which it is looked at.
    temperature_C, cycles = 21.0, 0.0
    while temperature_C < 35.0 + 15.0 * 10.0 * 14.0 / 10_000.0:
        power_W = 2.5 * 400.0 * SPRING.softening(temperature_C)
        temperature_C += (power_W - 10.0 * (temperature_C - 21.0)) / 10_000.0
        cycles += 1.0
    assert step.expected_cycles == pytest.approx(cycles, rel=0.03)
    assert 34.5 <= step.sensor_end_temperature_C <= 35.5
    assert step.heating is not None
    assert step.heating.rise_K == pytest.approx(2.5 * 400.0 * SPRING.softening(21.0) / 10_000.0, rel=0.05)
    assert step.heating.lag_s == 0.0
    assert step.duration_s == pytest.approx(sum(one.duration_s for one in step.estimates))
    assert any("cycles and" in note for note in found.notes), found.notes
    assert f"≈ {step.expected_cycles:.0f}" in found.rows()[0]
    assert stroke_over_time(step)[1].max() == pytest.approx(70.0, abs=0.5)


def test_what_follows_begins_warm(plan: MakePlan) -> None:
    static = (
        '[[step]]\nkind = "static"\nforce_limit_kN = 200.0\nstart_temperature_C = [70.0, 80.0]\n' + OWN_STOP
    )
    steps = plan(warm_up() + static, spring=EASY).steps
    assert steps[1].start_temperature_C == pytest.approx(75.0, abs=1.0)
    assert steps[1].wait_s == 0.0
    assert not steps[0].stops
    with pytest.raises(BadInput, match="kind = “warm-up” and temperature_C = 75"):
        plan(static, spring=EASY)


def test_warm_already_takes_no_cycles(plan: MakePlan) -> None:
    twice = plan(warm_up() + warm_up(), spring=EASY).steps
    assert twice[1].expected_cycles == 0.0
    assert twice[1].duration_s == 15.0, "its slope is looked at: the spring might be warmer than its sensor"
    assert twice[1].plan_hash != twice[0].plan_hash, "it is another step"


def test_too_warm_waits_for_the_band(plan: MakePlan) -> None:
    step = plan("[conditions]\nspecimen_C = 38.0\n" + warm_up(30.0, ""), spring=SPRING).steps[0]
    assert step.expected_cycles == 0.0
    assert step.sensor_end_temperature_C == pytest.approx(32.0, abs=0.01)
    assert step.duration_s > 0.0


def test_the_stop_is_a_limit_above_it(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="= 77 °C is not below the temperature stop of 40"):
        plan(warm_up(75.0, ""))
    with pytest.raises(BadInput, match="= 85 °C is not below the temperature stop of 85"):
        plan(warm_up(83.0))


def test_a_goal_that_the_model_does_not_reach_is_said(plan: MakePlan) -> None:
    weak = ClosedFormSpring(capacity_J_per_K=10_000.0, loss_W_per_K=15.0)
    found = plan(warm_up(), spring=weak)
    assert any("by the model the sensor only comes to" in note for note in found.notes), found.notes
    assert found.steps[0].expected_cycles == 500.0


@pytest.mark.parametrize(
    ("to_C", "more", "said"),
    [
        (10.0, "", r"waiting never cools the specimen from 21\.0 °C to 8 … 12 °C: the air has 21 °C"),
        (-30.0, "", r"to -32 … -28 °C: the air has 21 °C; give it a temperature_C above 21"),
        (75.0, OWN_STOP + "max_cycles = 1\n", "not half the way from 21.0 °C to 73 °C"),
        (75.0, OWN_STOP + "timeout_s = 1\n", "timeout_s = 1 is no longer than what it rests"),
        (75.0, OWN_STOP + "soak_s = 8000\n", "soak_s = 8000, and 15 s in which it looks"),
        (75.0, OWN_STOP + "timeout_s = 60\n", "more than twice timeout_s = 60"),
    ],
)
def test_a_warm_up_that_cannot_end_is_refused(plan: MakePlan, to_C: float, more: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        plan(warm_up(to_C, more), spring=EASY)


def test_a_specimen_that_is_colder_than_the_air_may_warm_up_to_less(plan: MakePlan) -> None:
    cold = "[conditions]\nspecimen_C = 5.0\n"
    assert plan(cold + warm_up(10.0, ""), spring=EASY).steps[0].warmth is not None


@pytest.mark.parametrize(("band_K", "said"), [(0.01, True), (0.06, True), (0.0625, False), (2.0, False)])
def test_a_band_that_the_sensors_cannot_show_is_warned_of(plan: MakePlan, band_K: float, said: bool) -> None:
    notes = plan(warm_up(35.0, f"band_K = {band_K}\n"), spring=SPRING).notes
    assert any("band_K" in note and "steps of 0.0625 K" in note for note in notes) is said, notes


def test_slow_strokes_warm_up_too_and_a_soak_is_a_rest_at_the_end(plan: MakePlan) -> None:
    slow = plan(
        warm_up(
            24.0,
            "soak_s = 60.0\nrecord = true\nband_K = 1.0\n",
            "force_limit_kN = 400.0\nspeed_mm_per_s = 50.0\n",
        ),
        spring=SPRING,
    ).steps[0]
    assert isinstance(slow.motions[0], StaticCycles)
    assert slow.motions[-1] == Hold(60.0)
    assert slow.run_kind == "static"
    assert slow.expected_cycles is not None
    assert 0 < slow.expected_cycles < 500


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("band_K = 0.0", "0.0 is too small"),
        ("band_K = nan", "line"),
        ("max_cycles = 0", "0 is too small"),
        ('sensors = "some"', "every"),
        ("cycles = 3", "kind = “warm-up” has no key “cycles”"),
        ("force_limit_kN = 100.0", "not both"),
        ("soak_s = -1.0", "-1.0 is too small"),
    ],
)
def test_settings_that_cannot_be_are_refused(plan: MakePlan, more: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        plan(warm_up(75.0, OWN_STOP + more))


def test_a_warm_up_keeps_the_limits_of_force_and_stroke(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="below first contact"):
        plan(warm_up(motion=SINE.replace("50.0", "10.0")))


@given(readings=st.lists(st.floats(-20.0, 120.0), min_size=1, max_size=4), every=st.booleans())
def test_a_specimen_is_never_warm_enough_and_too_cold_at_once(readings: list[float], every: bool) -> None:
    warmth = Warmth(75.0, 2.0, every, 100.0)
    assert not (warmth.within(readings) and warmth.too_cold(readings))
    if every and warmth.within(readings):
        assert all(73.0 <= value <= 77.0 for value in readings)


def test_heat_is_counted_up_to_the_end_only(plan: MakePlan) -> None:
    whole = plan(warm_up(35.0, ""), spring=SPRING).steps[0]
    same = plan(harmonic(50.0, 20.0, cycles=round(whole.expected_cycles or 0.0)), spring=SPRING).steps[0]
    assert whole.expected_heat_J == pytest.approx(same.expected_heat_J, rel=0.02)


def test_cycles_that_nobody_can_say_are_at_most_and_no_heat(load: Load) -> None:
    curve = CurvePredictor(
        ((0.0, 15.0), (25.0, 67.0), (60.0, 195.0), (96.0, 600.0)), 0.5, None, 1.15, "a sheet"
    )
    found = make_plan(load(warm_up(35.0)), STAND, curve, SPECIMEN)
    step = found.steps[0]
    assert step.is_open
    assert (step.cycles, step.expected_cycles, step.expected_heat_J) == (500, None, 0.0)
    row = dict(zip(HEADER, found.rows()[0], strict=True))
    assert (row["cycles"], row["heat kJ"]) == ("≤ 500", "not known")


def test_a_stroke_so_small_that_it_is_not_closed_heats_by_nothing_and_not_by_less(load: Load) -> None:
    """From its unloading curve at rest the model ends above where it began: its work is −0.2 J."""
    model = ModelPredictor(load_model(SAMPLES / "models" / "category-a-elastomer.toml"))
    assert model.static(600.0, 2.0, 5.0, 21.0).absorbed_energy_J < 0.0
    small = '[[step]]\nkind = "static"\nstroke_limit_mm = 2.0\ncycles = 10\n'
    assert make_plan(load(small), STAND, model, SPECIMEN).steps[0].expected_heat_J == 0.0


def test_a_sensor_that_lags_is_no_reason_to_refuse(load: Load) -> None:
    """When a short go of cycles ends it has hardly seen them: the rest after them shows the spring."""
    model = load_model(SAMPLES / "models" / "category-a-elastomer.toml")
    slow = ModelPredictor(replace(model, heat=replace(model.heat, sensor_lag_s=60.0)))
    step = make_plan(load(warm_up(24.0, "band_K = 0.25\n")), STAND, slow, SPECIMEN).steps[0]
    assert step.sensor_max_temperature_C < 22.5
    assert step.max_temperature_C > 24.0
