"""What the planner expects, against closed forms and tendencies."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.durations import duration_text
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic
from bufferstand.model.spring import HeatBalance
from bufferstand.protocols.campaign_file.schema import MotionSettings
from bufferstand.protocols.campaign_file.step_kinds.cyclic import HarmonicStep
from bufferstand.protocols.limits import StandLimits, TestLimits, envelope
from bufferstand.protocols.planning import heating as thermal
from bufferstand.protocols.planning.estimate import DataRate
from bufferstand.protocols.planning.expansion import motions_of
from bufferstand.protocols.planning.heating import FADE_SHARE, Surroundings, Walk, Walker, cooling_time_s
from bufferstand.protocols.planning.plan import HEADER
from bufferstand.protocols.prediction.predictor import StaticCycle, Temperatures, sensor_after
from bufferstand.protocols.steps.motions import Hold
from bufferstand.protocols.steps.planned import PlannedStep
from tests.protocols.conftest import SPECIMEN, STAND, MakePlan, harmonic
from tests.protocols.spring import ClosedFormSpring

STATIC = '[[step]]\nkind = "static"\ncycles = 3\npause_s = 2\n'
COOL = '[[step]]\nkind = "cool-down"\ntemperature_C = 25\n'
HOT = harmonic(60, 30, "frequency_Hz = 0.9", cycles=600)
MIXED = STATIC + harmonic(20, 20) + '[[step]]\nkind = "hold"\nstroke_mm = 50\nduration_s = 7\n' + COOL
LIMITS = envelope(STAND, TestLimits(), SPECIMEN)


def walk(
    cycles: int = 20,
    amplitude: float = 15.0,
    spring: ClosedFormSpring | None = None,
    test: TestLimits | None = None,
    start_C: float = 21.0,
    ambient_C: float = 21.0,
) -> Walk:
    step = HarmonicStep(
        kind="harmonic", prestress_mm=60.0, amplitude_mm=amplitude, frequency_Hz=1.0, cycles=cycles
    )
    around = Surroundings(spring or ClosedFormSpring(), LIMITS, test or TestLimits(), ambient_C)
    return Walker(around, Temperatures(start_C, start_C)).walk(motions_of(step, MotionSettings(), LIMITS))


# --- durations ---------------------------------------------------------------------------------------


def test_a_steps_duration_is_the_sum_of_its_motions(plan: MakePlan) -> None:
    made = plan(MIXED + HOT)
    for step in made.steps:
        assert len(step.estimates) == len(step.motions)
        assert step.duration_s == pytest.approx(sum(e.duration_s for e in step.estimates), rel=1e-12)
    assert made.duration_s == pytest.approx(sum(step.duration_s for step in made.steps), rel=1e-12)


def test_many_slow_cycles_are_planned_by_few_predictions(
    plan: MakePlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tests' spring takes 1 % less in a kelvin; compared with a prediction for each cycle."""
    asked: list[float] = []

    class Counting(ClosedFormSpring):
        def static(self, *args: float) -> StaticCycle:
            asked.append(args[3])
            return super().static(*args)

    text = '[[step]]\nkind = "static"\ncycles = 1500\nforce_limit_kN = 200.0\n'
    spring = Counting(capacity_J_per_K=1e6)
    (quick,) = plan(text, spring=spring).steps
    by_few = len(asked)
    asked.clear()
    monkeypatch.setattr(thermal, "EACH_CYCLE", 10**6)
    (exact,) = plan(text, spring=spring).steps
    assert len(asked) > 1500 > 3 * by_few
    assert exact.end_temperature_C - 21.0 > 1.0
    assert quick.end_temperature_C - 21.0 == pytest.approx(exact.end_temperature_C - 21.0, rel=1e-3)
    assert quick.duration_s == pytest.approx(exact.duration_s, rel=1e-3)


def test_durations_in_closed_form(plan: MakePlan) -> None:
    static, sine, hold, _ = plan(MIXED, spring=ClosedFormSpring(capacity_J_per_K=1e12)).steps
    spring = ClosedFormSpring()
    end_mm = spring.static(600.0, 105.0, 5.0, 21.0).end_stroke_mm
    assert static.duration_s == pytest.approx(3 * 2 * end_mm / 5.0 + 2 * 2.0, rel=1e-6)
    assert sine.duration_s == pytest.approx(20 / 20 + (5 + 2) / 1.0 + 20 / 20, rel=1e-12)
    assert hold.duration_s == pytest.approx(50 / 20 + 7 + 50 / 20, rel=1e-12)


