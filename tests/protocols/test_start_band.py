"""Bands of temperature before a step, and a step's own temperature stop, in the plan."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.limits import TestLimits, envelope
from bufferstand.protocols.planning.heating import Surroundings, Walker
from bufferstand.protocols.planning.stroke_history import stroke_over_time
from bufferstand.protocols.prediction.predictor import Temperatures
from bufferstand.protocols.steps.conditions import StartBand
from tests.protocols.conftest import SPECIMEN, STAND, Load, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

BAND = "start_temperature_C = [15.0, 25.0]"
WARM = "[conditions]\nambient_C = 20.0\nspecimen_C = {at:g}\n"


def static(more: str = BAND) -> str:
    return f'[[step]]\nkind = "static"\nforce_limit_kN = 100.0\n{more}\n'


def test_a_warm_specimen_is_waited_for_and_the_plan_says_so(plan: MakePlan) -> None:
    spring = ClosedFormSpring(capacity_J_per_K=10_000.0, loss_W_per_K=10.0)
    found = plan(WARM.format(at=35) + static(), spring=spring)
    (step,) = found.steps
    # T − T0 falls from 15 K to 5 K by exp(−t/τ), τ = C/λ = 1000 s.
    assert step.wait_s == pytest.approx(1000.0 * math.log(3.0), rel=1e-3)
    assert step.start_temperature_C == pytest.approx(25.0, abs=1e-2)
    assert step.max_temperature_C < 26.0, "how warm it was before the wait is no temperature of the test"
    assert step.duration_s == pytest.approx(step.wait_s + sum(one.duration_s for one in step.estimates))
    assert step.expected_duration_s == pytest.approx(step.duration_s)
    assert step.start_band == StartBand(15.0, 25.0, 7200.0)
    assert any("waits about 18 min" in note for note in found.notes), found.notes
    time, stroke = stroke_over_time(step)
    assert stroke[time <= step.wait_s].max() == 0.0
    assert time[-1] == pytest.approx(step.duration_s)


def test_the_wait_takes_no_disk(plan: MakePlan) -> None:
    cool, warm = (plan(WARM.format(at=at) + static()).steps[0] for at in (20, 35))
    assert warm.disk_bytes == pytest.approx(cool.disk_bytes, rel=0.1), "it is not recorded"
    assert warm.duration_s > 2.0 * cool.duration_s


def test_a_specimen_within_the_band_changes_nothing_but_the_hash(plan: MakePlan) -> None:
    with_band, without = (plan(static(more)).steps[0] for more in (BAND, ""))
    assert with_band.wait_s == 0.0
    assert with_band.estimates == without.estimates
    assert with_band.plan_hash != without.plan_hash
    patient = plan(static(BAND + "\nstart_timeout_s = 60.0")).steps[0]
    assert patient.plan_hash == with_band.plan_hash, "how long it may wait is no part of the result"


def test_a_cold_specimen_is_refused_with_what_to_do(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match=r"at 10\.0 °C when it begins, below start_temp") as caught:
        plan(WARM.format(at=10) + static())
    assert "kind = “warm-up” and temperature_C = 20" in str(caught.value)
    found = plan(WARM.format(at=10) + static(BAND + '\ntoo_cold = "run"'))
    assert any("it is run all the same" in note for note in found.notes)


def test_a_wait_that_takes_too_long_is_said(plan: MakePlan) -> None:
    found = plan(WARM.format(at=35) + static(BAND + "\nstart_timeout_s = 60"))
    assert any("not expected within start_timeout_s = 60" in note for note in found.notes), found.notes
    assert found.steps[0].wait_s == 60.0


@pytest.mark.parametrize("more", ["", '\ntoo_cold = "run"', "\nstart_timeout_s = 600"])
def test_a_band_below_the_air_is_refused_because_no_waiting_cools_so_far(plan: MakePlan, more: str) -> None:
    cold = "start_temperature_C = [-20.0, 5.0]"
    with pytest.raises(BadInput, match=r"never cools the specimen from 20\.0 °C into start_temp") as caught:
        plan(WARM.format(at=20) + static(cold + more))
    assert "the air has 20 °C" in str(caught.value)
    assert "line 8" in str(caught.value)
    # One that comes out of a climatic chamber begins at once.
    assert plan(WARM.format(at=-5) + static(cold)).steps[0].wait_s == 0.0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("start_temperature_C = [25.0, 15.0]", "the first must be below the second"),
        ("start_temperature_C = [20.0, 20.0]", "the first must be below the second"),
        ("start_temperature_C = [15.0]", "give two temperatures"),
        ("start_temperature_C = 20.0", "line 8: step"),
        ("start_temperature_C = [15.0, nan]", "line 8"),
        ("start_timeout_s = 60.0", "start_timeout_s has a meaning with start_temperature_C only"),
        ('too_cold = "run"', "too_cold has a meaning with start_temperature_C only"),
        (BAND + "\nstart_timeout_s = 0.0", "from 0.1 to 604800"),
        ("start_temperature_C = [15.0, 45.0]", "begin at the temperature stop of 40 °C"),
        ("temperature_stop_C = 28.0", "temperature_resume_C = 30 must be below temperature_stop_C = 28"),
    ],
)
def test_bands_that_cannot_be_are_said_with_their_place(plan: MakePlan, more: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        plan(static(more))


def test_a_step_has_its_own_temperature_stop(plan: MakePlan) -> None:
    spring = ClosedFormSpring(capacity_J_per_K=10_000.0)
    campaign_s, own = (
        plan(WARM.format(at=50) + harmonic(50.0, 20.0, more=more), spring=spring).steps[0]
        for more in ("", "temperature_stop_C = 85.0\ntemperature_resume_C = 70.0")
    )
    assert campaign_s.stops
    assert campaign_s.stops[0].at_s == 0.0
    assert own.stops == ()
    assert (own.temperature_stop_C, own.temperature_resume_C) == (85.0, 70.0)
    assert own.plan_hash != campaign_s.plan_hash


def test_steps_of_a_sweep_have_its_temperatures(plan: MakePlan) -> None:
    text = (
        '[[step]]\nkind = "sweep"\nprestress_mm = 50\namplitude_mm = [5, 10]\nfrequency_Hz = 1.0\n'
        f"{BAND}\ntemperature_stop_C = 60.0\n"
    )
    steps = plan(text).steps
    assert [step.start_band for step in steps] == [StartBand(15.0, 25.0, 7200.0)] * 2
    assert [step.temperature_stop_C for step in steps] == [60.0] * 2


def test_a_step_with_a_band_stays_in_its_place(plan: MakePlan, load: Load) -> None:
    assert load(harmonic(50.0, 5.0)).content.step[0].stays() is False
    assert load(harmonic(50.0, 5.0, more=BAND)).content.step[0].stays() is True
    assert load(harmonic(50.0, 5.0, more=BAND + "\nkeep_order = false")).content.step[0].stays() is False
    text = '[plan]\norder = "soonest"\n' + harmonic(50.0, 20.0, cycles=60) + harmonic(50.0, 5.0, more=BAND)
    found = plan(text, spring=ClosedFormSpring(capacity_J_per_K=10_000.0))
    assert [step.amplitude_mm for step in found.steps if not step.pause] == [20.0, 5.0]
    last = found.steps[-1]
    assert last.start_temperature_C <= 25.0 + 0.5, "it lags a little"


@given(
    start=st.floats(-20.0, 90.0), high=st.floats(16.0, 80.0), ambient=st.floats(-10.0, 40.0),
    timeout=st.floats(1.0, 1e5),
)  # fmt: skip
def test_a_wait_ends_in_the_band_or_at_its_time_out(
    start: float, high: float, ambient: float, timeout: float
) -> None:
    test = TestLimits()
    around = Surroundings(ClosedFormSpring(), envelope(STAND, test, SPECIMEN), test, ambient)
    walker = Walker(around, Temperatures(start, start))
    waited_s = walker.cool_into(StartBand(15.0, high, timeout))
    assert 0.0 <= waited_s <= timeout
    if start <= high:
        assert waited_s == 0.0
    elif waited_s < timeout:
        assert walker.now.sensor_C == pytest.approx(high, abs=0.01)
    else:
        assert walker.now.sensor_C >= high - 0.01
