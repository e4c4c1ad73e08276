"""Every limit refuses with its name and a nearest value that is itself admissible."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.specimen.file import Specimen
from bufferstand.protocols.campaign_file.step_kinds.cyclic import HarmonicStep, StaticStep
from bufferstand.protocols.campaign_file.step_kinds.holds_and_waits import HoldStep
from bufferstand.protocols.limits import StandLimits, TestLimits, envelope
from bufferstand.protocols.planning.limit_checks.broken_limit import BELOW_ZERO
from bufferstand.protocols.planning.limit_checks.check import StepJudge
from tests.protocols.conftest import SPECIMEN, STAND, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring


def judge(
    stand: StandLimits = STAND,
    test: TestLimits | None = None,
    specimen: Specimen = SPECIMEN,
    spring: ClosedFormSpring | None = None,
) -> StepJudge:
    return StepJudge(
        envelope(stand, test or TestLimits(), specimen), spring or ClosedFormSpring(), 20.0, 21.0
    )


@pytest.mark.parametrize(
    ("text", "limit", "source", "nearest"),
    [
        (harmonic(20, 21), BELOW_ZERO, "", "amplitude_mm = 20"),
        (harmonic(0, 5), BELOW_ZERO, "", "prestress_mm = 5"),
        (harmonic(90, 20), "stroke_max_mm = 105 mm", "max_stroke_mm of the specimen", "amplitude_mm = "),
        (
            harmonic(20, 10, "frequency_Hz = 3"),
            "frequency_max_Hz = 2.55 Hz",
            "campaign",
            "frequency_Hz = 2.55",
        ),
        (
            harmonic(20, 4, "peak_speed_mm_per_s = 80"),
            "frequency_max_Hz = 2.55 Hz",
            "campaign",
            "peak_speed_mm_per_s = 64.08",
        ),
        (
            "[limits]\nspeed_max_mm_per_s = 50\n" + harmonic(20, 20, "frequency_Hz = 0.5"),
            "speed_max_mm_per_s = 50 mm/s",
            "campaign",
            "frequency_Hz = 0.397",
        ),
        (
            "[limits]\nspeed_max_mm_per_s = 50\n" + harmonic(20, 20, "peak_speed_mm_per_s = 80"),
            "speed_max_mm_per_s = 50 mm/s",
            "campaign",
            "peak_speed_mm_per_s = 50",
        ),
        (harmonic(78, 20), "force_max_kN = 600 kN", "campaign", "amplitude_mm = 16."),
        (
            '[[step]]\nkind = "static"\nforce_limit_kN = 700\n',
            "force_max_kN",
            "campaign",
            "force_limit_kN = 600",
        ),
        (
            '[[step]]\nkind = "static"\nstroke_limit_mm = 110\n',
            "stroke_max_mm",
            "specimen",
            "stroke_limit_mm = 105",
        ),
        ('[[step]]\nkind = "static"\nspeed_mm_per_s = 900\n', "speed_max", "stand", "speed_mm_per_s = 800"),
        (
            '[[step]]\nkind = "hold"\nstroke_mm = 110\nduration_s = 1\n',
            "stroke_max_mm",
            "",
            "stroke_mm = 94.",
        ),
        ('[[step]]\nkind = "hold"\nstroke_mm = 100\nduration_s = 1\n', "force_max_kN", "", "stroke_mm = 94."),
        (
            "[motion]\nramp_speed_mm_per_s = 900\n" + harmonic(20, 20),
            "speed_max_mm_per_s",
            "stand",
            "ramp_speed_mm_per_s = 800",
        ),
    ],
)
def test_each_limit_is_refused_by_name(
    plan: MakePlan, text: str, limit: str, source: str, nearest: str
) -> None:
    with pytest.raises(BadInput) as caught:
        plan(text)
    assert limit in caught.value.problem
    assert source in caught.value.problem
    assert nearest in caught.value.remedy


def test_a_refusal_names_step_file_and_line(plan: MakePlan) -> None:
    text = harmonic(20, 20) + harmonic(20, 30, more='name = "too far"') + harmonic(20, 40)
    with pytest.raises(BadInput) as caught:
        plan(text)
    assert "step 2 “too far”" in caught.value.problem
    assert "[limits are also broken by 1 more step of the file]" in caught.value.problem
    assert caught.value.place == "line 12: [[step]] 2"
    assert caught.value.file is not None
    assert caught.value.file.endswith("campaign.toml")


def test_the_narrowest_limit_holds_and_says_whose_it_is() -> None:
    limits = envelope(
        StandLimits(500.0, 100.0, 2.0, 300.0),
        TestLimits(stroke_max_mm=60.0),
        Specimen(id="x", max_stroke_mm=80.0),
    )
    assert (limits.force.value, limits.force.source) == (500.0, "the stand")
    assert (limits.stroke.value, limits.stroke.source) == (60.0, "[limits] of the campaign")
    assert (limits.frequency.value, limits.frequency.source) == (2.0, "the stand")
    assert limits.speed.value == 300.0


def test_guards_trip_above_the_limits_and_below_the_actuator() -> None:
    limits = envelope(STAND, TestLimits(), SPECIMEN)
    assert limits.force.value < limits.force_trip_kN < 630.0
    assert limits.stroke_trip_mm > limits.stroke.value
    assert envelope(STAND, TestLimits(force_trip_kN=605.0), SPECIMEN).force_trip_kN == 605.0


def test_no_step_may_go_beyond_a_trip(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match=r"stroke_trip_mm in \[limits\] of the campaign"):
        plan("[limits]\nstroke_trip_mm = 50\n" + harmonic(40, 20))


@pytest.mark.parametrize("name", ["force_max_kN", "stroke_max_mm", "frequency_max_Hz", "speed_max_mm_per_s"])
def test_a_stand_without_reach_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        StandLimits(**(STAND.as_dict() | {name: 0.0}))


def test_force_is_judged_at_the_coldest(plan: MakePlan) -> None:
    at_93_mm = harmonic(78, 15)
    plan(at_93_mm)
    with pytest.raises(BadInput, match=r"at 93 mm and 5 °C"):
        plan("[conditions]\nambient_C = 5\nspecimen_C = 30\n" + at_93_mm)


@given(
    prestress=st.floats(0.0, 130.0),
    amplitude=st.floats(0.02, 130.0),
    rate=st.floats(0.01, 1500.0),
    by_speed=st.booleans(),
    force_kN=st.floats(20.0, 900.0),
)
def test_the_nearest_admissible_values_are_admissible(
    prestress: float, amplitude: float, rate: float, by_speed: bool, force_kN: float
) -> None:
    judging = judge(test=TestLimits(force_max_kN=force_kN), stand=StandLimits(900.0, 250.0, 2.55, 800.0))
    step = HarmonicStep(
        kind="harmonic",
        prestress_mm=prestress,
        amplitude_mm=amplitude,
        frequency_Hz=None if by_speed else rate / 100.0,
        peak_speed_mm_per_s=rate if by_speed else None,
    )
    found = judging.breach(step)
    if found is None:
        assert amplitude <= prestress * (1 + 1e-9) + 1e-9
        assert prestress + amplitude <= 105.0 * (1 + 1e-9)
        assert step.rate()[0] <= 2.55 * (1 + 1e-9)
        return
    assert found.nearest
    mended = HarmonicStep.model_validate(step.model_dump() | found.nearest)
    assert judging.breach(mended) is None


@given(prestress=st.floats(5.0, 100.0), amplitude=st.floats(5.0, 60.0), force_kN=st.floats(100.0, 600.0))
def test_the_nearest_amplitude_is_the_greatest_that_will_do(
    prestress: float, amplitude: float, force_kN: float
) -> None:
    judging = judge(test=TestLimits(force_max_kN=force_kN))
    step = HarmonicStep(kind="harmonic", prestress_mm=prestress, amplitude_mm=amplitude, frequency_Hz=0.1)
    found = judging.breach(step)
    if found is None or set(found.nearest) != {"amplitude_mm"}:
        return
    more = step.model_copy(update={"amplitude_mm": found.nearest["amplitude_mm"] + 0.02})
    assert judging.breach(more) is not None


@given(speed=st.floats(0.1, 2000.0), force=st.floats(1.0, 2000.0), stroke=st.floats(0.1, 400.0))
def test_nearest_admissible_static_values_are_admissible(speed: float, force: float, stroke: float) -> None:
    judging = judge()
    step = StaticStep(kind="static", speed_mm_per_s=speed, force_limit_kN=force, stroke_limit_mm=stroke)
    for _ in range(4):  # one key is named at a time
        found = judging.breach(step)
        if found is None:
            break
        step = step.model_copy(update=found.nearest)
    assert judging.breach(step) is None


@given(stroke=st.floats(0.01, 300.0), force_kN=st.floats(30.0, 600.0))
def test_nearest_admissible_hold_is_admissible(stroke: float, force_kN: float) -> None:
    judging = judge(test=TestLimits(force_max_kN=force_kN))
    step = HoldStep(kind="hold", stroke_mm=stroke, duration_s=1.0)
    found = judging.breach(step)
    if found is not None:
        assert judging.breach(step.model_copy(update=found.nearest)) is None


def test_where_nothing_is_admissible_none_is_proposed() -> None:
    stiff = judge(test=TestLimits(force_max_kN=10.0), spring=ClosedFormSpring(preload_kN=50.0))
    found = stiff.breach(
        HarmonicStep(kind="harmonic", prestress_mm=20.0, amplitude_mm=20.0, frequency_Hz=1.0)
    )
    assert found is not None
    assert found.nearest == {}
    assert "check the limits" in found.remedy()


def test_a_remedy_reads_as_keys_of_the_file(plan: MakePlan) -> None:
    with pytest.raises(BadInput) as caught:
        plan(harmonic(20, 4, "peak_speed_mm_per_s = 80"))
    value = re.search(r"peak_speed_mm_per_s = ([\d.]+)$", caught.value.remedy)
    assert value is not None
    plan(harmonic(20, 4, f"peak_speed_mm_per_s = {value[1]}"))
