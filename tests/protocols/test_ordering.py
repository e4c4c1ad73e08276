"""The order in which a campaign ends soonest: a permutation, below the limit, and no worse than as given."""

from __future__ import annotations

import json
from itertools import permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic, RampTo, Release
from bufferstand.protocols.limits import TestLimits, envelope
from bufferstand.protocols.planning.heating import Surroundings
from bufferstand.protocols.planning.ordering import Job, OrderSearch, soonest
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.prediction.coarse import CoarsePredictor
from bufferstand.protocols.prediction.predictor import Temperatures
from bufferstand.protocols.steps.motions import Motion, WaitUntilCool
from bufferstand.protocols.steps.planned import PlannedStep
from tests.protocols.conftest import SPECIMEN, STAND, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring
from tests.protocols.test_samples import plan_of

SOONEST = '[plan]\norder = "soonest"\n'
WAIT = '[limits]\non_temperature_stop = "wait-and-continue"\n'
STATIC = '[[step]]\nkind = "static"\ncycles = 3\n'
COOL = '[[step]]\nkind = "cool-down"\ntemperature_C = 25\n'
SIX = "".join(
    harmonic(60, amplitude, "frequency_Hz = 0.5", cycles=cycles)
    for amplitude, cycles in ((8, 80), (20, 120), (30, 100), (12, 180), (25, 40), (15, 140))
)
AIR_C = 21.0
START = Temperatures(AIR_C, AIR_C)


def sines(steps: tuple[PlannedStep, ...]) -> list[tuple[Motion, ...]]:
    return [step.motions for step in steps if step.kind == "harmonic"]


def course(sizes: list[tuple[float, int]], stays: list[bool] | None = None) -> OrderSearch:
    jobs = [
        Job((RampTo(60.0, 20.0), Harmonic(60.0, size, 0.5, cycles), Release(20.0)), stay)
        for (size, cycles), stay in zip(sizes, stays or [False] * len(sizes), strict=True)
    ]
    around = Surroundings(
        CoarsePredictor(ClosedFormSpring()), envelope(STAND, TestLimits(), SPECIMEN), TestLimits(), AIR_C
    )
    return OrderSearch(around, jobs, margin_C=1.0, start_max_C=None)


@pytest.mark.slow
def test_the_chosen_order_is_sooner_and_runs_through(plan: MakePlan) -> None:
    as_given, chosen = plan(WAIT + SIX), plan(WAIT + SOONEST + SIX)
    assert as_given.ordering is None
    ordering = chosen.ordering
    assert ordering is not None
    assert (ordering.method, ordering.tried) == ("exact", 720)
    assert ordering.given_s == pytest.approx(as_given.expected_duration_s, rel=0.01)
    assert ordering.chosen_s == pytest.approx(chosen.expected_duration_s, rel=1e-9)
    assert ordering.chosen_s < ordering.given_paused_s < ordering.given_s
    assert [step.stops for step in as_given.steps if step.stops], "else there was nothing to gain"
    assert not [step.stops for step in chosen.steps if step.stops]
    assert max(step.sensor_max_temperature_C for step in chosen.steps) < 40.0
    assert sorted(map(repr, sines(chosen.steps))) == sorted(map(repr, sines(as_given.steps)))
    assert ordering.pauses_s == pytest.approx(
        sum(step.duration_s for step in chosen.steps if step.kind in {"cool-down", "hold"})
    )


@pytest.mark.slow
def test_the_margin_is_told_in_words_and_numbers(plan: MakePlan) -> None:
    made = plan(WAIT + SOONEST + SIX)
    ordering = made.ordering
    assert ordering is not None
    document = json.loads(json.dumps(made.as_dict()))["ordering"]
    assert document["saved_s"] == pytest.approx(ordering.given_s - ordering.chosen_s)
    share = 100 * (1 - ordering.chosen_s / ordering.given_s)
    assert f"({share:.0f} % less)" in ordering.sentence()
    assert "best of all 720" in ordering.sentence()
    assert plan(WAIT + SIX).as_dict()["ordering"] is None


SIZES = st.tuples(st.sampled_from([8.0, 15.0, 22.0, 30.0]), st.integers(10, 40))


@settings(max_examples=8)
@given(sizes=st.lists(SIZES, min_size=2, max_size=4))
def test_no_other_order_is_sooner_where_all_are_tried(sizes: list[tuple[float, int]]) -> None:
    found = course(sizes)
    order, method, _ = soonest(found, START)
    best_s = found.total_s(order, START)
    assert method == "exact"
    assert best_s <= min(found.total_s(other, START) for other in permutations(range(len(sizes)))) + 1.0


