"""The machine in the plan: its hydraulics, its travel, and whose strokes a step asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.force_speed import ForceSpeed
from bufferstand.foundation.motions import Harmonic
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import HEADER, Plan
from bufferstand.protocols.prediction.machine_stroke import Sine
from bufferstand.protocols.prediction.sine_start import first_cycle, peak_force
from tests.protocols.conftest import STAND, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

CURVE = tuple((float(force), 800.0 * (1.0 - force / 700.0) ** 0.5) for force in (0, 150, 300, 450, 600, 700))
HYDRAULIC = replace(STAND, machine_stiffness_kN_per_mm=150.0, force_speed=CURVE)
FAST = "[limits]\nfrequency_max_Hz = 2.55\n" + harmonic(48.0, 46.0, "frequency_Hz = 2.47")


def test_full_force_at_full_speed_is_refused_with_what_would_do(plan: MakePlan) -> None:
    """714 mm/s and some 590 kN: 2π · 2.47 Hz · 46 mm."""
    assert plan(FAST).steps[0].peak_speed_mm_per_s == pytest.approx(714.0, abs=1.0)
    with pytest.raises(BadInput, match="more than the hydraulics deliver there") as caught:
        plan(FAST, stand=HYDRAULIC)
    assert "(force_speed of the stand)" in caught.value.problem
    assert caught.value.remedy.startswith("nearest admissible: frequency_Hz = ")
    nearest = float(caught.value.remedy.rpartition(" = ")[2])
    assert plan(FAST.replace("2.47", f"{nearest}"), stand=HYDRAULIC).steps
    with pytest.raises(BadInput, match="hydraulics"):
        plan(FAST.replace("2.47", f"{nearest + 0.002}"), stand=HYDRAULIC)


def test_a_peak_speed_is_lowered_where_a_peak_speed_was_given(plan: MakePlan) -> None:
    with pytest.raises(BadInput) as caught:
        plan(harmonic(48.0, 46.0, "peak_speed_mm_per_s = 714.0"), stand=HYDRAULIC)
    assert caught.value.remedy.startswith("nearest admissible: peak_speed_mm_per_s = ")


def test_the_nearest_rate_uses_the_valve_to_its_end() -> None:
    """Independent of the planner's search: at a rate, speed and force at every instant, by hand."""
    spring, rate, k = ClosedFormSpring(), 2.2, 150.0
    course = first_cycle(spring, Sine(50.0, 45.0), rate, 20.0, 21.0, give_mm_per_kN=1.0 / k)
    phase = 2.0 * np.pi * rate * np.linspace(0.0, 1.0 / rate, 4001)
    stroke = 50.0 + 45.0 * np.sin(phase)
    force = np.array([spring.force_at(mm, 21.0) for mm in stroke])
    per_mm4 = (600.0 - 15.0 - 192.0) / 96.0**4
    slope = spring.softening(21.0) * (2.0 + 4.0 * per_mm4 * stroke**3)
    speed = 2.0 * np.pi * rate * 45.0 * np.abs(np.cos(phase)) * (1.0 + slope / k)
    by_hand = (speed - ForceSpeed(CURVE).speed_at(force)).max()
    found, at_kN, allowed = course.fastest(ForceSpeed(CURVE))
    assert found - allowed == pytest.approx(by_hand, abs=2.0)
    assert ForceSpeed(CURVE).speed_at(at_kN) == pytest.approx(allowed)


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ('kind = "static"\nspeed_mm_per_s = 400.0\nforce_limit_kN = 600.0', "speed_mm_per_s"),
        (
            'kind = "motion"\npiece = [{ do = "ramp", to_mm = 93.0, speed_mm_per_s = 400.0 }]',
            "speed_mm_per_s",
        ),
        (
            'kind = "motion"\npiece = [{ do = "ramp", to_kN = 600.0, speed_mm_per_s = 400.0 }]',
            "speed_mm_per_s",
        ),
    ],
)
def test_a_steady_motion_is_judged_at_the_force_at_which_it_ends(plan: MakePlan, step: str, key: str) -> None:
    assert plan(f"[[step]]\n{step}\n").steps
    with pytest.raises(BadInput, match="more than the hydraulics deliver there") as caught:
        plan(f"[[step]]\n{step}\n", stand=HYDRAULIC)
    nearest = float(caught.value.remedy.rpartition(" = ")[2])
    assert key in caught.value.remedy
    assert plan(f"[[step]]\n{step}\n".replace("400.0", f"{nearest}"), stand=HYDRAULIC).steps