def test_without_a_stop_the_expected_duration_is_the_duration(plan: MakePlan) -> None:
    made = plan(MIXED)
    assert not made.notes
    assert made.expected_duration_s == pytest.approx(made.duration_s, rel=1e-12)


# --- heat and temperature ----------------------------------------------------------------------------


def test_heat_of_an_isothermal_step_in_closed_form() -> None:
    spring = ClosedFormSpring(capacity_J_per_K=1e12)
    found = walk(cycles=20, amplitude=15.0, spring=spring)
    s = spring.softening(21.0)
    ramps_J = spring.static(600.0, 60.0, 20.0, 21.0).absorbed_energy_J
    assert found.heat_J == pytest.approx(ramps_J + (20 + 2 * FADE_SHARE) * 2.5 * 15.0**2 * s, rel=1e-6)
    assert found.estimates[0].heat_J == pytest.approx(ramps_J / 2, rel=1e-6)
    assert found.end.mass_C == pytest.approx(21.0, abs=1e-6)


def test_an_insulated_specimen_keeps_all_heat() -> None:
    spring = ClosedFormSpring(capacity_J_per_K=10_000.0, loss_W_per_K=1e-9)
    found = walk(spring=spring)
    assert found.end.mass_C - 21.0 == pytest.approx(found.heat_J / 10_000.0, rel=1e-5)


def test_heat_of_all_motions_is_the_steps_heat(plan: MakePlan) -> None:
    for step in plan(MIXED + HOT).steps:
        assert step.expected_heat_J == pytest.approx(sum(e.heat_J for e in step.estimates), rel=1e-9)
        assert all(e.heat_J >= 0.0 for e in step.estimates)


@given(cycles=st.integers(1, 80))
def test_more_cycles_bring_more_heat(cycles: int) -> None:
    less, more = walk(cycles=cycles), walk(cycles=cycles + 1)
    assert more.heat_J > less.heat_J
    assert more.highest.mass_C > less.highest.mass_C


@given(amplitude=st.floats(2.0, 20.0))
def test_a_greater_amplitude_brings_more_heat(amplitude: float) -> None:
    assert walk(amplitude=amplitude + 0.5).heat_J > walk(amplitude=amplitude).heat_J


@given(start_C=st.floats(0.0, 35.0))
def test_a_warm_spring_absorbs_less(start_C: float) -> None:
    assert walk(start_C=start_C + 2.0, cycles=5).heat_J < walk(start_C=start_C, cycles=5).heat_J


def test_pieces_do_not_change_the_result_much() -> None:
    """1000 cycles walked in 50 pieces against every cycle by itself."""
    spring = ClosedFormSpring()
    test = TestLimits(temperature_stop_C=1000.0)
    found = walk(cycles=1000, spring=spring, test=test)
    temperature, power = 21.0, 2.5 * 15.0**2
    for _ in range(1000):
        heat = power * spring.softening(temperature)
        temperature = spring.temperatures_after(Temperatures(temperature, 0.0), 21.0, heat, 1.0).mass_C
    assert found.estimates[1].end_temperature_C == pytest.approx(temperature, abs=0.3)


def test_each_step_begins_as_warm_as_the_last_ended(plan: MakePlan) -> None:
    steps = plan(MIXED).steps
    assert steps[0].start_temperature_C == 21.0
    for before, after in pairwise(steps):
        assert after.start_temperature_C == before.end_temperature_C


def test_the_assumed_conditions_are_the_files(plan: MakePlan) -> None:
    made = plan("[conditions]\nambient_C = 18\nspecimen_C = 24\n" + harmonic(20, 5))
    assert made.steps[0].start_temperature_C == 24.0
    assert made.as_dict()["conditions"] == {"ambient_C": 18.0, "specimen_C": 24.0}


# --- forces ------------------------------------------------------------------------------------------


def test_expected_peak_forces(plan: MakePlan) -> None:
    static, sine, hold, cool = plan(MIXED, spring=ClosedFormSpring(capacity_J_per_K=1e12)).steps
    spring = ClosedFormSpring()
    assert static.expected_peak_force_kN == pytest.approx(600.0, rel=1e-9)
    assert sine.expected_peak_force_kN == pytest.approx(
        spring.harmonic(20, 20, 1, 21).peak_force_kN, rel=1e-9
    )
    assert hold.expected_peak_force_kN == pytest.approx(spring.force_at(50, 21), rel=1e-9)
    assert cool.expected_peak_force_kN is None


