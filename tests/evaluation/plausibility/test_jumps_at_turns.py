"""Jumps of the force where nothing is like it: in a single event, at a turn, between two strokes."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.plausibility.jumps.jumps_of_force import _is_contact
from bufferstand.evaluation.plausibility.jumps.sample_steps import SampleJump
from bufferstand.evaluation.plausibility.run_view.passes import HalfCycle, Pass
from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.plausibility.records import Floats, of_kind, static


def impact(offset_kN: float, at_s: float, *, gain: float = 1.0, rests_mm: float = 0.0) -> RunEvaluation:
    """Return an impact of a buffer with a preload of 30 kN, 81 mm deep, whose force changes at a moment."""
    time_s = np.arange(0.0, 2.5, 0.0005)
    way_in = np.sin(0.5 * np.pi * np.clip((time_s - 0.4) / 0.14, 0.0, 1.0))
    way_out = np.cos(0.5 * np.pi * np.clip((time_s - 0.54) / 0.36, 0.0, 1.0))
    stroke = np.where(time_s < 0.54, 81.0 * way_in, rests_mm + (81.0 - rests_mm) * way_out)
    lost = np.where(time_s < 0.54, 0.0, 0.5 * (1.0 - np.exp(-(81.0 - stroke) / 2.0)))
    force = (1.0 - lost) * (30.0 * np.clip(stroke / 0.2, 0.0, 1.0) + 0.07 * stroke**2)
    random = np.random.default_rng(2)
    force = np.where(time_s > at_s, gain * force + offset_kN, force) + 0.1 * random.standard_normal(
        time_s.size
    )
    record = make_record(time_s, stroke + 0.01 * random.standard_normal(time_s.size), force)
    return evaluate_run(record, RunFacts("i", "impact", specimen={"category": "A"}), Options(draws=0))


@pytest.mark.parametrize("offset_kN", [-40.0, 50.0])
@pytest.mark.parametrize("at_s", [0.54, 0.7, 1.2])
def test_the_force_at_rest_after_an_impact_is_not_that_before(offset_kN: float, at_s: float) -> None:
    run = impact(offset_kN, at_s)
    (jump,) = of_kind(run, "offset-jump") or of_kind(run, "gain-jump")
    assert jump.start_s - 0.001 < at_s < jump.end_s + 0.001
    assert jump.size == pytest.approx(offset_kN, abs=4.0)
    assert run.verdict == "inconclusive"


@pytest.mark.parametrize("rests_mm", [0.0, 0.1, 0.25])
def test_a_preload_that_rests_on_the_cell_after_an_impact_is_no_jump(rests_mm: float) -> None:
    run = impact(0.0, 0.0, rests_mm=rests_mm)
    assert not of_kind(run, "offset-jump")
    assert not of_kind(run, "gain-jump")


@pytest.mark.parametrize("at_s", [0.43, 0.62, 0.7])
def test_a_gain_that_changes_in_an_impact(at_s: float) -> None:
    (jump,) = of_kind(impact(0.0, at_s, gain=1.08), "gain-jump")
    assert jump.start_s == pytest.approx(at_s, abs=0.002)


def test_a_gain_that_changes_as_a_held_load_rests() -> None:
    time_s = np.arange(0.0, 20.0, 0.01)
    stroke = np.interp(time_s, [2.0, 6.0, 14.0, 18.0], [0.0, 60.0, 60.0, 0.0])
    lost = np.where(time_s < 14.0, 0.0, 0.4 * (1.0 - np.exp(-(60.0 - stroke) / 2.0)))
    force = (1.0 - lost) * (5.0 * stroke + 20.0 * np.clip(stroke / 0.2, 0.0, 1.0))
    random = np.random.default_rng(4)
    force = force * np.where(time_s > 9.0, 0.85, 1.0) + 0.1 * random.standard_normal(time_s.size)
    record = make_record(time_s, stroke + 0.01 * random.standard_normal(time_s.size), force)
    run = evaluate_run(record, RunFacts("p", "proof"), Options(draws=0))
    (jump,) = [*of_kind(run, "gain-jump"), *of_kind(run, "offset-jump")]
    assert jump.start_s == pytest.approx(9.0, abs=0.02)


def from_on(at_s: float, gain: float, begins_s: float = 0.0) -> object:
    """Return what lets the force of a static test be another from a moment on, and the record begin late."""

    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        there = time_s >= begins_s
        changed = np.where(time_s > at_s, gain * force, force)
        return time_s[there], stroke[there], changed[there]

    return change


def test_a_gain_that_changes_at_a_small_force() -> None:
    """At 5 mm of stroke 2: 1.3 kN of 600, 5 % of the force there."""
    (jump,) = of_kind(static(from_on(48.82, 1.05)), "gain-jump")  # type: ignore[arg-type]
    assert jump.start_s == pytest.approx(48.82, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "count"), [(1.06, 1), (1.0, 0), (0.9, 0), (0.75, 1)])
def test_strokes_without_loops_are_compared_on_their_way_in(gain: float, count: int) -> None:
    """The record begins at 20 mm of stroke 1; the gain changes in the pause after it."""
    run = static(from_on(45.5, gain, begins_s=6.0), preload_kN=0.0)  # type: ignore[arg-type]
    assert not run.cycles[0].cycle.complete
    found = of_kind(run, "gain-jump")
    assert len(found) == count
    if count:
        assert found[0].size == pytest.approx(gain, abs=0.01)
        assert "between strokes 1 and 2" in found[0].text


@pytest.mark.parametrize("jumps", [False, True])
def test_a_held_force_makes_no_jump_and_hides_none(*, jumps: bool) -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        made = np.where(time_s > 12.0, 1.06, 1.0) * force if jumps else force
        return time_s, stroke, made[np.arange(force.size) // 8 * 8]

    run = static(change, speed_mm_per_s=20.0)
    assert of_kind(run, "held")
    assert len(of_kind(run, "gain-jump")) == int(jumps)


@pytest.mark.slow
@pytest.mark.parametrize("jumps_kN", [0.0, 14.0])
def test_a_motion_that_stops_within_a_pass_makes_no_jump(jumps_kN: float) -> None:
    """What comes of the speed is let go where the motion stops, for 2 s, on the way to a sine."""
    time_s = np.arange(0.0, 12.0, 0.005)
    angle = 2.0 * np.pi * np.clip(time_s - 5.0, 0.0, None)
    stroke = np.interp(time_s, [1.0, 3.0], [0.0, 60.0]) + 26.0 * np.sin(angle)
    moves = np.gradient(stroke, time_s) / 30.0
    force = 4.0 * stroke + 12.0 * np.tanh(moves) + jumps_kN * (time_s > 4.0)
    force = force + 0.05 * np.random.default_rng(1).standard_normal(time_s.size)
    run = evaluate_run(make_record(time_s, stroke, force), RunFacts("h", "harmonic"), Options(draws=0))
    found = [*of_kind(run, "gain-jump"), *of_kind(run, "offset-jump")]
    assert [one.start_s for one in found] == pytest.approx([4.0] if jumps_kN else [], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("offset_kN", "count"), [(45.0, 1), (-45.0, 1), (0.0, 0)])
def test_the_force_at_rest_is_not_that_of_the_way_in(offset_kN: float, count: int) -> None:
    """The record begins with the motion; the zero moves 0.1 s before the first stroke ends."""

    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        there = time_s >= 2.0
        made = force + np.where(time_s > 42.7, offset_kN, 0.0)
        return time_s[there], stroke[there], made[there]

    run = static(change)
    assert len([*of_kind(run, "offset-jump"), *of_kind(run, "gain-jump")]) == count
    assert not count or run.verdict == "inconclusive"


@pytest.mark.slow
@pytest.mark.parametrize("waves_mm", [0.0, 0.2])
def test_a_ramp_that_no_other_pass_is_like_may_stop(waves_mm: float) -> None:
    """Friction is let go where a ramp stops, as no other pass shows; a draw wire may wave there."""
    time_s = np.arange(0.0, 16.0, 0.02)
    angle = 2.0 * np.pi * 0.25 * np.clip(time_s - 6.0, 0.0, None)
    stroke = np.interp(time_s, [1.0, 4.0], [0.0, 70.0]) + 14.0 * (1.0 - np.cos(angle))
    speed = np.diff(stroke, append=stroke[-1]) / 0.02
    force = 5.0 * stroke + 22.0 * np.tanh(speed / 20.0)
    random = np.random.default_rng(1)
    seen = stroke + waves_mm * np.sin(3.0 * time_s) + 0.01 * random.standard_normal(time_s.size)
    force = force + 0.05 * random.standard_normal(time_s.size)
    run = evaluate_run(make_record(time_s, seen, force), RunFacts("h", "harmonic"), Options(draws=0))
    assert not [*of_kind(run, "gain-jump"), *of_kind(run, "offset-jump")]


@pytest.mark.slow
def test_a_preload_that_a_filter_spreads_makes_no_jump() -> None:
    """No other pass is like the first, which goes on to the top; its contact takes nine samples."""
    time_s = np.arange(0.0, 12.0, 0.005)
    angle = np.pi * np.clip(time_s - 4.0, 0.0, None)
    stroke = np.interp(time_s, [1.0, 4.0], [0.0, 40.0]) + 12.0 * (1.0 - np.cos(angle))
    met = 0.5 * (1.0 + np.tanh((time_s - 1.05) / 0.0125))
    force = 26.0 * met + 1.6 * stroke + 0.02 * np.random.default_rng(1).standard_normal(time_s.size)
    run = evaluate_run(make_record(time_s, stroke, force), RunFacts("h", "harmonic"), Options(draws=0))
    assert not of_kind(run, "gain-jump")


@pytest.mark.slow
def test_a_preload_that_is_let_go_while_the_stroke_is_held_makes_no_jump() -> None:
    time_s = np.linspace(0.0, 1.0, 101)
    force = Samples("force", time_s, np.where(time_s < 0.5, 0.2, 23.0 + 100.0 * (time_s - 0.5))[::-1])
    own = Pass(-1, np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.2, 23.0, 23.9, 24.8]))
    assert _is_contact(force, SampleJump(49, 53, -22.0), HalfCycle(1, -1, 0.0, 1.0), own)
    assert not _is_contact(force, SampleJump(39, 43, -22.0), HalfCycle(1, -1, 0.0, 1.0), own)
