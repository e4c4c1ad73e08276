"""What is learned of a spring while it warms and settles, and what force a step may bring, by truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bufferstand.foundation.motions import Harmonic
from bufferstand.protocols.steps.turning import MotionEstimate
from bufferstand.recording.runfile.file import open_run
from tests.daq.stroke_bench import Case, planned, reached, run
from tests.daq.stroke_study import sine

HOT = "[guards]\nheating_max_K_per_min = 60.0\n[limits]\ntemperature_stop_C = 60.0\n"


def test_after_a_step_that_warms_the_spring_its_repeat_is_right(tmp_path: Path) -> None:
    """No sine can be changed: what is commanded for the repeat is what the first 30 cycles taught."""
    steps = sine(40.0, 10.0, 2.0, 3) + sine(70.0, 14.0, 2.0, 30) + sine(70.0, 14.0, 2.0, 5)
    outcome, opened, _, plan = run(tmp_path, steps, Case(edition=2, more=HOT))
    assert outcome.status == "complete", outcome.reason
    _, warming, again = reached(opened, outcome)
    assert plan.steps[1].end_temperature_C - plan.steps[1].start_temperature_C > 5.0
    drift_mm = warming.mean_mm[-1] - warming.mean_mm[0]
    assert drift_mm > 0.1, "the spring softens, and the machine gives way less"
    assert np.abs(again.amplitude_mm / 14.0 - 1.0).max() < 0.002
    assert np.abs(again.mean_mm - 70.0).max() < 0.05


def test_a_spring_stiffer_than_its_model_keeps_the_force_limit_from_the_first_cycle_on(
    tmp_path: Path,
) -> None:
    """It is known by a slow stroke to 300 kN, 0.78 of the way, and then by a sine."""
    slow = '[[step]]\nkind = "static"\nspeed_mm_per_s = 20.0\nforce_limit_kN = 300.0\ncycles = 1\n'
    steps = slow + sine(78.0, 11.0, 2.0, 2) + sine(80.0, 9.0, 2.5, 2)
    case = Case(edition=2, softening=1.12, more="[limits]\nforce_max_kN = 534.0\n")
    outcome, opened, shown, _ = run(tmp_path, steps, case)
    assert outcome.status == "complete", outcome.reason
    truth = opened.truth.arrays()
    for path in outcome.runs[1:]:
        time_us = open_run(path).stream_of("stroke_1").time
        inside = (truth["time_us"] >= time_us[0]) & (truth["time_us"] <= time_us[-1])
        assert 515.0 < truth["force_kN"][inside].max() < 534.0
    assert sum("by what was learned: only" in line for line in shown.lines) == 2


def test_what_is_expected_of_a_cycle_follows_warming_and_settling(tmp_path: Path) -> None:
    steps = sine(70.0, 14.0, 2.0, 30) + sine(90.0, 3.0, 1.0, 6)
    plan, _ = planned(tmp_path, steps, Case(more=HOT))
    warming, small = (
        next(
            one
            for motion, one in zip(step.motions, step.estimates, strict=True)
            if isinstance(motion, Harmonic)
        )
        for step in plan.steps
    )
    loses = 1.0 - upper_kN(warming, 30, 30) / upper_kN(warming, 8, 30)
    rises_K = warming.cycle_C[30] - warming.cycle_C[8]
    assert rises_K > 3.0
    assert loses / rises_K == np.clip(loses / rises_K, 0.005, 0.015), "about 1 % a kelvin"
    assert upper_kN(small, 1, 6) > 1.015 * upper_kN(small, 3, 6), "its first loading is not its loop"
    assert upper_kN(small, 3, 6) - upper_kN(small, 6, 6) < 0.01 * upper_kN(small, 6, 6)
    warmer = small.turns_of_cycle(3, 6, warmer_K=5.0)
    assert warmer is not None
    assert warmer.upper_kN < 0.97 * upper_kN(small, 3, 6)


def upper_kN(estimate: MotionEstimate, cycle: int, cycles: int) -> float:  # noqa: N802
    turns = estimate.turns_of_cycle(cycle, cycles)
    assert turns is not None
    return turns.upper_kN