# --- the temperature stop ----------------------------------------------------------------------------


def policy(name: str) -> str:
    return f'[limits]\non_temperature_stop = "{name}"\n'


def test_a_stop_to_be_expected_is_said_and_not_refused(plan: MakePlan) -> None:
    made = plan(harmonic(20, 5) + HOT)
    assert [bool(step.stops) for step in made.steps] == [False, True]
    (stop,) = made.steps[1].stops
    assert 0 < stop.cycles_done < 600
    assert made.max_temperature_C == pytest.approx(40.0, abs=1e-3)
    (note,) = made.notes
    assert "step 2" in note
    assert "40 °C stop is expected" in note
    assert f"after {stop.cycles_done:.1f} cycles" in note
    assert "resumed" in note


def test_the_stop_comes_when_the_heat_law_says() -> None:
    """Constant power from 21 °C: t = −C/λ ln(1 − λ ΔT / P), at the power of the first cycle and the last."""
    spring = ClosedFormSpring()
    found = walk(cycles=2000, spring=spring)

    def time_s(power_W: float) -> float:
        return -1500.0 * math.log(1.0 - 10.0 * 19.0 / power_W)

    (stop,) = found.stops
    first_W, last_W = (2.5 * 15.0**2 * spring.softening(T) for T in (21.0, 40.0))
    assert time_s(first_W) - 10.0 < stop.at_s < time_s(last_W) + 10.0


def test_the_plan_ends_at_a_stop(plan: MakePlan) -> None:
    made = plan(policy("stop") + HOT + harmonic(20, 5))
    assert made.expected_duration_s == pytest.approx(made.steps[0].stops[0].at_s)
    assert made.expected_duration_s < made.duration_s
    assert made.steps[1].start_temperature_C == pytest.approx(30.0, abs=1e-3)


def test_skip_leaves_out_the_rest_and_waits(plan: MakePlan) -> None:
    made = plan(policy("skip") + HOT + harmonic(20, 5))
    (stop,) = made.steps[0].stops
    assert stop.wait_s is not None
    assert made.expected_duration_s == pytest.approx(
        stop.at_s + stop.wait_s + made.steps[1].expected_duration_s, rel=1e-9
    )
    assert made.steps[1].start_temperature_C == pytest.approx(30.0, abs=1e-3)


def test_wait_and_continue_runs_every_cycle(plan: MakePlan) -> None:
    made = plan(policy("wait-and-continue") + HOT)
    (step,) = made.steps
    assert len(step.stops) >= 2
    waits = sum(stop.wait_s or 0.0 for stop in step.stops)
    assert step.expected_duration_s == pytest.approx(step.duration_s + waits, rel=1e-9)
    cycles = [stop.cycles_done for stop in step.stops]
    assert cycles == sorted(cycles)
    assert cycles[-1] < 600
    assert step.expected_heat_J > plan(policy("stop") + HOT).steps[0].expected_heat_J
    assert step.max_temperature_C == pytest.approx(40.0, abs=1e-3)


def test_air_too_warm_to_cool_ends_the_campaign(plan: MakePlan) -> None:
    made = plan(
        '[conditions]\nambient_C = 32\n[limits]\non_temperature_stop = "wait-and-continue"\n'
        + HOT
        + harmonic(20, 5)
    )
    assert made.steps[0].stops[0].wait_s is None
    assert "will not cool" in made.notes[0]
    assert made.expected_duration_s == pytest.approx(made.steps[0].stops[0].at_s)


def test_a_specimen_too_hot_at_the_start_stops_at_once(plan: MakePlan) -> None:
    made = plan("[conditions]\nspecimen_C = 45\n" + harmonic(20, 5))
    assert made.steps[0].stops[0].at_s == 0.0
    assert made.steps[0].expected_heat_J == 0.0


@given(from_C=st.floats(22.5, 80.0), share=st.floats(0.05, 1.0))
def test_cooling_time_in_closed_form(from_C: float, share: float) -> None:
    to_C = 21.0 + share * (from_C - 21.0)
    found = cooling_time_s(ClosedFormSpring(), Temperatures(from_C, from_C), to_C, 21.0)
    assert found == pytest.approx(-1500.0 * math.log(share), rel=1e-4, abs=1.0)


