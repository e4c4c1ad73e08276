"""A sine that is corrected while it runs is one step: its summary is over the cycles after the correction."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.protocols.prediction.machine_stroke import Sine
from bufferstand.recording.runfile.run import RunEvent
from tests.evaluation.signals import STATED, Floats
from tests.evaluation.stepped import LOSS, STORAGE, MEAN_kN, record_of

RATE_Hz, FREQUENCY_Hz, CYCLES = 500.0, 1.0, 10
FIRST, ASKED = Sine(39.7, 14.83), Sine(40.0, 15.0)
TOLD, TOLD_NEXT = Sine(40.74, 15.43), Sine(41.04, 15.60)
"""What the piston was told: it goes 0.3 mm and 0.17 mm further, and so does the specimen."""
STEP: dict[str, Any] = {
    "prestress_mm": 40.0,
    "amplitude_mm": 15.0,
    "frequency_Hz": FREQUENCY_Hz,
    "compensate": True,
}


def _columns(sines: list[tuple[float, Sine]]) -> tuple[Floats, Floats, Floats]:
    """Return sines; each is gone over to from its moment on [s], within a cycle, by half a cosine."""
    time = np.arange(round(CYCLES * RATE_Hz / FREQUENCY_Hz)) / RATE_Hz
    mean, amplitude = np.full(time.size, sines[0][1].mean_mm), np.full(time.size, sines[0][1].amplitude_mm)
    for at_s, sine in sines[1:]:
        share = 0.5 - 0.5 * np.cos(np.pi * np.clip((time - at_s) * FREQUENCY_Hz, 0.0, 1.0))
        mean += share * (sine.mean_mm - mean)
        amplitude += share * (sine.amplitude_mm - amplitude)
    angle = 2.0 * np.pi * FREQUENCY_Hz * time
    random = np.random.default_rng(5)
    stroke = mean - amplitude * np.cos(angle) + 0.005 * random.standard_normal(time.size)
    force = MEAN_kN + STORAGE * (stroke - 50.0) + LOSS * amplitude * np.sin(angle)
    return time, stroke, force


def _corrected(at_s: float, to: Sine) -> RunEvent:
    text = f"corrected to {to.mean_mm:.3f} ± {to.amplitude_mm:.3f} mm of the piston"
    return RunEvent(at_s, "stroke", text, {"mean_mm": to.mean_mm, "amplitude_mm": to.amplitude_mm})


def _ended(at_s: float, first: Sine) -> RunEvent:
    data = {
        "motion": "harmonic",
        "commanded_mean_mm": first.mean_mm,
        "commanded_amplitude_mm": first.amplitude_mm,
    }
    return RunEvent(at_s, "stroke", "asked …, commanded …, reached …", data)


def _evaluated(sines: list[tuple[float, Sine]], *events: RunEvent) -> RunEvaluation:
    facts = RunFacts("corrected", "harmonic", specimen={"id": "B1"}, step=STEP, stroke_events=events)
    stated: dict[str, Any] = STATED
    facts = replace(facts, **stated)
    return evaluate_run(record_of(_columns(sines)), facts, Options(draws=0))


def _settling(run: RunEvaluation) -> list[int]:
    return [r.cycle.index for r in run.cycles if any("still being corrected" in why for why in r.cycle.why)]


CORRECTED = [(0.0, FIRST), (4.1, ASKED)]


def test_without_a_word_of_a_correction_it_is_two_steps() -> None:
    run = _evaluated(CORRECTED)
    assert len(run.steps) == 2
    assert run.summary.values["amplitude_mm"].value is None
    assert _settling(run) == []


@pytest.mark.parametrize("ended", [True, False])
def test_a_corrected_sine_is_one_step_and_its_summary_is_over_the_cycles_after(ended: bool) -> None:
    events = [_corrected(4.1, TOLD_NEXT), *([_ended(10.0, TOLD)] if ended else [])]
    run = _evaluated(CORRECTED, *events)
    assert run.steps == ()
    # Cycle n is from n - 1 to n s: the fifth holds most of the change, the sixth begins when 2 % are left.
    assert set(_settling(run)) == {1, 2, 3, 4, 5}
    assert run.summary.cycles_used == (6, 7, 8, 9, 10)
    assert run.summary.values["amplitude_mm"].value == pytest.approx(15.0, abs=0.01)
    assert run.summary.values["prestress_mm"].value == pytest.approx(40.0, abs=0.01)
    assert not [text for text in run.warnings if "not its step" in text or "no summary" in text]


def test_all_cycles_count_whose_command_is_as_good_as_the_last_one() -> None:
    finer = Sine(TOLD_NEXT.mean_mm + 0.05, TOLD_NEXT.amplitude_mm + 0.03)
    run = _evaluated(
        [*CORRECTED, (8.2, Sine(40.05, 15.03))],
        _corrected(4.1, TOLD_NEXT),
        _corrected(8.2, finer),
        _ended(10.0, TOLD),
    )
    assert run.summary.cycles_used == (6, 7, 8, 9, 10)


def test_a_correction_that_no_cycle_follows_leaves_the_cycles_before_it() -> None:
    run = _evaluated(
        [(0.0, FIRST), (4.1, ASKED), (8.7, Sine(40.4, 15.2))],
        _corrected(4.1, TOLD_NEXT),
        _corrected(8.7, Sine(41.44, 15.80)),
        _ended(10.0, TOLD),
    )
    assert run.steps == ()
    assert run.summary.cycles_used == (6, 7, 8)
    assert 9 in _settling(run)


def test_several_corrections_settle_together() -> None:
    started = Sine(FIRST.mean_mm - 0.6, FIRST.amplitude_mm - 0.5)
    run = _evaluated(
        [(0.0, started), (2.3, FIRST), (4.1, ASKED)],
        _corrected(2.3, TOLD),
        _corrected(4.1, TOLD_NEXT),
        _ended(10.0, Sine(TOLD.mean_mm - 0.6, TOLD.amplitude_mm - 0.5)),
    )
    assert run.steps == ()
    assert run.summary.cycles_used == (6, 7, 8, 9, 10)


@pytest.mark.parametrize(
    "before", [replace(FIRST, mean_mm=FIRST.mean_mm - 2.0), replace(FIRST, amplitude_mm=12.0)]
)
def test_what_no_correction_can_have_made_stays_a_step(before: Sine) -> None:
    run = _evaluated([(0.0, before), (4.1, ASKED)], _corrected(4.1, TOLD_NEXT), _ended(10.0, TOLD))
    assert len(run.steps) == 2


def test_steps_of_one_record_stay_apart_though_one_of_them_was_corrected() -> None:
    """The first motion is over, as its own words say, before the second is corrected."""
    near = Sine(40.6, 15.0)  # as near as a correction could lead to
    run = _evaluated(
        [(0.0, near), (3.3, FIRST), (6.3, ASKED)],
        _ended(3.3, Sine(41.3, 15.43)),
        _corrected(6.3, TOLD_NEXT),
        _ended(10.0, TOLD),
    )
    before, after = run.steps
    assert {1, 2, 3} <= set(before.summary.cycles_used) <= {1, 2, 3, 4}
    assert after.summary.cycles_used == (9, 10)


def test_a_piston_that_follows_its_spring_leaves_the_cycles_as_they_are() -> None:
    """Many small corrections, in sum a tenth of a millimetre and more: the specimen's stroke stays."""
    told = [replace(TOLD, mean_mm=TOLD.mean_mm - 0.05 * n) for n in range(1, 5)]
    said = [_corrected(2.1 + 2.0 * n, command) for n, command in enumerate(told)]
    run = _evaluated([(0.0, ASKED)], *said, _ended(10.0, TOLD))
    assert len(run.steps) == 0
    assert set(run.summary.cycles_used) >= {2, 3, 4, 5, 6, 7, 8}


def test_other_words_of_the_stroke_correct_nothing() -> None:
    not_taken = RunEvent(4.1, "stroke", "not corrected to 41.04 ± 15.60 mm", {})
    without_time = replace(_corrected(4.1, TOLD_NEXT), time_s=None)
    assert len(_evaluated(CORRECTED, not_taken, without_time).steps) == 2