def test_the_piston_goes_further_than_the_specimen_and_has_an_end(plan: MakePlan) -> None:
    (step,) = plan(harmonic(50.0, 40.0), stand=HYDRAULIC).steps
    assert step.turns is not None
    assert (step.turns.lower_mm, step.turns.upper_mm) == (10.0, 90.0)
    assert step.turns.piston_upper_mm == pytest.approx(90.0 + step.turns.upper_kN / 150.0)
    short = replace(HYDRAULIC, stroke_max_mm=92.0)
    with pytest.raises(
        BadInput, match=r"the piston's position at 90 mm of stroke .* above stroke_max_mm = 92 mm"
    ):
        plan(harmonic(50.0, 40.0), stand=short)


def test_a_step_may_have_its_own_and_it_is_another_test(plan: MakePlan) -> None:
    own = harmonic(50.0, 30.0) + harmonic(50.0, 30.0, more="compensate = false")
    asked, piston = plan(own, stand=HYDRAULIC).steps
    assert (asked.compensate, piston.compensate) == (True, False)
    assert asked.motions == piston.motions
    assert asked.plan_hash != piston.plan_hash
    assert asked.turns is not None
    assert piston.turns is not None
    assert piston.turns.upper_mm < asked.turns.upper_mm == 80.0
    assert piston.turns.piston_upper_mm == pytest.approx(80.0, abs=1e-4)
    assert piston.expected_heat_J < asked.expected_heat_J
    other, same = plan("[stroke]\ncompensate = false\n" + own.replace("false", "true"), stand=HYDRAULIC).steps
    assert (other.compensate, same.compensate) == (False, True)
    assert (other.plan_hash, same.plan_hash) == (piston.plan_hash, asked.plan_hash)


def test_the_plan_shows_what_is_not_asked_for_and_says_what_it_takes_for_granted(plan: MakePlan) -> None:
    text = harmonic(50.0, 30.0) + harmonic(50.0, 30.0, more="compensate = false")
    made, rigid = plan(text, stand=HYDRAULIC), plan(text)
    asked, piston = (dict(zip(HEADER, row, strict=True)) for row in made.rows())
    assert (asked["specimen mm"], piston["piston mm"]) == ("", "")
    assert asked["piston mm"] == "51.4 ± 31.1"
    assert piston["specimen mm"] == "48.7 ± 29.0"
    assert made.assumptions == ()
    assert "taken for rigid" in rigid.assumptions[0]
    assert rigid.as_dict()["assumptions"] == list(rigid.assumptions)
    assert made.as_dict()["limits"]["in_force"]["machine_stiffness_kN_per_mm"] == 150.0
    assert made.as_dict()["steps"][1]["estimates"][1]["turns"]["piston_upper_mm"] == pytest.approx(80.0)
    assert {row[4:6] for row in rigid.rows()} == {("", "")}


def test_sweeps_and_own_motions_take_it_over(plan: MakePlan) -> None:
    text = (
        '[[step]]\nkind = "sweep"\nprestress_mm = [50.0]\namplitude_mm = [10.0, 20.0]\nfrequency_Hz = [0.5]\n'
        'compensate = false\n[[step]]\nkind = "motion"\ncompensate = false\npiece = ['
        '{ do = "ramp", to_mm = 60.0, '
        'speed_mm_per_s = 20.0 }, { do = "harmonic", amplitude_mm = 5.0, frequency_Hz = 0.5 }]\n'
    )
    for step in plan(text, stand=HYDRAULIC).steps:
        sine = next(motion for motion in step.motions if isinstance(motion, Harmonic))
        assert step.turns is not None
        assert step.turns.upper_mm < sine.mean_mm + sine.amplitude_mm


