"""The stroke that was asked for: whole campaigns, judged by the stand's own truth and not by its sensors."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.errors import CommandRejected
from bufferstand.recording.runfile.file import open_run
from tests.daq.stroke_bench import Case, reached, run
from tests.daq.stroke_study import FIRST, LATER, REVERSALS_S, STATIC, made, sine

ASKED = ((40.0, 15.0, 0.8), (60.0, 15.0, 0.8), (60.0, 20.0, 1.2), (70.0, 15.0, 2.0), (30.0, 20.0, 1.5))


@pytest.mark.parametrize(
    ("edition", "reversal_s"), [(3, 0.05), pytest.param(2, 0.03, marks=pytest.mark.long)]
)
def test_from_the_second_step_on_the_specimen_does_what_was_asked(
    tmp_path: Path, edition: int, reversal_s: float
) -> None:
    """A frame 30 % softer than stated, a spring 10 % softer, an actuator of 8 Hz that stands at its turns."""
    steps = "".join(sine(*one) for one in ASKED)
    outcome, opened, shown, _ = run(tmp_path, steps, Case(edition=edition, reversal_s=reversal_s))
    assert outcome.status == "complete", outcome.reason
    found = reached(opened, outcome)
    first = found[0]
    assert abs(first.amplitude_mm[0] / 15.0 - 1.0) > 0.006, "what nobody has measured cannot be made up for"
    assert any("after cycle 1" in line and "WARNING" in line for line in shown.lines)
    for (mean_mm, amplitude_mm, _), step in list(zip(ASKED, found, strict=True))[1:]:
        assert np.abs(step.amplitude_mm / amplitude_mm - 1.0).max() < 0.005
        assert np.abs(step.mean_mm - mean_mm).max() < 0.1
    lines = (tmp_path / "out" / "strokes.jsonl").read_text().splitlines()
    rows = [json.loads(line)["motions"][0] for line in lines]
    assert [row["cycles"] for row in rows] == [5] * len(ASKED)
    assert [row["cycles_off"] for row in rows] == ["1" if edition == 3 else "1-5", "", "", "", ""]
    last_percent = 100.0 * (first.amplitude_mm[-1] / 15.0 - 1.0)
    if edition == 3:  # it was changed while it ran
        assert abs(last_percent) < 0.5
        assert abs(first.mean_mm[-1] - 40.0) < 0.1
        assert not any("was not reached" in line for line in shown.lines)
    else:
        assert last_percent == pytest.approx(100.0 * (first.amplitude_mm[0] / 15.0 - 1.0), abs=0.1)


def check(folder: Path, first: str, asked: tuple[tuple[float, float, float], ...], case: Case) -> None:
    """Issue 16: every cycle from the second step on within 0.5 % and 0.1 mm of what was asked, by truth.

    What is said to be reached is what the evaluation reads from the run, within three quanta of the mean of
    the draw wires: far within U of either, which has their linearity of 0.25 mm.
    """
    for one in made(folder, first, asked, case, cycles=5):
        assert np.abs(one.off_percent).max() < 0.5, one
        assert np.abs(one.off_mm).max() < 0.1, one
        assert one.said_mm == pytest.approx(one.truth_mm, abs=0.02), "the wires' linearity"
        assert one.said_mm == pytest.approx(one.evaluated_mm, abs=0.02), one


def test_a_slow_stroke_teaches_what_the_next_step_needs(tmp_path: Path) -> None:
    check(tmp_path, STATIC, LATER[:1], Case(edition=2, reversal_s=0.05))


@pytest.mark.long
@pytest.mark.parametrize("first", ["static", "harmonic"])
@pytest.mark.parametrize("edition", [3, 2])
@pytest.mark.parametrize("reversal_s", REVERSALS_S)
def test_from_the_second_step_on_at_every_reversal(
    tmp_path: Path, reversal_s: float, edition: int, first: str
) -> None:
    begin = STATIC if first == "static" else sine(*FIRST)
    check(tmp_path, begin, LATER, Case(edition=edition, reversal_s=reversal_s, tick_s=0.01))


@pytest.mark.long
@pytest.mark.parametrize("edition", [3, 2])
def test_a_stroke_of_a_tenth_of_a_millimetre_of_noise(tmp_path: Path, edition: int) -> None:
    """The turns of 5 mm at 2.5 Hz are not known to 0.5 % then: the mean of its cycles is."""
    case = Case(edition=edition, reversal_s=0.03, simulation=(("stroke_noise_mm", 0.1),))
    for one in made(tmp_path, sine(*FIRST), LATER, case, cycles=8):
        assert abs(one.off_percent[1:].mean()) < 1.0, one
        assert abs(one.off_mm.mean()) < 0.1, one


def test_what_was_asked_commanded_and_reached_is_in_run_and_folder(tmp_path: Path) -> None:
    outcome, opened, _, _ = run(tmp_path, sine(40.0, 15.0, 0.8) + sine(60.0, 15.0, 0.8))
    truth = reached(opened, outcome)
    lines = [json.loads(line) for line in (tmp_path / "out" / "strokes.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [1, 2]
    for line, path, step in zip(lines, outcome.runs, truth, strict=True):
        (row,) = line["motions"]
        assert row["reached_mean_mm"] == pytest.approx(step.mean_mm[-1], abs=0.06), "the wires' linearity"
        assert row["reached_amplitude_mm"] == pytest.approx(step.amplitude_mm[-1], abs=0.06)
        events = [event for event in open_run(path).events if event.kind == "stroke"]
        assert events[-1].data["reached_amplitude_mm"] == row["reached_amplitude_mm"]
    assert lines[-1]["learned"]["give_mm_per_kN"] == pytest.approx(1.0 / 105.0, rel=0.05)
    assert lines[-1]["learned"]["force_factors"] == pytest.approx([0.9, 0.9], abs=0.04)


@pytest.mark.parametrize(("cycles", "changes"), [(2, 0), (3, 1)])
def test_a_sine_is_changed_only_while_a_cycle_is_left_that_shows_it(
    tmp_path: Path, cycles: int, changes: int
) -> None:
    outcome, _, _, _ = run(tmp_path, sine(40.0, 15.0, 0.8, cycles))
    said = [event.text for event in open_run(outcome.runs[0]).events if event.kind == "stroke"]
    assert sum(text.startswith("corrected to") for text in said) == changes, said
    assert not any("not corrected" in text for text in said)


def test_a_change_that_is_not_taken_is_said_without_the_words_of_the_wire(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = "controller rejected arming adjusting to 41 ± 15 mm (command 6, sequence 32): not possible"

    def reject(*_: object, **__: object) -> None:
        raise CommandRejected(answer)

    monkeypatch.setattr(RingController, "adjust_harmonic", reject)
    outcome, _, shown, _ = run(tmp_path, sine(40.0, 15.0, 0.8))
    assert outcome.status == "complete", "it is no reason to stop"
    events = [event for event in open_run(outcome.runs[0]).events if event.text.startswith("not corrected")]
    assert events
    for event in events:
        assert "the controller did not take the change; the sine goes on as it was" in event.text
        assert event.data == {"answer": answer}
    assert not any(word in line for line in shown.lines for word in ("command 6", "sequence", "arming"))
    told = [line for line in shown.lines if "is not corrected" in line]
    assert len(told) == 1, "once, however often it is tried"
    assert "40 ± 15 mm at 0.8 Hz is not corrected: the controller did not take the change" in told[0]


def test_a_corrected_run_is_one_step_whose_summary_is_what_was_asked(tmp_path: Path) -> None:
    outcome, _, _, _ = run(tmp_path, sine(40.0, 15.0, 0.8, 7), Case(bandwidth_Hz=3.7))
    found = evaluate_run(*load_run(outcome.runs[0]), Options(draws=0))
    assert found.steps == ()
    assert len(found.summary.cycles_used) >= 2, (
        found.warnings,
        found.findings if hasattr(found, "findings") else "",
    )
    assert found.summary.values["amplitude_mm"].value == pytest.approx(15.0, rel=0.005)
    assert found.summary.values["prestress_mm"].value == pytest.approx(40.0, abs=0.1)
    assert any("still being corrected" in why for one in found.cycles for why in one.cycle.why)
    assert not [text for text in found.warnings if "not its step" in text]


def test_a_slow_actuator_is_known_by_its_ramp_said_aloud_and_made_up_for(tmp_path: Path) -> None:
    """Its gain at 2 Hz is 0.88: the first sine is short by no more than frame, spring and damping make it."""
    steps = sine(50.0, 15.0, 2.0) + sine(50.0, 15.0, 2.0)
    outcome, opened, shown, _ = run(tmp_path, steps, Case(bandwidth_Hz=3.7, edition=2))
    assert outcome.status == "complete", outcome.reason
    first, second = reached(opened, outcome)
    assert 0.96 < first.amplitude_mm[0] / 15.0 < 0.98
    assert np.abs(second.amplitude_mm / 15.0 - 1.0).max() < 0.005
    assert any(line.startswith("WARNING: asked 50.00 ± 15.00 mm, commanded") for line in shown.lines)
    assert "WARNING: the stroke that was asked for was not reached in step 1" in shown.lines


def test_without_compensation_the_piston_does_what_was_asked(tmp_path: Path) -> None:
    steps = sine(60.0, 15.0, 0.5, more="compensate = false") * 2
    outcome, opened, shown, _ = run(tmp_path, steps, Case(bandwidth_Hz=15.0))
    for path, step in zip(outcome.runs, reached(opened, outcome), strict=True):
        command = open_run(path).series("command").value
        assert command.max() == pytest.approx(75.0, abs=0.02)
        assert step.mean_mm[-1] < 59.0
        assert step.amplitude_mm[-1] < 14.5
    assert not any("WARNING" in line for line in shown.lines), "that is what was asked for"


def test_without_compensation_a_slow_actuator_is_held_against_the_plan(tmp_path: Path) -> None:
    """At 2 Hz its gain is 0.88: the specimen has a tenth less than planned."""
    steps = sine(50.0, 10.0, 2.0, more="compensate = false")
    outcome, _, shown, _ = run(tmp_path, steps, Case(bandwidth_Hz=3.7, edition=2))
    assert outcome.status == "complete", outcome.reason
    (told,) = (line for line in shown.lines if "of the piston made" in line)
    assert told.startswith("WARNING: 50.00 ± 10.00 mm of the piston made 4")
    percent = re.search(r"amplitude ([+-]\d+\.\d+) %", told)
    assert percent is not None
    assert -16.0 < float(percent[1]) < -8.0


def test_a_machine_of_which_nothing_is_stated_is_learned(tmp_path: Path) -> None:
    steps = "".join(sine(*one) for one in ASKED[:3])
    outcome, opened, _, _ = run(tmp_path, steps, Case(stated_kN_per_mm=None, edition=2))
    for (mean_mm, amplitude_mm, _), step in list(zip(ASKED, reached(opened, outcome), strict=False))[1:]:
        assert np.abs(step.amplitude_mm / amplitude_mm - 1.0).max() < 0.005
        assert np.abs(step.mean_mm - mean_mm).max() < 0.1


@pytest.mark.parametrize("edition", [3, pytest.param(2, marks=pytest.mark.long)])
def test_no_correction_leads_beyond_a_limit(tmp_path: Path, edition: int) -> None:
    """A spring stiffer than its model: what is asked would bring more force than the step may have."""
    limits = "[limits]\nforce_max_kN = 356.0\nforce_trip_kN = 376.0\nstroke_max_mm = 82.0\n"
    steps = sine(62.0, 15.0, 0.8) * 3
    case = Case(softening=1.04, edition=edition, more=limits)
    outcome, opened, shown, plan = run(tmp_path, steps, case)
    assert outcome.status == "complete", outcome.reason
    assert max(step.expected_peak_force_kN or 0.0 for step in plan.steps) < 356.0
    first, *later = reached(opened, outcome)
    for step in later:
        assert 350.0 < step.peak_force_kN < 356.5
        assert step.amplitude_mm.max() < 15.0
    assert any("by what was learned: only" in line for line in shown.lines)
    assert max(step.peak_stroke_mm for step in (first, *later)) < 82.0


def test_a_resumed_campaign_goes_on_with_what_was_learned(tmp_path: Path) -> None:
    from bufferstand.daq.campaign.stroke_settings import terms_for
    from bufferstand.daq.strokes.stroke_rows import read_strokes

    outcome, opened, _, plan = run(tmp_path, sine(60.0, 15.0, 0.8))
    kept = read_strokes(tmp_path / "out")[-1]["learned"]
    terms = terms_for(plan, opened.stand, tmp_path / "out")
    assert terms.knowledge.as_dict() == kept
    assert terms.knowledge.give_mm_per_kN == pytest.approx(1.0 / 105.0, rel=0.1)
    assert outcome.status == "complete", outcome.reason


OTHERS = """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
stroke_limit_mm = 60.0
force_limit_kN = 500.0
cycles = 2

