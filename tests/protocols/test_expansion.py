"""From what is written to single steps and motions."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.motions import Harmonic, RampTo, Release, StaticCycles
from bufferstand.protocols.campaign_file.schema import MotionSettings
from bufferstand.protocols.campaign_file.step_kinds.cyclic import HarmonicStep, SweepStep
from bufferstand.protocols.limits import TestLimits, envelope
from bufferstand.protocols.planning.expansion import expand, expand_sweep, motions_of
from bufferstand.protocols.steps.motions import Hold, WaitUntilCool, motion_dict, motions_after
from tests.protocols.conftest import SPECIMEN, STAND, Load, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

LIMITS = envelope(STAND, TestLimits(), SPECIMEN)


def heat_of(step: HarmonicStep) -> float:
    return step.cycles * step.amplitude_mm**2


def sweep(**changed: object) -> SweepStep:
    facts: dict[str, object] = {
        "kind": "sweep",
        "prestress_mm": (20.0, 50.0),
        "amplitude_mm": (10.0, 5.0),
        "peak_speed_mm_per_s": (10.0, 80.0),
        "cycles": (3, 5),
    }
    return SweepStep.model_validate(facts | changed)


def test_a_sweep_goes_through_every_combination_in_order() -> None:
    steps = expand_sweep(sweep(), heat_of)
    assert [(s.prestress_mm, s.amplitude_mm, s.peak_speed_mm_per_s, s.cycles) for s in steps] == [
        (20.0, 10.0, 10.0, 3),
        (20.0, 10.0, 80.0, 5),
        (20.0, 5.0, 10.0, 3),
        (20.0, 5.0, 80.0, 5),
        (50.0, 10.0, 10.0, 3),
        (50.0, 10.0, 80.0, 5),
        (50.0, 5.0, 10.0, 3),
        (50.0, 5.0, 80.0, 5),
    ]


def test_order_by_heat_puts_the_coolest_first() -> None:
    heats = [heat_of(step) for step in expand_sweep(sweep(order="heat"), heat_of)]
    assert heats == sorted(heats)
    assert heats[0] < heats[-1]


@given(seed=st.integers(0, 2**31))
def test_random_order_is_a_permutation_that_the_seed_decides(seed: int) -> None:
    shuffled = expand_sweep(sweep(order="random", seed=seed), heat_of)
    assert shuffled == expand_sweep(sweep(order="random", seed=seed), heat_of)
    assert sorted(shuffled, key=repr) == sorted(expand_sweep(sweep(), heat_of), key=repr)


def test_random_orders_differ_and_stay_what_they_are() -> None:
    orders = {expand_sweep(sweep(order="random", seed=seed), heat_of) for seed in range(20)}
    assert len(orders) == 20
    first = [
        (s.prestress_mm, s.amplitude_mm, s.cycles)
        for s in expand_sweep(sweep(order="random", seed=1), heat_of)
    ]
    # random.Random(1).random(): 0.134 0.847 0.764 0.255 0.495 0.449 0.652 0.789
    assert first[:3] == [(20.0, 10.0, 3), (20.0, 5.0, 5), (50.0, 10.0, 5)]


def test_names_say_what_a_step_does(load: Load) -> None:
    requests = expand(
        load(
            '[[step]]\nkind = "static"\ncycles = 3\n'
            + harmonic(20, 20, "peak_speed_mm_per_s = 160")
            + harmonic(20, 20, more='name = "mine"')
            + '[[step]]\nkind = "sweep"\nname = "s"\nprestress_mm = 50\namplitude_mm = 5\nfrequency_Hz = 2\n'
            + '[[step]]\nkind = "hold"\nduration_s = 1\n[[step]]\nkind = "cool-down"\ntemperature_C = 25\n'
        ),
        heat_of,
    )
    assert [request.name for request in requests] == [
        "static, 3 × at 5 mm/s",
        "20 ± 20 mm, 160 mm/s",
        "mine",
        "s: 50 ± 5 mm, 2 Hz",
        "hold at zero force",
        "cool down to 25 °C",
    ]
    assert [request.number for request in requests] == [1, 2, 3, 4, 5, 6]


def test_every_step_begins_and_ends_unloaded(plan: MakePlan) -> None:
    steps = plan(
        '[[step]]\nkind = "static"\n'
        + harmonic(20, 20)
        + '[[step]]\nkind = "hold"\nstroke_mm = 50\nduration_s = 5\n'
        + '[[step]]\nkind = "hold"\nduration_s = 5\n[[step]]\nkind = "cool-down"\ntemperature_C = 25\n'
    ).steps
    assert [[type(motion) for motion in step.motions] for step in steps] == [
        [StaticCycles, Release],
        [RampTo, Harmonic, Release],
        [RampTo, Hold, Release],
        [Hold],
        [WaitUntilCool],
    ]
    for step in steps:
        stroke_mm = 0.0
        for motion in step.motions:
            stroke_mm = motion.end_mm(stroke_mm)
        assert stroke_mm == 0.0


def test_a_harmonic_motion_starts_where_the_ramp_ends() -> None:
    step = HarmonicStep(
        kind="harmonic", prestress_mm=50.0, amplitude_mm=30.0, peak_speed_mm_per_s=80.0, cycles=4
    )
    ramp, sine, _ = motions_of(step, MotionSettings(), LIMITS)
    assert isinstance(ramp, RampTo)
    assert isinstance(sine, Harmonic)
    assert ramp.target_mm == sine.mean_mm == 50.0
    assert sine.peak_speed_mm_per_s == pytest.approx(80.0, rel=1e-12)


def test_a_static_step_without_limits_takes_those_in_force(plan: MakePlan) -> None:
    motion = plan('[limits]\nforce_max_kN = 500\n[[step]]\nkind = "static"\n').steps[0].motions[0]
    assert isinstance(motion, StaticCycles)
    assert (motion.force_limit_kN, motion.stroke_limit_mm) == (500.0, 105.0)


@given(
    prestress=st.floats(0.5, 50.0), share=st.floats(0.01, 1.0), frequency=st.floats(0.02, 2.5),
    cycles=st.integers(1, 300),
)  # fmt: skip
def test_no_admitted_motion_leaves_contact(
    prestress: float, share: float, frequency: float, cycles: int
) -> None:
    step = HarmonicStep(
        kind="harmonic",
        prestress_mm=prestress,
        amplitude_mm=prestress * share,
        frequency_Hz=frequency,
        cycles=cycles,
    )
    for before, after in pairwise(motions_of(step, MotionSettings(), LIMITS)):
        assert before.end_mm(0.0) >= 0.0
        if isinstance(after, Harmonic):
            assert after.mean_mm - after.amplitude_mm >= -1e-9


def test_a_motion_as_data_names_itself() -> None:
    assert motion_dict(RampTo(20.0, 5.0)) == {"motion": "ramp", "target_mm": 20.0, "speed_mm_per_s": 5.0}
    names = [m.name for m in (RampTo, Release, Hold, WaitUntilCool, Harmonic, StaticCycles)]
    assert len(set(names)) == len(names)


def test_a_continuation_has_the_cycles_that_are_left() -> None:
    step = HarmonicStep(kind="harmonic", prestress_mm=20.0, amplitude_mm=20.0, frequency_Hz=1.0, cycles=10)
    motions = motions_of(step, MotionSettings(), LIMITS)
    rest = motions_after(motions, 7)
    assert isinstance(rest[1], Harmonic)
    assert rest[1].cycles == 3
    assert (rest[0], rest[2]) == (motions[0], motions[2])
    assert motions_after(motions, 0) == motions
    assert motions_after(motions, 10) == ()
    with pytest.raises(ValueError, match="negative"):
        motions_after(motions, -1)


def test_combinations_beyond_the_limits_are_left_out_only_where_asked(plan: MakePlan) -> None:
    text = (
        '[[step]]\nkind = "sweep"\nprestress_mm = [20, 80]\namplitude_mm = [10, 30]\nfrequency_Hz = 0.1\n'
        'beyond_limits = "leave-out"\n'
    )
    made = plan(text)
    assert [(s.prestress_mm, s.amplitude_mm) for s in made.steps] == [(20.0, 10.0), (80.0, 10.0)]
    assert len(made.notes) == 2
    assert all(note.startswith("left out:") and "line 5" in note for note in made.notes)
    with pytest.raises(Exception, match="step 2"):
        plan(text.replace("leave-out", "refuse"))
    with pytest.raises(Exception, match="every step was left out"):
        plan(text, spring=ClosedFormSpring(preload_kN=900.0))