@pytest.mark.slow
@settings(max_examples=3)
@given(sizes=st.lists(SIZES, min_size=8, max_size=9), where=st.integers(0, 7))
def test_many_steps_keep_their_fences_and_get_no_worse(sizes: list[tuple[float, int]], where: int) -> None:
    stays = [number == where for number in range(len(sizes))]
    found = course(sizes, stays)
    order, _, _ = soonest(found, START)
    assert sorted(order) == list(range(len(sizes)))
    assert order[where] == where
    assert set(order[:where]) == set(range(where))
    assert found.total_s(order, START) <= found.total_s(range(len(sizes)), START)
    assert soonest(course(sizes, stays), START)[0] == order


@pytest.mark.slow
def test_the_heuristic_comes_close_to_the_best_of_all() -> None:
    sizes = [(8.0, 40), (20.0, 60), (30.0, 50), (12.0, 90), (25.0, 20), (15.0, 70), (30.0, 20)]
    exact, tried = course(sizes), course([*sizes, (8.0, 1)])
    best_s = exact.total_s(soonest(exact, START)[0], START)
    order, method, _ = soonest(tried, START)
    assert method == "heuristic"
    small_s = tried.after(7, START)[0]
    assert tried.total_s(order, START) < 1.02 * best_s + small_s


def test_what_stays_stays(plan: MakePlan) -> None:
    drawn = (
        '[[step]]\nkind = "sweep"\nprestress_mm = 60\namplitude_mm = [5, 20, 10]\nfrequency_Hz = 0.5\n'
        'order = "random"\nseed = 3\n'
    )
    kept = harmonic(60, 30, cycles=5, more="keep_order = true")
    text = WAIT + "{}" + STATIC + SIX + kept + drawn
    as_given, chosen = plan(text.format("")), plan(text.format(SOONEST))

    def fixed(made: Plan) -> list[tuple[Motion, ...]]:
        six = {repr(motions) for motions in sines(made.steps)[:6]}
        waits = {"cool-down", "hold"}
        return [s.motions for s in made.steps if s.kind not in waits and repr(s.motions) not in six]

    assert chosen.steps[0].kind == "static"
    assert fixed(chosen) == fixed(as_given)


def test_a_cool_down_before_a_step_that_stays_is_part_of_the_test(plan: MakePlan) -> None:
    text = WAIT + SOONEST + COOL + harmonic(60, 20) + COOL + harmonic(60, 15) + COOL + STATIC + COOL
    made = plan(text)
    at = [step.kind for step in made.steps].index("static")
    assert made.steps[at - 1].motions == (WaitUntilCool(25.0, 7200.0),)
    assert [step.kind for step in made.steps].count("cool-down") == 1
    held = plan(text.replace(COOL, COOL + "keep_order = true\n"))
    assert [step.kind for step in held.steps].count("cool-down") == 4


def test_no_step_begins_warmer_than_allowed(plan: MakePlan) -> None:
    made = plan(WAIT + SOONEST + "start_max_C = 26\n" + SIX)
    starts = [step.start_temperature_C for step in made.steps if step.kind == "harmonic"]
    assert max(starts) <= 26.0 + 0.15
    assert made.ordering is not None
    free = plan(WAIT + SOONEST + SIX).ordering
    assert free is not None
    assert made.ordering.chosen_s > free.chosen_s


def test_a_step_that_must_stop_anyway_is_not_waited_for(plan: MakePlan) -> None:
    made = plan(WAIT + SOONEST + harmonic(60, 30, "frequency_Hz = 0.9", cycles=600))
    assert [step.kind for step in made.steps] == ["harmonic"]
    assert made.steps[0].stops


def test_hashes_do_not_depend_on_the_order(plan: MakePlan) -> None:
    def hashes(made: Plan) -> set[str]:
        return {step.plan_hash for step in made.steps if step.kind == "harmonic"}

    assert hashes(plan(WAIT + SIX)) == hashes(plan(WAIT + SOONEST + SIX))


def test_an_unknown_order_is_refused(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="order"):
        plan('[plan]\norder = "fastest"\n' + SIX)


@given(temperature_C=st.floats(0.0, 45.0))
def test_the_coarse_predictor_errs_by_little(temperature_C: float) -> None:
    fine = ClosedFormSpring()
    coarse = CoarsePredictor(fine)
    exact = fine.static(500.0, 105.0, 5.0, temperature_C)
    found = coarse.static(500.0, 105.0, 5.0, temperature_C)
    assert found.end_stroke_mm == pytest.approx(exact.end_stroke_mm, rel=3e-3)
    assert found.absorbed_energy_J == pytest.approx(exact.absorbed_energy_J, rel=5e-3)


@pytest.mark.long
def test_the_papers_grid_is_done_a_quarter_sooner() -> None:
    """All prestress × amplitude × peak speed that the stand allows, planned and put in order."""
    made = plan_of("paper-full.toml")
    assert made.ordering is not None
    assert len([step for step in made.steps if step.kind == "harmonic"]) == 128
    assert made.ordering.chosen_s < 0.75 * made.ordering.given_s
    assert made.ordering.chosen_s < made.ordering.given_paused_s
    assert not any(step.stops for step in made.steps)
    assert made.steps[0].kind == "static"
