"""Cycles that do not belong together are not averaged: steps, sweeps, drifts, strokes of different height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.across_runs.points import points_of
from bufferstand.evaluation.archive.run_queries import result_facts
from bufferstand.evaluation.archive.stored_run import keep
from bufferstand.evaluation.document.build import evaluation_document, run_entry, what_runs_say_together
from bufferstand.evaluation.facts.results import RunEvaluation
from tests.evaluation.stepped import Block, columns, evaluated, strokes, sweep

BLOCKS = (Block(), Block(amplitude_mm=10.0), Block(frequency_Hz=2.0), Block(mean_mm=70.0), Block())


def _value(run: RunEvaluation, step: int, name: str) -> float:
    value = run.steps[step].summary.values[name].value
    assert value is not None
    return value


def test_each_step_has_the_figures_of_its_own_closed_form_and_the_run_has_none() -> None:
    run = evaluated(columns(BLOCKS, noise=0.005))
    assert len(run.steps) == len(BLOCKS)
    assert all(measured.value is None for measured in run.summary.values.values())
    assert any("no summary of the run: it has 5 steps" in text for text in run.warnings)
    for number, block in enumerate(BLOCKS):
        assert run.steps[number].index == number + 1
        assert _value(run, number, "amplitude_mm") == pytest.approx(block.amplitude_mm, rel=1e-3)
        assert _value(run, number, "frequency_Hz") == pytest.approx(block.frequency_Hz, rel=4e-3)
        assert _value(run, number, "prestress_mm") == pytest.approx(block.mean_mm, abs=0.02)
        assert _value(run, number, "damping") == pytest.approx(block.damping, rel=5e-3)
        # A ramp belongs to none, nor does the cycle that it spoils.
        assert block.cycles - 2 <= len(run.steps[number].summary.cycles_used) <= block.cycles


def test_steps_are_in_order_apart_and_share_no_cycle() -> None:
    run = evaluated(columns(BLOCKS))
    numbers = [number for step in run.steps for number in step.cycles]
    assert numbers == sorted(set(numbers))
    ends = [moment for step in run.steps for moment in (step.start_s, step.end_s)]
    assert ends == sorted(ends)


@pytest.mark.parametrize("share", [0.005, 0.02, 0.03, 0.05, 0.2])
@pytest.mark.parametrize("what", ["amplitude_mm", "frequency_Hz", "mean_mm"])
def test_a_larger_change_is_a_step_and_a_change_below_the_least_is_none(what: str, share: float) -> None:
    one = Block(cycles=12)
    # 0.02 of the range at an end: 0.04 of the amplitude, or of half the range of the mean.
    by = {"amplitude_mm": 40.0, "mean_mm": 40.0, "frequency_Hz": 1.0}[what] * share
    two = replace(one, **{what: getattr(one, what) + by})
    run = evaluated(columns((one, two), noise=0.002))
    assert len(run.steps) == (2 if share >= 0.02 else 0)


def test_one_step_is_a_run_with_a_summary_and_no_steps() -> None:
    run = evaluated(columns((Block(),), noise=0.005))
    assert run.steps == ()
    assert run.summary.values["damping"].value == pytest.approx(Block().damping, rel=5e-3)
    entry = run_entry(run)
    assert entry["steps"] == []
    assert entry["summary"]["damping"]["value"] == run.summary.values["damping"].value


@pytest.mark.parametrize("settles_in", [2.0, 5.0, 20.0])
def test_a_cold_start_that_settles_is_one_step(settles_in: float) -> None:
    time, stroke, force = columns((Block(cycles=40),), noise=0.002)
    # The amplitude comes up by 4 %, the mean creeps by 3 mm and the force softens by 10 %, decaying.
    left = np.exp(-time / settles_in)
    stroke = 50.0 + (stroke - 50.0) * (1.0 - 0.04 * left) - 3.0 * left
    run = evaluated((time, stroke, force * (1.0 + 0.1 * left)))
    assert run.steps == ()
    assert len(run.summary.cycles_used) > 30


@pytest.mark.parametrize("to_Hz", [0.6, 1.0, 3.0])
def test_a_sweep_of_frequency_has_no_summary_and_says_why(to_Hz: float) -> None:
    run = evaluated(sweep(0.5, to_Hz))
    assert run.steps == ()
    assert run.summary.cycles_used == ()
    assert run.mean_loop is None
    assert run_entry(run)["summary"]["damping"]["value"] is None
    assert any("a sweep has no mean" in text or "no summary" in text for text in run.warnings)


def test_a_sweep_of_amplitude_has_no_summary_either() -> None:
    run = evaluated(sweep(1.0, 1.0, to_mm=12.0))
    assert run.summary.cycles_used == ()
    assert any("the amplitude changes little by little" in text for text in run.warnings)


@pytest.mark.parametrize("seed", range(6))
def test_no_mean_is_less_certain_than_what_it_is_the_mean_of(seed: int) -> None:
    """1.22 ± 9507 Hz: U of a mean stays below the spread of its cycles and what the channels add."""
    random = np.random.default_rng(seed)
    blocks = [
        Block(
            float(random.uniform(2, 20)), float(random.uniform(0.3, 3.0)), cycles=int(random.integers(2, 6))
        )
        for _ in range(5)
    ]
    given = columns(blocks, ramp_s=float(random.uniform(0.0, 0.4)), noise=0.01, seed=seed)
    run = evaluated(given, draws=100)
    for summary in (run.summary, *(step.summary for step in run.steps)):
        frequency = summary.values["frequency_Hz"]
        if frequency.value is not None and frequency.expanded_uncertainty is not None:
            assert frequency.expanded_uncertainty < 0.1 * frequency.value


def test_strokes_of_different_height_are_steps_of_a_static_run() -> None:
    run = evaluated(strokes((40.0, 60.0, 80.0)), "static")
    assert [step.cycles for step in run.steps] == [(1,), (2,), (3,)]
    assert [round(_value(run, n, "stroke_max_mm")) for n in range(3)] == [40, 60, 80]
    assert [cycle.cycle.index for cycle in run.cycles] == [1, 2, 3]


@pytest.mark.parametrize(
    ("tops", "steps"),
    [
        ((102.0, 102.0, 102.0), []),
        ((96.0, 100.0, 101.0, 101.3), []),  # softer from stroke to stroke, to one force
        ((40.0, 40.0, 80.0, 80.0), [(1, 2), (3, 4)]),
        ((8.0, 102.0, 102.0), []),  # the first one only seats the specimen
    ],
)
def test_strokes_that_belong_together_stay_together(
    tops: tuple[float, ...], steps: list[tuple[int, ...]]
) -> None:
    run = evaluated(strokes(tops), "static")
    assert [step.cycles for step in run.steps] == steps
    assert bool(run.summary.cycles_used) != bool(steps)


def test_strokes_of_different_speed_are_steps() -> None:
    run = evaluated(strokes((80.0,) * 4, (5.0, 5.0, 20.0, 20.0)), "static")
    assert [step.cycles for step in run.steps] == [(1, 2), (3, 4)]


def test_each_step_is_a_point_of_the_trend_named_after_it() -> None:
    run = evaluated(columns([Block(frequency_Hz=f, cycles=6) for f in (0.5, 1.0, 2.0)]), name="all")
    trends = what_runs_say_together([run])["trends"]
    damping = next(trend for trend in trends if trend["quantity"] == "damping")
    assert damping["runs"] == ["all#1", "all#2", "all#3"]
    assert damping["frequency_Hz"] == pytest.approx([0.5, 1.0, 2.0], rel=5e-3)


def test_a_warm_and_a_cold_step_of_two_runs_are_compared() -> None:
    cold = evaluated(columns(BLOCKS[:2]), name="cold", temperature_C=15.0)
    warm = evaluated(columns(BLOCKS[:2]), name="warm", temperature_C=35.0)
    found = what_runs_say_together([warm, cold])["temperature_comparisons"]
    pairs = {(one["reference"]["run"], other["run"]) for one in found for other in one["runs"]}
    assert pairs == {("cold#1", "warm#1"), ("cold#2", "warm#2")}


def test_a_kept_run_gives_back_its_steps() -> None:
    run = evaluated(columns(BLOCKS))
    back = keep(run).light()
    assert [step.cycles for step in back.steps] == [step.cycles for step in run.steps]
    assert [step.summary.values["damping"].value for step in back.steps] == [
        step.summary.values["damping"].value for step in run.steps
    ]
    assert what_runs_say_together([back]) == what_runs_say_together([run])
    assert [point.facts.id for point in points_of(back)] == [f"stepped#{n}" for n in range(1, 6)]


def test_a_query_sees_each_step() -> None:
    parts = result_facts(keep(evaluated(columns(BLOCKS))))
    assert [part["part"] for part in parts] == [1, 2, 3, 4, 5, None], "last the extremes of the whole run"
    assert parts[1]["measured_amplitude_mm"] == pytest.approx(10.0, rel=1e-3)
    whole = result_facts(keep(evaluated(columns(BLOCKS[:1]))))
    assert [part["part"] for part in whole] == [None]


def test_the_document_has_steps_and_a_null_summary() -> None:
    entry = evaluation_document([evaluated(columns(BLOCKS), draws=100)])["runs"][0]
    assert entry["summary"] is None
    assert entry["half_width_95"] is None
    assert [step["index"] for step in entry["steps"]] == [1, 2, 3, 4, 5]
    for step in entry["steps"]:
        assert set(step["summary"]["cycles_used"]) <= set(step["cycles"])
        assert step["summary"]["damping"]["expanded_uncertainty"] > 0.0
        assert step["half_width_95"]["damping"] > 0.0
        assert step["budget"]
        assert step["skew_sensitivity"]["cycles"]
