"""Heating learned from steps already run, on synthetic specimens whose true factors are known."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.planning.plan import make_plan
from bufferstand.protocols.prediction.learning import (
    HeatScale,
    LearnedPredictor,
    Observation,
    end_as_measured,
    expected_end_C,
    learn_heating,
)
from bufferstand.protocols.prediction.predictor import Temperatures
from tests.protocols.conftest import SPECIMEN, STAND, Load, harmonic
from tests.protocols.spring import ClosedFormSpring
from tests.protocols.test_plan import LaggingSpring

MODEL = ClosedFormSpring()
AIR_C = 21.0
STEPS = ((30_000.0, 60.0), (0.0, 900.0), (120_000.0, 300.0), (60_000.0, 120.0), (0.0, 1800.0))
"""Heat [J] and duration [s]: three steps, two pauses."""


def lived(
    truth: ClosedFormSpring, heating: float = 1.0, noise_K: tuple[float, ...] = (0.0,) * len(STEPS)
) -> list[Observation]:
    """Return what a specimen shows that is ``truth`` and takes ``heating`` times the model's heat."""
    now, seen = Temperatures(AIR_C, AIR_C), []
    for number, (heat_J, duration_s) in enumerate(STEPS):
        end = truth.temperatures_after(now, AIR_C, heating * heat_J / duration_s, duration_s)
        seen.append(
            Observation(
                f"step {number}", now.sensor_C, end.sensor_C + noise_K[number], AIR_C, heat_J, duration_s,
                start_mass_C=now.mass_C,
            )
        )  # fmt: skip
        now = end
    return seen


@settings(max_examples=25)
@given(heating=st.floats(0.6, 1.8), cooling=st.floats(0.6, 1.8))
def test_the_true_factors_are_found(heating: float, cooling: float) -> None:
    truth = ClosedFormSpring(loss_W_per_K=MODEL.loss_W_per_K * cooling)
    found = learn_heating(lived(truth, heating), MODEL)
    assert found.heating == pytest.approx(heating, rel=0.04)
    assert found.cooling == pytest.approx(cooling, rel=0.12)
    assert found.steps == len(STEPS)


def test_a_smaller_capacity_is_more_heating_and_cooling() -> None:
    truth = ClosedFormSpring(capacity_J_per_K=10_000.0)
    found = learn_heating(lived(truth), MODEL)
    assert found.heating == pytest.approx(1.5, rel=0.04)
    assert found.cooling == pytest.approx(1.5, rel=0.08)


def test_noise_of_the_sensor_moves_it_little() -> None:
    found = learn_heating(lived(MODEL, noise_K=(0.3, -0.3, 0.3, -0.3, 0.3)), MODEL)
    assert found.heating == pytest.approx(1.0, abs=0.08)
    assert found.cooling == pytest.approx(1.0, abs=0.2)


def test_little_data_say_little() -> None:
    assert learn_heating([], MODEL) == HeatScale(1.0, 1.0, 0)
    small = Observation("small", AIR_C, AIR_C + 0.4, AIR_C, 1_500.0, 20.0)  # expected: 0.1 K
    found = learn_heating([small], MODEL)
    assert 1.0 < found.heating < 1.3, "four times the rise, but of a tenth of a kelvin"
    assert found.cooling == pytest.approx(1.0, abs=0.05)


def test_who_heats_faster_is_expected_to_cool_faster_too() -> None:
    """A capacity that is smaller than the model's does both; what then cools is measured in the end."""
    warm = lived(ClosedFormSpring(capacity_J_per_K=10_000.0))[0]
    assert learn_heating([warm], MODEL).cooling > 1.05
    pauses = lived(ClosedFormSpring(capacity_J_per_K=10_000.0, loss_W_per_K=0.5 * MODEL.loss_W_per_K))
    assert learn_heating(pauses, MODEL).cooling < 0.9


