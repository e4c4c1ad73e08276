"""Cycling between two forces, in the plan."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Release
from bufferstand.model.file import load_model
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.stroke_history import stroke_over_time
from bufferstand.protocols.prediction.force_turning_points import force_turns
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.protocols.steps.motions import ForceCycles, Hold, motions_after
from tests.daq.cases import SAMPLES
from tests.protocols.conftest import MakePlan
from tests.protocols.spring import ClosedFormSpring

SPRING = ClosedFormSpring()
KEYS = "force_min_kN = 100.0\nforce_max_kN = 400.0\nspeed_mm_per_s = 20.0\ncycles = 10\n"


def force_cycles(keys: str = KEYS, more: str = "") -> str:
    return f'[[step]]\nkind = "force-cycles"\n{keys}{more}\n'


def stroke_at(force_kN: float, temperature_C: float = 21.0) -> float:
    return float(brentq(lambda mm: SPRING.force_at(mm, temperature_C) - force_kN, 0.0, 120.0))


def test_the_plan_says_strokes_forces_time_and_heat(plan: MakePlan) -> None:
    step = plan(force_cycles()).steps[0]
    motion, release = step.motions
    assert motion == ForceCycles(100.0, 400.0, 105.0, 20.0, 10, 2.0)
    assert isinstance(release, Release)
    lower_mm, upper_mm = stroke_at(100.0), stroke_at(400.0)
    turns = step.turns
    assert turns is not None
    assert (turns.lower_mm, turns.upper_mm) == pytest.approx((lower_mm, upper_mm), abs=0.02)
    assert (turns.lower_kN, turns.upper_kN) == pytest.approx((100.0, 400.0), abs=0.5)
    assert step.expected_peak_force_kN == pytest.approx(400.0, abs=0.5)
    assert step.run_kind == "static"
    assert (step.cycles, step.peak_speed_mm_per_s) == (10, 20.0)
    moves_s = (lower_mm + 10 * 2.0 * (upper_mm - lower_mm)) / 20.0 + 20 * ForceCycles.DWELL_S
    assert step.estimates[0].duration_s == pytest.approx(moves_s, rel=0.02)  # it softens a little meanwhile
    cycles_J = 10 * 2.5 * (0.5 * (upper_mm - lower_mm)) ** 2 * SPRING.softening(21.0)
    compression_J = 2.5 * (0.5 * lower_mm) ** 2 * SPRING.softening(21.0)
    assert step.expected_heat_J == pytest.approx(cycles_J + compression_J, rel=0.05)
    assert step.name == "10 × 100 … 400 kN at 20 mm/s"


def test_the_stroke_over_time_turns_where_the_forces_are(plan: MakePlan) -> None:
    step = plan(force_cycles()).steps[0]
    time_s, stroke_mm = stroke_over_time(step)
    assert np.all(np.diff(time_s) >= 0.0)
    assert time_s[-1] == pytest.approx(step.duration_s)
    assert stroke_mm.max() == pytest.approx(stroke_at(400.0), abs=0.02)
    upper = stroke_mm > stroke_at(399.0)
    assert np.count_nonzero(np.diff(upper.astype(int)) == 1) == 10


def test_the_machine_takes_travel_and_not_the_specimens_strokes(plan: MakePlan) -> None:
    soft = StandLimits(
        force_max_kN=600.0, stroke_max_mm=250.0, frequency_max_Hz=2.55, speed_max_mm_per_s=800.0,
        machine_stiffness_kN_per_mm=100.0,
    )  # fmt: skip
    turns = plan(force_cycles(), stand=soft).steps[0].turns
    assert turns is not None
    assert turns.piston_upper_mm - turns.upper_mm == pytest.approx(4.0, abs=0.01)
    assert turns.upper_mm == pytest.approx(stroke_at(400.0), abs=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "force_max_kN = 400.0",
            "force_max_kN = 100.0",
            "force_max_kN = 100 must be above force_min_kN = 100",
        ),
        ("force_max_kN = 400.0", "force_max_kN = 90.0", "must be above force_min_kN = 100"),
        ("force_max_kN = 400.0", "force_max_kN = 103.0", "nearer than twice tolerance_percent"),
        ("force_min_kN = 100.0", "force_min_kN = -1.0", "from 0 to 10000"),
        ("force_max_kN = 400.0", "force_max_kN = 650.0", "force_max_kN = 600"),
        ("force_max_kN = 400.0", "force_max_kN = nan", "line"),
        ("speed_mm_per_s = 20.0", "speed_mm_per_s = 900.0", "speed_mm_per_s = 800"),
        ("cycles = 10", "cycles = 0", "from 1 to 100000"),
        ("cycles = 10", "cycles = 10\nstroke_limit_mm = 110.0", "stroke_limit_mm = 105"),
        ("cycles = 10", "cycles = 10\ntolerance_percent = 0.0", "from 0.0001 to 20"),
        ("cycles = 10", "", "cycles"),
    ],
)
def test_what_cannot_be_is_refused(plan: MakePlan, old: str, new: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        plan(force_cycles(KEYS.replace(old, new)))


def test_what_the_hydraulics_do_not_deliver_is_refused_with_what_they_do(plan: MakePlan) -> None:
    stand = StandLimits(
        force_max_kN=600.0, stroke_max_mm=250.0, frequency_max_Hz=2.55, speed_max_mm_per_s=800.0,
        force_speed=((0.0, 800.0), (600.0, 200.0)),
    )  # fmt: skip
    with pytest.raises(BadInput, match=r"nearest admissible: speed_mm_per_s = (399|400)"):
        plan(force_cycles(KEYS.replace("speed_mm_per_s = 20.0", "speed_mm_per_s = 500.0")), stand=stand)


def test_repeated_and_by_its_hash_another_step(plan: MakePlan) -> None:
    inner = force_cycles().replace("[[step]]", "[[step.step]]")
    steps = plan('[[step]]\nkind = "repeat"\ntimes = 2\n' + inner).steps
    assert [step.kind for step in steps] == ["force-cycles", "force-cycles"]
    assert steps[0].plan_hash != steps[1].plan_hash
    other = plan(force_cycles(more="tolerance_percent = 1.0")).steps[0]
    assert other.plan_hash != steps[0].plan_hash


@given(done=st.integers(0, 12))
def test_what_is_left_are_the_cycles_left(done: int) -> None:
    motions = (ForceCycles(50.0, 400.0, 105.0, 20.0, 10, 2.0), Release(20.0))
    left = motions_after(motions, done)
    if done >= 10:
        assert left == ()
        return
    assert isinstance(left[0], ForceCycles)
    assert left[0].cycles == 10 - done
    assert left[1:] == motions[1:]
    assert not any(isinstance(motion, Hold) for motion in left)


def test_the_model_turns_back_later_than_it_was_loaded() -> None:
    """By friction the lower force is met at a greater stroke on the way back; the forces are checked."""
    model = ModelPredictor(load_model(SAMPLES / "models" / "category-a-elastomer.toml"))
    motion = ForceCycles(50.0, 400.0, 105.0, 20.0, 1, 2.0)
    turns = force_turns(model, motion, 21.0, 0.0, 0.0)
    loading = model.static(50.0, 105.0, 20.0, 21.0)
    assert turns.lower_mm > loading.end_stroke_mm + 1.0
    way = np.concatenate(
        [np.linspace(0.0, turns.upper_mm, 900), np.linspace(turns.upper_mm, turns.lower_mm, 900)[1:]]
    )
    time_s = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(way)))]) / 20.0
    force = model.forces(time_s, way, 21.0)
    assert force.max() == pytest.approx(400.0, rel=0.01)
    assert force[-1] == pytest.approx(50.0, abs=2.0)


def test_a_stroke_limit_comes_first(plan: MakePlan) -> None:
    found = plan(force_cycles(more="stroke_limit_mm = 60.0"))
    step = found.steps[0]
    assert step.turns is not None
    assert step.turns.upper_mm == pytest.approx(60.0)
    assert step.expected_peak_force_kN == pytest.approx(SPRING.force_at(60.0, 21.0), abs=0.5)
    assert any("comes at 203 kN, before force_max_kN = 400: it turns there" in note for note in found.notes)


def test_a_stroke_limit_before_the_lower_force_is_refused_with_the_one_that_would_do(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match=r"the stroke limit of 10 mm comes at 3\d\.\d+ kN, before") as caught:
        plan(force_cycles(more="stroke_limit_mm = 10.0"))
    nearest = caught.value.remedy.removeprefix("nearest admissible: stroke_limit_mm = ")
    assert float(nearest) == pytest.approx(stroke_at(400.0), abs=0.02)
    assert not plan(force_cycles(more=f"stroke_limit_mm = {nearest}")).notes


def test_a_speed_at_which_a_late_turn_goes_beyond_the_limit_is_refused(plan: MakePlan) -> None:
    """By hand, with the closed form's stiffness at 590 kN: k v · 0.03 s are the 10 kN that are left."""
    keys = KEYS.replace("400.0", "590.0")
    fast = keys.replace("speed_mm_per_s = 20.0", "speed_mm_per_s = 300.0")
    with pytest.raises(BadInput, match=r"in the 0\.03 s in which the piston is stopped") as caught:
        plan(force_cycles(fast))
    speed, force = (float(part.partition(" = ")[2].split()[0]) for part in caught.value.remedy.split(", or "))
    top_mm = stroke_at(590.0)
    stiffness = (SPRING.force_at(top_mm, 21.0) - SPRING.force_at(top_mm - 0.1, 21.0)) / 0.1
    assert speed == pytest.approx(10.0 / stiffness / 0.03, rel=0.02)
    assert plan(force_cycles(fast.replace("300.0", f"{speed}"))).steps
    assert plan(force_cycles(fast.replace("590.0", f"{force}"))).steps
    with pytest.raises(BadInput, match="can become"):
        plan(force_cycles(fast.replace("590.0", f"{force + 1.0}")))


def test_a_tolerance_finer_than_the_piston_can_be_set_is_refused(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match=r"0\.02 mm of it are") as caught:
        plan(force_cycles(more="tolerance_percent = 0.0001"))
    nearest = float(caught.value.remedy.rpartition(" = ")[2])
    (note,) = plan(force_cycles(more=f"tolerance_percent = {nearest}")).notes
    assert "may not be met in every cycle" in note
    assert not plan(force_cycles()).notes


def test_a_way_too_short_for_the_speed_is_said(plan: MakePlan) -> None:
    narrow = KEYS.replace("force_min_kN = 100.0", "force_min_kN = 394.0")
    (note,) = plan(force_cycles(narrow, "tolerance_percent = 0.7")).notes
    assert "too little to come to 20 mm/s" in note