[[step]]
kind = "static"
speed_mm_per_s = 20.0
stroke_limit_mm = 60.0
force_limit_kN = 500.0
cycles = 1

[[step]]
kind = "inner-loops"
mean_mm = [40.0, 60.0]
amplitude_mm = [3.0, 15.0]
frequency_Hz = 1.0
cycles = 2

[[step]]
kind = "hold"
stroke_mm = 50.0
duration_s = 1.0
record = true
"""


def test_static_strokes_loops_and_holds_are_the_specimens_too(tmp_path: Path) -> None:
    outcome, opened, _, _ = run(tmp_path, sine(60.0, 15.0, 0.8) + OTHERS)
    assert outcome.status == "complete", outcome.reason
    truth = opened.truth.arrays()
    tops = []
    for path in outcome.runs:
        time_us = open_run(path).stream_of("stroke_1").time
        inside = (truth["time_us"] >= time_us[0]) & (truth["time_us"] <= time_us[-1])
        tops.append(truth["stroke_mm"][inside].max())
    _, once_mm, again_mm, loops_mm, hold_mm = tops
    assert once_mm == pytest.approx(60.0, abs=0.5), "the piston goes on for a moment"
    assert again_mm == pytest.approx(60.0, abs=0.15), "and that was seen"
    assert loops_mm == pytest.approx(75.0, abs=0.2)
    assert hold_mm == pytest.approx(50.0, abs=0.25)
