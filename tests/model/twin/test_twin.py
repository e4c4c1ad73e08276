"""The twin: quiet cycles raise no alarm, faults are named, and every part is right by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from bufferstand.foundation.errors import BadInput
from bufferstand.model.fit_uncertainty import FitUncertainty
from bufferstand.model.simulation import simulate
from bufferstand.model.twin import (
    FAULT_KINDS,
    LIMIT,
    Twin,
    dead_zone,
    increments,
    known_fit,
    moved_model,
    stepped,
)
from bufferstand.model.twin.following import SteppedTwin
from bufferstand.model.twin.parameter_spread import ParameterSpread
from tests.model.cases import sine, spring
from tests.model.twin.specimens import FAULTS, Step, drawn_spring, known_model, measured_step
from tests.model.twin.study import faults, quiet, rule_alone

STEP = Step(45.0, 20.0, 0.8, 20)


def followed(model, time, stroke):
    half = np.concatenate([[0], np.cumsum(np.diff(np.sign(np.diff(stroke)), prepend=1.0) != 0)])
    return SteppedTwin(model, 20.0, 20.0).follow(time, stroke, half)


def test_the_stepped_model_is_the_simulated_one():
    time, stroke = sine(30.0, 30.0, 0.5, 3, points=200)
    done = simulate(known_model(), time, stroke, temperature_C=20.0, ambient_C=20.0)
    assert followed(known_model(), time, stroke).force_kN == pytest.approx(done.force_kN, abs=0.05)


def test_traces_are_the_changes_that_faults_make():
    """Against the model itself with each fault in it: another curve, another stroke, another moment."""
    model = known_model()
    time, stroke = sine(30.0, 30.0, 0.5, 3, points=400)
    traces = followed(model, time, stroke).sensitivity
    here = slice(800, 1200)

    def force(spring=model, way=stroke):
        return simulate(spring, time, way, temperature_C=20.0, ambient_C=20.0).force_kN

    base = force()
    late = np.interp(time - 0.004, time, base)
    wanted = {
        "stiffness": (force(replace(model, curves=model.curves.scaled(1.01))) - base) / 0.01,
        "stroke_zero_mm": (force(way=stroke - 0.2) - base) / 0.2,
        "stroke_gain": (force(way=stroke / 1.005) - base) / 0.005,
        "delay_s": (late - base) / 0.004,
    }
    for column, kind in enumerate(FAULT_KINDS):
        if kind.name in wanted:
            span = float(np.max(np.abs(wanted[kind.name][here])))
            assert traces[here, column] == pytest.approx(wanted[kind.name][here], abs=0.03 * span), kind.name
    loop = np.trapezoid(traces[here, 1], stroke[here])
    assert loop == pytest.approx(np.trapezoid(base[here], stroke[here]), rel=0.01)  # F* encloses nothing


@pytest.mark.slow
def test_the_spread_is_that_of_models_drawn_from_the_covariance():
    model = known_model()
    time, stroke = sine(45.0, 20.0, 0.8, 4, points=160)
    random = np.random.default_rng(5)

    def force(one):
        return simulate(one, time, stroke, temperature_C=25.0, isothermal=True).force_kN[-161:]

    base = force(model)
    drawn = np.std([force(drawn_spring(random)) - base for _ in range(200)], axis=0)
    loop = stroke[-161:]
    rising = np.arange(161) <= 80
    parts = ParameterSpread(model, model.fit).components(loop, rising, 1.25, 25.0)
    stated = np.sqrt(np.sum(parts**2, axis=1))
    assert np.median(stated / drawn) == pytest.approx(1.0, abs=0.12)
    assert np.all(np.abs(np.log(stated / drawn)) < 0.4)


@pytest.mark.parametrize(
    "name", [name if name == "loss" else pytest.param(name, marks=pytest.mark.slow) for name in FAULTS]
)
def test_a_fault_is_named_within_a_few_cycles(name):
    random = np.random.default_rng(11)
    drive = measured_step(random, STEP, drawn_spring(random), (name, FAULTS[name]), 8)
    found = Twin(known_model()).take(drive)
    assert len(found.judged) >= 18
    alarm = found.alarms[0]
    assert 8 <= alarm.since_cycle <= 10  # the first cycle has the way to it, and is not judged
    assert alarm.cycle <= 13
    assert alarm.moved[0].kind.name == name
    assert alarm.moved[0].change == pytest.approx(FAULTS[name], rel=0.25)
    assert alarm.moved[0].kind.title in alarm.sentence


@pytest.mark.slow
def test_a_specimen_as_its_fit_lets_it_be_is_quiet():
    calm = quiet(4)
    assert calm.cycles > 100
    assert calm.alarms == 0
    assert np.all(calm.largest < dead_zone(18))
    assert calm.outside < 0.12


def test_a_single_cycle_is_no_alarm_and_three_are():
    one, none = np.ones(6), np.zeros(6)
    sums = np.zeros((2, 6))
    for count in range(1, 4):
        sums = stepped(sums, increments(100.0 * one, none, one, 6.0))
        assert bool(np.any(sums >= LIMIT)) == (count == 3)
    assert np.all(sums[1] == 0.0)  # only the side on which they lie


def test_the_dead_zone_knows_how_few_cycles_were_held_out():
    assert dead_zone(5) > dead_zone(50) > 4.7
    assert student.sf(dead_zone(18), 18) == pytest.approx(1e-6, rel=1e-3)


def test_the_rule_alone_is_quiet_over_many_hours():
    alarms, hours, _ = rule_alone(40.0, lanes=480)
    assert hours >= 40.0
    assert alarms == 0


@pytest.mark.slow
def test_joint_faults_have_a_covariance_and_are_found_within_it():
    random = np.random.default_rng(4)
    drive = measured_step(random, STEP, drawn_spring(random), ("loss", 0.2), 0)
    judged = Twin(known_model()).take(drive).judged[-1]
    deviation = np.sqrt(np.diag(judged.together_covariance))
    put_in = np.array([0.2 if kind.name == "loss" else 0.0 for kind in FAULT_KINDS])
    assert np.all(np.abs(judged.together - put_in) < 4.0 * deviation)


def test_a_model_that_does_not_say_how_well_it_is_known_is_refused():
    with pytest.raises(BadInput, match="fit it again"):
        known_fit(spring())
    model = known_model()
    assert model.fit is not None
    with pytest.raises(BadInput, match="no cycle was held out"):
        Twin(replace(model, fit=replace(model.fit, held_out_cycles=0)))
    odd = FitUncertainty(("nonsense",), (1.0,), (), 10.0, 5, 0.1, 0.001)
    with pytest.raises(BadInput, match="nonsense"):
        Twin(replace(model, fit=odd))
    with pytest.raises(BadInput, match="no point at 50 mm"):
        moved_model(model, "loading_kN at 50 mm", 1.0)


@pytest.mark.long
def test_thousands_of_quiet_cycles_and_many_faults():
    calm = quiet(120)
    assert calm.cycles > 3000
    assert calm.alarms == 0
    for name in FAULTS:
        one = faults(name, 20)
        assert one.early == 0
        assert one.found >= 18, name
        assert one.among >= 0.9 * one.found, name
