"""Holds at a force, conditioning, inner loops, motions of pieces, and steps that end when settled."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic, RampTo, Release, StaticCycles
from bufferstand.protocols.campaign_file.schema import MotionSettings
from bufferstand.protocols.campaign_file.step_kinds.cyclic import InnerLoopsStep
from bufferstand.protocols.campaign_file.step_kinds.free_motion import MotionStep
from bufferstand.protocols.limits import TestLimits, envelope
from bufferstand.protocols.planning.expansion import motions_of
from bufferstand.protocols.planning.limit_checks.check import StepJudge
from bufferstand.protocols.steps.conditions import Steadiness
from bufferstand.protocols.steps.motions import Hold, RampToForce, motions_after
from bufferstand.protocols.steps.planned import PlannedStep
from tests.protocols.conftest import SPECIMEN, STAND, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

STIFF = ClosedFormSpring(capacity_J_per_K=1e12)
LENGTH_CHECK = '[[step]]\nkind = "hold"\nforce_kN = 320\nduration_s = 30\nrecord = true\n'
LOOPS = (
    '[[step]]\nkind = "inner-loops"\nmean_mm = [20, 50]\namplitude_mm = [2, 5]\n'
    "frequency_Hz = 0.5\ncycles = 3\n"
)
PIECES = """[[step]]
kind = "motion"
piece = [
  { do = "ramp", to_mm = 40.0, speed_mm_per_s = 20.0 },
  { do = "hold", duration_s = 60.0 },
  { do = "harmonic", amplitude_mm = 5.0, frequency_Hz = 0.5, cycles = 3 },
  { do = "ramp", to_kN = 320.0, speed_mm_per_s = 2.0 },
]
"""
STEADY = "[step.until_steady]\nmin_cycles = 5\nmax_cycles = 30\n"


def steady_sine() -> str:
    return '[[step]]\nkind = "harmonic"\nprestress_mm = 20\namplitude_mm = 10\nfrequency_Hz = 1\n' + STEADY


# --- holds -------------------------------------------------------------------------------------------


def test_a_hold_at_a_force_approaches_it_slowly(plan: MakePlan) -> None:
    (step,) = plan(LENGTH_CHECK, spring=STIFF).steps
    fast, slow, hold, release = step.motions
    assert fast == RampToForce(0.9 * 320.0, 105.0, 20.0)
    assert slow == RampToForce(320.0, 105.0, 1.0)
    assert (hold, type(release)) == (Hold(30.0), Release)
    assert (step.run_kind, step.name) == ("static", "hold at 320 kN")
    assert step.expected_peak_force_kN == pytest.approx(320.0, rel=1e-9)
    at_mm = [STIFF.static(force, 105.0, 1.0, 21.0).end_stroke_mm for force in (288.0, 320.0)]
    times = [at_mm[0] / 20.0, (at_mm[1] - at_mm[0]) / 1.0, 30.0, at_mm[1] / 20.0]
    assert [e.duration_s for e in step.estimates] == pytest.approx(times, rel=1e-6)
    assert step.disk_bytes > 0


def test_a_force_beyond_the_limit_is_refused_with_the_limit(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match=r"force_kN = 700 kN is above force_max_kN = 600 kN") as caught:
        plan(LENGTH_CHECK.replace("320", "700"))
    assert "force_kN = 600" in str(caught.value)


def test_a_hold_stands_at_one_place(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="not both"):
        plan(LENGTH_CHECK + "stroke_mm = 20\n")
    with pytest.raises(BadInput, match="with force_kN only"):
        plan('[[step]]\nkind = "hold"\nduration_s = 1\napproach_speed_mm_per_s = 2\n')


def test_relaxation_at_a_stroke_is_recorded_when_asked(plan: MakePlan) -> None:
    text = '[[step]]\nkind = "hold"\nstroke_mm = 50\nduration_s = 600\n'
    assert plan(text).steps[0].run_kind is None
    assert plan(text + "record = true\n").steps[0].run_kind == "static"


# --- conditioning ------------------------------------------------------------------------------------


def test_conditioning_moves_like_the_test_and_is_no_run(plan: MakePlan) -> None:
    slow = '[[step]]\nkind = "conditioning"\nforce_limit_kN = 400\ncycles = 3\n'
    sine = '[[step]]\nkind = "conditioning"\nprestress_mm = 50\namplitude_mm = 20\nfrequency_Hz = 0.5\n'
    first, second, third = plan(slow + sine + sine + "record = true\n").steps
    assert first.motions[0] == StaticCycles(5.0, 400.0, 105.0, 3, 0.0)
    assert second.motions[1] == Harmonic(50.0, 20.0, 0.5, 3)
    assert [step.run_kind for step in (first, second, third)] == [None, None, "harmonic"]
    assert {step.kind for step in (first, second, third)} == {"conditioning"}
    assert first.name == "conditioning: static, 3 × at 5 mm/s"
    assert second.name == "conditioning: 50 ± 20 mm, 0.5 Hz"


def test_conditioning_keeps_limits_and_is_of_one_sort(plan: MakePlan) -> None:
    head = '[[step]]\nkind = "conditioning"\n'
    with pytest.raises(BadInput, match="below first contact"):
        plan(head + "prestress_mm = 10\namplitude_mm = 20\nfrequency_Hz = 0.5\n")
    with pytest.raises(BadInput, match="not both"):
        plan(head + "prestress_mm = 10\nforce_limit_kN = 20\n")
    with pytest.raises(BadInput, match="needs amplitude_mm"):
        plan(head + "prestress_mm = 10\n")


# --- inner loops -------------------------------------------------------------------------------------


def test_inner_loops_lie_on_one_loading_path(plan: MakePlan) -> None:
    (step,) = plan(LOOPS).steps
    assert step.motions == (
        RampTo(20.0, 20.0),
        Harmonic(20.0, 2.0, 0.5, 3),
        Harmonic(20.0, 5.0, 0.5, 3),
        RampTo(50.0, 20.0),
        Harmonic(50.0, 2.0, 0.5, 3),
        Harmonic(50.0, 5.0, 0.5, 3),
        Release(20.0),
    )
    assert (step.run_kind, step.cycles) == ("harmonic", 12)


def test_inner_loops_must_climb_and_keep_limits(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="mean_mm must increase"):
        plan(LOOPS.replace("[20, 50]", "[50, 20]"))
    with pytest.raises(BadInput, match=r"loop 20 ± 30 mm: the stroke would go to 20 − 30") as caught:
        plan(LOOPS.replace("[2, 5]", "[2, 30]"))
    assert "amplitude_mm (loop 20 ± 30 mm) = 20" in str(caught.value)


def test_a_step_of_several_sines_goes_on_where_it_was(plan: MakePlan) -> None:
    motions = plan(LOOPS).steps[0].motions
    rest = motions_after(motions, 4)
    assert len(rest) == len(motions)
    assert rest[1] == Hold(0.0)
    assert rest[2] == Harmonic(20.0, 5.0, 0.5, 2)
    assert rest[3:] == motions[3:]
    assert motions_after(motions, 12) == ()


@given(done=st.integers(0, 11))
def test_what_is_done_and_what_is_left_make_the_whole(done: int) -> None:
    motions = (RampTo(20.0, 5.0), Harmonic(20.0, 2.0, 1.0, 7), StaticCycles(5.0, 100.0, 50.0, 5, 0.0))
    left = motions_after(motions, done)
    assert sum(m.cycles for m in left if isinstance(m, Harmonic | StaticCycles)) == 12 - done


# --- a motion of one's own ---------------------------------------------------------------------------


def test_pieces_become_motions_and_a_release(plan: MakePlan) -> None:
    (step,) = plan(PIECES).steps
    assert step.motions == (
        RampTo(40.0, 20.0),
        Hold(60.0),
        Harmonic(40.0, 5.0, 0.5, 3),
        RampToForce(320.0, 105.0, 2.0),
        Release(20.0),
    )
    assert (step.run_kind, step.cycles, step.name) == ("harmonic", 3, "motion of 4 pieces")
    ended = plan(PIECES.replace("2.0 },\n]", '2.0 },\n { do = "release", speed_mm_per_s = 5.0 } ]')).steps[0]
    assert ended.motions[-1] == Release(5.0)
    assert len(ended.motions) == 5


@pytest.mark.parametrize(
    ("written", "instead", "said", "nearest"),
    [
        ("to_mm = 40.0", "to_mm = 120.0", "to_mm = 120 mm is above stroke_max", "to_mm (piece 1) = 9"),
        ("amplitude_mm = 5.0", "amplitude_mm = 50.0", "piece 3: the stroke would go to 40", "(piece 3) = 40"),
        ("frequency_Hz = 0.5", "frequency_Hz = 5.0", "piece 3: the frequency = 5 Hz is above", "= 2.55"),
        ("to_kN = 320.0", "to_kN = 620.0", "piece 4: to_kN = 620 kN is above force", "(piece 4) = 600"),
        ("speed_mm_per_s = 2.0", "speed_mm_per_s = 900.0", "piece 4: speed_mm_per_s = 900 mm/s", "= 800"),
    ],
)  # fmt: skip
def test_every_piece_is_held_to_the_limits(
    plan: MakePlan, written: str, instead: str, said: str, nearest: str
) -> None:
    with pytest.raises(BadInput, match=said) as caught:
        plan(PIECES.replace(written, instead))
    assert nearest in str(caught.value)


def test_a_sine_needs_a_known_stroke(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="piece 2 is a sine after a ramp to a force"):
        plan(
            '[[step]]\nkind = "motion"\npiece = [{ do = "ramp", to_kN = 20.0, speed_mm_per_s = 2.0 }, '
            '{ do = "harmonic", amplitude_mm = 1.0, frequency_Hz = 1.0 }]\n'
        )


def test_a_misspelt_key_of_a_piece_is_named(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="unknown key “to_m”") as caught:
        plan('[[step]]\nkind = "motion"\npiece = [{ do = "ramp", to_m = 20.0, speed_mm_per_s = 2.0 }]\n')
    assert "to_mm" in str(caught.value)


# --- every kind: begins and ends unloaded, within the limits ------------------------------------------


def strokes(step: PlannedStep) -> list[float]:
    at_mm, found = 0.0, []
    for motion in step.motions:
        at_mm = motion.end_mm(at_mm)
        found.append(at_mm)
        if isinstance(motion, Harmonic):
            found += [motion.mean_mm - motion.amplitude_mm, motion.mean_mm + motion.amplitude_mm]
    return found


@given(
    mean=st.floats(1.0, 110.0), amplitude=st.floats(0.5, 60.0), rate_Hz=st.floats(0.02, 4.0),
    force=st.floats(10.0, 800.0),
)  # fmt: skip
def test_whatever_is_admitted_keeps_every_limit(
    mean: float, amplitude: float, rate_Hz: float, force: float
) -> None:
    limits = envelope(STAND, TestLimits(), SPECIMEN)
    spring = ClosedFormSpring()
    judge = StepJudge(limits, spring, 20.0, 21.0)
    loops = InnerLoopsStep(
        kind="inner-loops", mean_mm=(mean, mean + 1.0), amplitude_mm=(amplitude,), frequency_Hz=rate_Hz
    )
    own = MotionStep.model_validate(
        {
            "kind": "motion",
            "piece": [
                {"do": "ramp", "to_mm": mean, "speed_mm_per_s": 20.0},
                {"do": "harmonic", "amplitude_mm": amplitude, "frequency_Hz": rate_Hz},
                {"do": "ramp", "to_kN": force, "speed_mm_per_s": 20.0},
            ],
        }
    )
    for step in (loops, own):
        if judge.breach(step) is not None:
            continue
        at_mm = 0.0
        for motion in motions_of(step, MotionSettings(), limits):
            at_mm = motion.end_mm(at_mm)
            assert -1e-9 <= at_mm <= 105.0
            if isinstance(motion, Harmonic):
                assert motion.mean_mm == at_mm
                assert motion.amplitude_mm <= motion.mean_mm * (1 + 1e-6)
                assert motion.frequency_Hz <= 2.55 * (1 + 1e-6)
                assert spring.force_at(motion.mean_mm + motion.amplitude_mm, 21.0) <= 600.0 * (1 + 1e-6)
            if isinstance(motion, RampToForce):
                assert motion.force_kN <= 600.0 * (1 + 1e-6)
        assert at_mm == 0.0


# --- until settled -----------------------------------------------------------------------------------


def test_a_step_until_steady_is_planned_with_its_most_cycles(plan: MakePlan) -> None:
    made = plan(steady_sine())
    (step,) = made.steps
    assert step.steady == Steadiness(1.0, 1.0, 3, 5, 30)
    assert (step.cycles, step.motions[1]) == (30, Harmonic(20.0, 10.0, 1.0, 30))
    assert made.rows()[0][8] == "5…30"
    assert made.as_dict()["steps"][0]["steady"]["window"] == 3
    plain = plan(harmonic(20, 10, cycles=30)).steps[0]
    assert plain.motions == step.motions
    assert plain.plan_hash != step.plan_hash, "it may end sooner: another test"


def test_until_steady_is_for_each_combination_of_a_sweep(plan: MakePlan) -> None:
    text = '[[step]]\nkind = "sweep"\nprestress_mm = [20, 30]\namplitude_mm = 5\nfrequency_Hz = 1\n' + STEADY
    assert [step.steady is not None for step in plan(text).steps] == [True, True]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("min_cycles = 2\n", "min_cycles = 2 is fewer than window = 3"),
        ("max_cycles = 4\n", "max_cycles = 4 must not be below min_cycles = 5"),
        ("windows = 4\n", "unknown key “windows”"),
    ],
)
def test_a_criterion_that_cannot_be_met_is_refused(plan: MakePlan, keys: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        plan(steady_sine().split("[step.until")[0] + "[step.until_steady]\n" + keys)


def test_cycles_or_until_steady(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="not both"):
        plan(harmonic(20, 5) + STEADY)


def test_steadiness_in_numbers() -> None:
    rule = Steadiness(damping_percent=1.0, stiffness_percent=2.0, window=3, min_cycles=4, max_cycles=10)
    assert not rule.reached([0.4] * 3, [5.0] * 3), "not before min_cycles"
    assert rule.reached([0.9, 0.400, 0.402, 0.404], [9.0, 5.0, 5.05, 5.09])
    assert not rule.reached([0.9, 0.400, 0.402, 0.405], [5.0] * 4), "1.24 % of damping"
    assert not rule.reached([0.4] * 4, [9.0, 5.0, 5.05, 5.12]), "2.4 % of stiffness"
    assert not rule.reached([0.4, 0.4, float("nan"), 0.4], [5.0] * 4)
    assert not rule.reached([0.0, 0.1, -0.1, 0.0], [5.0] * 4), "no relative spread about zero"
    with pytest.raises(ValueError, match="3 values of damping for 4"):
        rule.reached([0.4] * 3, [5.0] * 4)


@given(level=st.floats(0.05, 0.9), decay=st.floats(0.2, 0.8))
def test_what_settles_is_steady_from_some_cycle_on(level: float, decay: float) -> None:
    rule = Steadiness(1.0, 1.0, 3, 5, 30)
    values = [level * (1.0 + decay**n) for n in range(40)]
    found = [rule.reached(values[:n], values[:n]) for n in range(41)]
    assert found[-1]
    first = found.index(True)
    assert all(found[first:])
    assert decay ** (first - 3) * (1.0 - decay**2) <= 0.0105 * (1.0 + decay ** (first - 3))