def test_what_was_run_stays_run_when_the_machine_is_known_better(plan: MakePlan) -> None:
    first, second = (
        plan(harmonic(50.0, 30.0), stand=stand).steps[0].plan_hash for stand in (STAND, HYDRAULIC)
    )
    assert first == second


def _plans_differ_by(plan: MakePlan, stiffness: float) -> tuple[float, float]:
    def made(stand: StandLimits) -> Plan:
        return plan(harmonic(50.0, 30.0, more="compensate = false"), stand=stand)

    rigid, soft = made(STAND).steps[0], made(replace(STAND, machine_stiffness_kN_per_mm=stiffness)).steps[0]
    assert rigid.expected_peak_force_kN is not None
    assert soft.expected_peak_force_kN is not None
    return (
        rigid.expected_peak_force_kN - soft.expected_peak_force_kN,
        rigid.expected_heat_J - soft.expected_heat_J,
    )


@settings(max_examples=15, deadline=None)
@given(stiffness=st.floats(20.0, 2000.0))
def test_a_stiffer_frame_makes_less_difference(stiffness: float) -> None:
    def lost(give: float) -> float:
        spring = ClosedFormSpring()
        settings_ = (spring, 50.0, 30.0, 1.0, 20.0, 21.0)
        return peak_force(*settings_) - peak_force(*settings_, give_mm_per_kN=give, compensated=False)

    assert 0.0 < lost(1.0 / (2.0 * stiffness)) < lost(1.0 / stiffness)
    assert lost(1e-12) == pytest.approx(0.0, abs=0.05)


def test_the_plan_of_a_stiffer_frame_is_nearer_to_the_rigid_one(plan: MakePlan) -> None:
    soft, stiff, rigid = (_plans_differ_by(plan, k) for k in (100.0, 300.0, 1e9))
    assert soft[0] > stiff[0] > 0.0
    assert soft[1] > stiff[1] > 0.0
    assert rigid == pytest.approx((0.0, 0.0), abs=1e-2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"machine_stiffness_kN_per_mm": 0.0}, "machine_stiffness_kN_per_mm of the stand must be positive"),
        ({"force_speed": ((0.0, 800.0), (100.0, 900.0))}, "force_speed of the stand: pair 2"),
    ],
)
def test_a_machine_that_cannot_be(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(STAND, **changes)


SOFT = replace(STAND, machine_stiffness_kN_per_mm=0.5)
"""It gives way by 600 mm under 300 kN; the piston has 250 mm."""


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ('kind = "static"\nforce_limit_kN = 300.0', "force_limit_kN"),
        ('kind = "conditioning"\nforce_limit_kN = 300.0', "force_limit_kN"),
        ('kind = "hold"\nforce_kN = 300.0\nduration_s = 1.0', "force_kN"),
        ('kind = "hold"\nstroke_mm = 70.0\nduration_s = 1.0', "stroke_mm"),
        (
            (
                'kind = "force-cycles"\nforce_min_kN = 20.0\nforce_max_kN = 300.0\n'
                "speed_mm_per_s = 20.0\ncycles = 1"
            ),
            "force_max_kN",
        ),
    ],
)
def test_no_slow_step_goes_beyond_the_pistons_travel(plan: MakePlan, step: str, key: str) -> None:
    text = f"[[step]]\n{step}\n"
    assert plan(text).steps, "a rigid machine takes nothing"
    with pytest.raises(BadInput, match=r"the piston's position at .* is above stroke_max_mm = 250") as caught:
        plan(text, stand=SOFT)
    named, _, nearest = caught.value.remedy.removeprefix("nearest admissible: ").partition(" = ")
    assert named == key
    asked = "70.0" if key == "stroke_mm" else "300.0"
    turns = plan(text.replace(asked, nearest), stand=SOFT).steps[0].turns
    if turns is not None:
        assert turns.piston_upper_mm == pytest.approx(250.0, abs=0.1)
    with pytest.raises(BadInput):
        plan(text.replace(asked, f"{float(nearest) + 0.2}"), stand=SOFT)
