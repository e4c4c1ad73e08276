"""Jumps of the force that another fault, a contact or the lack of cycles like it would hide."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.plausibility.run_view.passes import Pass, beyond_others
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static


def test_a_gain_that_changes_between_strokes_is_told_beside_a_drift() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        gain = np.where(time_s > 98.0, 0.7, 1.0)
        return time_s, stroke - 0.5, gain * (force - 15.0) + 40.0 * time_s / time_s[-1]

    run = static(change, pause_s=8.0)
    assert of_kind(run, "drift")
    (jump,) = of_kind(run, "gain-jump")
    assert jump.size == pytest.approx(0.7, abs=0.03)


def test_a_pass_that_is_frozen_is_not_compared_with() -> None:
    stroke = np.linspace(0.0, 100.0, 1001)
    force = 5.0 * stroke
    own = Pass(1, stroke, force + 20.0 * (stroke > 50.0))
    right, still = Pass(1, stroke, force), Pass(1, stroke, np.where(abs(stroke - 50.0) < 10.0, 250.0, force))
    assert beyond_others(own, [still], (50.0, 50.1), 0.4).size == 0
    assert beyond_others(own, [right, still], (50.0, 50.1), 0.4) == pytest.approx([20.0], abs=1.0)


def test_a_force_that_leaps_against_the_motion_is_no_contact() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, force + np.where(time_s > 42.4, 31.0, 0.0)  # 0.4 s before the end of stroke 1

    (jump,) = of_kind(static(change), "gain-jump")
    assert jump.size == pytest.approx(31.0, abs=1.0)


@pytest.mark.parametrize("spikes", [(), (2500, 3010, 3520, 4030)])
def test_a_small_leap_on_the_way_to_a_sine_stands_alone(spikes: tuple[int, ...]) -> None:
    time_s = np.arange(0.0, 9.0, 0.002)
    angle = 2.0 * np.pi * (time_s - 3.0)
    stroke = np.where(time_s < 3.0, 20.0 + 10.0 * time_s, 50.0 + 20.0 * np.sin(angle))
    random = np.random.default_rng(1)
    force = 5.0 * stroke + np.where(time_s < 3.0, 0.0, 12.0 * np.cos(angle)) + 4.0 * (time_s > 1.5)
    force = force + 0.05 * random.standard_normal(time_s.size)
    force[list(spikes)] += 70.0
    stroke = stroke + 0.01 * random.standard_normal(time_s.size)
    run = evaluate_run(make_record(time_s, stroke, force), RunFacts("h", "harmonic"), Options(draws=200))
    assert [jump.start_s for jump in of_kind(run, "gain-jump")] == pytest.approx([1.5], abs=0.01)


def test_a_leap_is_not_hidden_by_those_of_the_noise() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, force - np.where(time_s > 33.0, 4.0, 0.0)  # at 45 mm of stroke 1, unloading

    (jump,) = of_kind(static(change, noise_kN=0.3), "gain-jump")
    assert jump.start_s == pytest.approx(33.0, abs=0.05)


@pytest.mark.parametrize(("gain", "count"), [(1.0, 0), (0.75, 1)])
def test_a_wire_that_slips_while_the_stroke_is_clipped_makes_no_gain(gain: float, count: int) -> None:
    """It slips at the top of stroke 2: stroke 3 begins at 6 mm, and is softer at every place on record."""

    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        later = time_s > 68.4
        return time_s, np.minimum(stroke + 6.0 * later, 90.0), np.where(later, gain, 1.0) * force

    run = static(change, preload_kN=0.0)
    assert of_kind(run, "clipped")
    assert len(of_kind(run, "gain-jump")) == count


def test_cycles_in_which_the_force_is_frozen_are_not_compared() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        still = (time_s > 0.9) & (time_s < 1.3)
        return time_s, np.minimum(stroke, 67.0), np.where(still, force[450], force)

    run = harmonic(change)
    assert of_kind(run, "frozen")
    assert not of_kind(run, "gain-jump")