def test_cooling_below_the_air_never_ends(plan: MakePlan) -> None:
    assert cooling_time_s(ClosedFormSpring(), Temperatures(30.0, 30.0), 20.0, 21.0) is None
    assert cooling_time_s(ClosedFormSpring(), Temperatures(19.0, 19.0), 20.0, 21.0) == 0.0
    made = plan(STATIC + COOL.replace("25", "20") + harmonic(20, 5))
    assert made.steps[1].duration_s == 7200.0
    assert "cannot end in air of 21 °C" in made.notes[0]


# --- hash --------------------------------------------------------------------------------------------


def hashes(steps: tuple[PlannedStep, ...]) -> list[str]:
    return [step.plan_hash for step in steps]


def test_the_hash_is_stable(plan: MakePlan) -> None:
    assert hashes(plan(MIXED).steps) == hashes(plan(MIXED).steps)
    named = MIXED.replace("[[step]]\n", '[[step]]\nname = "anything"\n')
    assert hashes(plan(named).steps) == hashes(plan(MIXED).steps)
    by_speed = harmonic(20, 20, f"peak_speed_mm_per_s = {2 * math.pi * 20.0 * 0.5!r}")
    assert hashes(plan(by_speed).steps) == hashes(plan(harmonic(20, 20, "frequency_Hz = 0.5")).steps)
    whole = StandLimits(600, 250, 2.55, 800)
    assert hashes(plan(MIXED, stand=whole).steps) == hashes(plan(MIXED).steps)


def test_the_hash_knows_neither_position_nor_weather(plan: MakePlan) -> None:
    alone = plan(harmonic(20, 20)).steps[0]
    after = plan("[conditions]\nambient_C = 15\n" + STATIC + harmonic(20, 20)).steps[1]
    assert alone.plan_hash == after.plan_hash
    assert plan(policy("skip") + harmonic(20, 20)).steps[0].plan_hash == alone.plan_hash


def test_the_hash_is_sensitive(plan: MakePlan) -> None:
    variants = [
        plan(harmonic(20, 20)),
        plan(harmonic(20, 19.999)),
        plan(harmonic(20.001, 20)),
        plan(harmonic(20, 20, "frequency_Hz = 1.0001")),
        plan(harmonic(20, 20, cycles=6)),
        plan("[motion]\nramp_speed_mm_per_s = 10\n" + harmonic(20, 20)),
        plan("[limits]\nforce_max_kN = 599\n" + harmonic(20, 20)),
        plan("[limits]\ntemperature_stop_C = 39\n" + harmonic(20, 20)),
        plan(harmonic(20, 20), stand=replace(STAND, force_max_kN=620.0)),
        plan(harmonic(20, 20), specimen=SPECIMEN.model_copy(update={"serial": "2"})),
    ]
    assert len({made.steps[0].plan_hash for made in variants}) == len(variants)


def test_equal_steps_are_told_apart(plan: MakePlan) -> None:
    first, second = plan(harmonic(20, 20) + harmonic(20, 20)).steps
    assert first.plan_hash != second.plan_hash
    assert plan(harmonic(20, 20)).steps[0].plan_hash == first.plan_hash


# --- what the user sees ------------------------------------------------------------------------------


def test_the_plan_as_json_has_every_figure(plan: MakePlan) -> None:
    made = plan(MIXED + HOT)
    content = json.loads(json.dumps(made.as_dict(), allow_nan=False))
    assert content["schema"] == "bufferstand/plan/1"
    assert content["totals"]["duration_s"] == made.duration_s
    assert content["limits"]["in_force"]["stroke_max_mm"] == {
        "value": 105.0,
        "source": "max_stroke_mm of the specimen",
    }
    for step in content["steps"]:
        assert {
            "prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s", "expected_peak_force_kN",
            "expected_heat_J", "end_temperature_C", "duration_s", "disk_bytes", "plan_hash",
        } <= step.keys()  # fmt: skip
    assert [m["motion"] for m in content["steps"][1]["motions"]] == ["ramp", "harmonic", "release"]
    assert content["steps"][4]["stops"][0]["cycles_done"] > 0
    assert content["notes"] == list(made.notes)


def test_rows_fit_their_header(plan: MakePlan) -> None:
    rows = plan(MIXED + HOT).rows()
    assert all(len(row) == len(HEADER) for row in rows)
    assert rows[1][2:9] == ("20", "20", "", "", "1", "125.7", "5")
    assert rows[0][2:4] == ("", "")
    assert rows[4][12].endswith("(stop)")