def test_a_chain_of_steps_is_better_than_each_alone() -> None:
    """Right after a short step the mass is warmer than its sensor; the next one begins with that."""
    truth, seen = LaggingSpring(), []
    now = Temperatures(AIR_C, AIR_C)
    for heat_J, duration_s in ((60_000.0, 10.0), (0.0, 30.0), (60_000.0, 10.0), (0.0, 30.0)):
        end = truth.temperatures_after(now, AIR_C, heat_J / duration_s, duration_s)
        seen.append(
            Observation("part", now.sensor_C, end.sensor_C, AIR_C, heat_J, duration_s, follows=bool(seen))
        )
        now = end
    found = learn_heating(seen, LaggingSpring())
    assert found.heating == pytest.approx(1.0, abs=0.01)
    assert end_as_measured(seen, LaggingSpring(), found).mass_C == pytest.approx(now.mass_C, abs=0.1)
    apart = [replace(one, follows=False) for one in seen]
    assert abs(learn_heating(apart, LaggingSpring()).heating - 1.0) > 0.05


@settings(max_examples=25)
@given(heating=st.floats(0.6, 1.8), cooling=st.floats(0.6, 1.8), power_W=st.floats(0.0, 800.0))
def test_the_scaled_law_is_the_law_of_the_scaled_spring(
    heating: float, cooling: float, power_W: float
) -> None:
    truth = ClosedFormSpring(loss_W_per_K=MODEL.loss_W_per_K * cooling)
    learned = LearnedPredictor(MODEL, HeatScale(heating, cooling))
    start = Temperatures(33.0, 33.0)
    found = learned.temperatures_after(start, AIR_C, power_W, 400.0)
    exact = truth.temperatures_after(start, AIR_C, heating * power_W, 400.0)
    assert found.mass_C == pytest.approx(exact.mass_C, rel=1e-12)


def test_forces_and_energies_stay() -> None:
    learned = LearnedPredictor(MODEL, HeatScale(1.5, 0.7))
    assert learned.harmonic(50, 10, 1, 25) == MODEL.harmonic(50, 10, 1, 25)
    assert learned.static(500, 105, 5, 25) == MODEL.static(500, 105, 5, 25)


def test_the_estimate_becomes_honest() -> None:
    """The next step's rise, foretold by the model as it is and as learned, against what happens."""
    seen = lived(ClosedFormSpring(loss_W_per_K=6.0), heating=1.4)
    found = learn_heating(seen[:-2], MODEL)
    before = abs(expected_end_C(seen[-2], MODEL) - seen[-2].end_C)
    after = abs(expected_end_C(seen[-2], MODEL, found) - seen[-2].end_C)
    assert before > 1.0
    assert after < 0.2
    assert len(seen) == len(STEPS)
    assert expected_end_C(seen[0], MODEL, found) == pytest.approx(seen[0].end_C, abs=0.2)
    assert expected_end_C(seen[2], MODEL) < seen[2].end_C - 1.0


def test_a_lagging_sensor_is_allowed_for() -> None:
    found = learn_heating(lived(LaggingSpring(), heating=1.3), LaggingSpring())
    assert found.heating == pytest.approx(1.3, rel=0.04)


def test_a_plan_with_learned_heating(load: Load) -> None:
    campaign = load(harmonic(60, 30, cycles=50) + harmonic(60, 10, cycles=50))
    as_is = make_plan(campaign, STAND, MODEL, SPECIMEN)
    warmer = make_plan(campaign, STAND, MODEL, SPECIMEN, heating=HeatScale(1.5, 1.0, 3))
    rise = [plan.steps[0].end_temperature_C - AIR_C for plan in (as_is, warmer)]
    assert 1.4 * rise[0] < rise[1] < 1.5 * rise[0]
    assert [s.plan_hash for s in as_is.steps] == [s.plan_hash for s in warmer.steps], "the same test"
    assert as_is.steps[0].expected_peak_force_kN == warmer.steps[0].expected_peak_force_kN


def test_what_was_not_measured_is_refused() -> None:
    with pytest.raises(BadInput, match="“dark”: a temperature is missing"):
        learn_heating([Observation("dark", AIR_C, math.nan, AIR_C, 100.0, 10.0)], MODEL)
    with pytest.raises(ValueError, match="lasts longer"):
        Observation("none", AIR_C, AIR_C, AIR_C, 100.0, 0.0)
    with pytest.raises(ValueError, match="positive"):
        HeatScale(0.0, 1.0)