def test_disk_is_counted_for_what_is_recorded(plan: MakePlan) -> None:
    made = plan(MIXED)
    assert [step.disk_bytes > 0 for step in made.steps] == [True, True, False, False]
    assert [step.run_kind for step in made.steps] == ["static", "harmonic", None, None]
    assert made.steps[1].disk_bytes == DataRate().of_run(made.steps[1].duration_s)
    assert made.disk_bytes == sum(step.disk_bytes for step in made.steps)


@pytest.mark.parametrize(
    ("duration_s", "text"),
    [(0.0, "0.0 s"), (5.54, "5.5 s"), (59.97, "60.0 s"), (61.0, "1 min 01 s"), (7500.0, "2 h 05 min")],
)
def test_durations_read_well(duration_s: float, text: str) -> None:
    assert duration_text(duration_s) == text


def test_a_wait_at_rest_brings_no_heat() -> None:
    around = Surroundings(ClosedFormSpring(), LIMITS, TestLimits(), 21.0)
    found = Walker(around, Temperatures(30.0, 30.0)).walk((Hold(600.0),))
    assert found.heat_J == 0.0
    assert found.end.mass_C == pytest.approx(21.0 + 9.0 * math.exp(-600.0 / 1500.0), rel=1e-9)


def test_the_fade_cycles_take_their_time() -> None:
    sine = Harmonic(mean_mm=50.0, amplitude_mm=5.0, frequency_Hz=2.0, cycles=10)
    assert sine.duration_s(50.0) == 6.0


# --- a sensor that lags ------------------------------------------------------------------------------


class LaggingSpring(ClosedFormSpring):
    """The same spring with a sensor that follows in 30 s."""

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,
        power_W: float,
        duration_s: float,
        *,
        heating: float = 1.0,
        cooling: float = 1.0,
    ) -> Temperatures:
        if heating != 1.0 or cooling != 1.0:
            return super().temperatures_after(
                start, ambient_C, power_W, duration_s, heating=heating, cooling=cooling
            )
        now = super().temperatures_after(start, ambient_C, power_W, duration_s)
        return Temperatures(now.mass_C, sensor_after(self.heat(), start, ambient_C, power_W, duration_s))

    def heat(self) -> HeatBalance:
        return HeatBalance(self.capacity_J_per_K, self.loss_W_per_K, sensor_lag_s=30.0)


def test_the_sensor_decides_the_stop(plan: MakePlan) -> None:
    prompt = plan(HOT).steps[0]
    late = plan(HOT, spring=LaggingSpring()).steps[0]
    assert late.sensor_max_temperature_C == pytest.approx(40.0, abs=1e-3)
    assert late.max_temperature_C > 42.0
    assert late.stops[0].at_s > prompt.stops[0].at_s + 15.0


def test_cooling_is_over_when_the_sensor_says_so(plan: MakePlan) -> None:
    text = HOT.replace("cycles = 600", "cycles = 100") + COOL
    cool = plan(text, spring=LaggingSpring()).steps[1]
    assert cool.sensor_end_temperature_C == pytest.approx(25.0, abs=1e-3)
    assert cool.end_temperature_C < 25.0  # the mass is ahead of the sensor on the way down, too


PROOF = '[[step]]\nkind = "static"\nproof_load = "F2"\nforce_limit_kN = 510.0\n'
SAME_BUT_STATIC = '[[step]]\nkind = "static"\nforce_limit_kN = 510.0\n'


def test_a_step_that_applies_a_proof_load_is_a_proof_run(plan: MakePlan) -> None:
    (step,) = plan(PROOF).steps
    assert (step.run_kind, step.proof_load, step.as_dict()["proof_load"]) == ("proof", "F2", "F2")
    assert step.name == "proof load F2, 1 × to 510 kN"
    (static,) = plan(SAME_BUT_STATIC).steps
    assert (static.run_kind, static.proof_load) == ("static", None)
    assert static.motions == step.motions
    assert static.plan_hash != step.plan_hash, "another test, though the same motion"


def test_a_proof_load_needs_its_force_and_is_for_static_steps(plan: MakePlan) -> None:
    with pytest.raises(BadInput, match="proof_load = “F2” needs the force: add force_limit_kN"):
        plan('[[step]]\nkind = "static"\nproof_load = "F2"\n')
    with pytest.raises(BadInput, match="proof_load"):
        plan('[[step]]\nkind = "static"\nproof_load = "second"\nforce_limit_kN = 510.0\n')
    with pytest.raises(BadInput, match="has no key “proof_load”"):
        plan('[[step]]\nkind = "hold"\nduration_s = 5.0\nproof_load = "F2"\n')
