"""The two draw wires: what their difference says, and a wire that is broken or stuck."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.plausibility.run_view.view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.draw_wires import check_wires
from bufferstand.evaluation.plausibility.signal_comparison.stroke_sensors import strokes_and_piston
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.record.signals import Signals
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from bufferstand.foundation.channels.strokes import mean_of_strokes, tilt_of_strokes
from tests.evaluation.signals import STATED, Ellipse, Floats
from tests.evaluation.test_load import write

ELLIPSE = Ellipse()
FACTS = RunFacts("h", "harmonic", **STATED)  # type: ignore[arg-type]


def record(one: Floats, two: Floats, columns: tuple[Floats, Floats, Floats]) -> Record:
    return make_record(columns[0], 0.5 * (one + two), columns[2], wire_difference_mm=one - two)


def run(
    offset: float = 0.0, mismatch: float = 0.0, noise: float = 0.01, facts: RunFacts = FACTS
) -> RunEvaluation:
    """Evaluate a run whose wires differ by offset + mismatch · stroke, around the true stroke."""
    columns = ELLIPSE.columns(1.0, 500.0, 6.5)
    stroke = columns[1]
    half = 0.5 * (offset + mismatch * stroke)
    random = np.random.default_rng(3)
    one = stroke + half + noise * random.standard_normal(stroke.size)
    two = stroke - half + noise * random.standard_normal(stroke.size)
    return evaluate_run(record(one, two, columns), facts)


def test_offset_and_scale_are_told_apart() -> None:
    wires = run(offset=0.1, mismatch=0.004).draw_wires
    assert wires is not None
    assert wires.offset_mm == pytest.approx(0.1, abs=0.005)
    assert wires.scale_mismatch == pytest.approx(0.004, abs=1e-4)
    assert wires.largest_difference_mm == pytest.approx(0.1 + 0.004 * 70.0, abs=0.06)
    assert wires.remaining_mm == pytest.approx(0.05, abs=0.03)
    # Both wires: linearity 0.25 mm and zero 0.05 mm.
    assert wires.limit_mm == pytest.approx(0.6)
    assert wires.warnings == ()


def test_beyond_the_limit_is_warned_of() -> None:
    evaluation = run(offset=1.0)
    warning = next(w for w in evaluation.warnings if "draw wires differ" in w)
    assert "limit 0.6 mm; +1 mm at stroke 0" in warning
    assert evaluation.summary.values["damping"].value == pytest.approx(
        ELLIPSE.absorbed / ELLIPSE.stored, rel=2e-3
    )


def test_accuracy_in_percent_counts_at_the_largest_stroke() -> None:
    stated = (ChannelUncertainty(accuracy_percent=1.0),) * 2
    wires = run(facts=replace(FACTS, stroke_uncertainty=stated)).draw_wires
    assert wires is not None
    assert wires.limit_mm == pytest.approx(2.0 * 0.7, rel=1e-3)


def test_no_limit_is_said() -> None:
    evaluation = run(facts=replace(FACTS, stroke_uncertainty=()))
    assert evaluation.draw_wires is not None
    assert evaluation.draw_wires.limit_mm is None
    assert any("no limit for the difference of the draw wires" in w for w in evaluation.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("stuck", [1, 2])
@pytest.mark.parametrize("at", [0.0, 0.55])
def test_a_stuck_wire_is_recognised_and_left_out(stuck: int, at: float) -> None:
    columns = ELLIPSE.columns(1.0, 500.0, 8.5)
    time, stroke, _ = columns
    random = np.random.default_rng(3)
    wires = [stroke + 0.01 * random.standard_normal(stroke.size) for _ in range(2)]
    from_row = round(at * stroke.size)
    rest = stroke.size - from_row
    wires[stuck - 1][from_row:] = wires[stuck - 1][from_row] + 0.01 * random.standard_normal(rest)
    evaluation = evaluate_run(record(wires[0], wires[1], columns), FACTS)
    found = evaluation.draw_wires
    assert found is not None
    (gone,) = found.out
    assert gone.wire == f"stroke_{stuck}"
    assert gone.from_s == pytest.approx(time[from_row], abs=0.1)
    assert any(f"draw wire stroke_{stuck} stands still from" in w for w in evaluation.warnings)
    size = evaluation.record.averaged
    whole = stroke.size // size
    expected = wires[2 - stuck][: whole * size].reshape(-1, size).mean(axis=1)
    np.testing.assert_allclose(evaluation.record.stroke_mm[:whole], expected, atol=1e-9)
    assert evaluation.summary.values["amplitude_mm"].value == pytest.approx(20.0, rel=1e-3)
    assert evaluation.facts.stroke_uncertainty == STATED["stroke_uncertainty"][:1]  # type: ignore[index]


def late(stroke: Floats, samples: int) -> Floats:
    """Return a stroke that comes so many samples late."""
    return np.concatenate((np.full(samples, stroke[0]), stroke[:-samples]))


def moved_once() -> tuple[Floats, Floats, Floats]:
    time_s = np.arange(5000) / 500.0
    stroke = 20.0 * np.clip(time_s - 2.0, 0.0, 3.0)
    return time_s, stroke, 5.0 * stroke


def test_a_wire_that_is_late_is_not_broken_and_neither_is_the_other_one() -> None:
    """Each stands still while the other moves: at the beginning the late one, at the end the other."""
    columns = moved_once()
    found = check_wires(record(columns[1], late(columns[1], 500), columns), FACTS)[2]
    assert found is not None
    assert found.out == ()
    assert found.largest_difference_mm == pytest.approx(20.0, abs=0.1)


def test_of_three_wires_the_late_one_is_left_out() -> None:
    columns = moved_once()
    time_s, stroke, force = columns
    wires = {"stroke_1": stroke, "stroke_2": late(stroke, 500), "stroke_3": stroke + 0.1}
    made = make_record(
        time_s,
        mean_of_strokes([*wires.values()]),
        force,
        wire_difference_mm=tilt_of_strokes([*wires.values()]),
    )
    read = {name: (time_s, wire) for name, wire in wires.items()}
    left, _, found = check_wires(replace(made, as_recorded=read), FACTS)
    assert found is not None
    (gone,) = found.out
    assert (gone.wire, gone.from_s) == ("stroke_2", pytest.approx(2.0, abs=0.1))
    np.testing.assert_allclose(left.stroke_mm, stroke + 0.05, atol=1e-9)


@pytest.mark.slow
def test_small_and_still_runs_accuse_no_wire() -> None:
    random = np.random.default_rng(3)
    time = np.arange(3000) / 500.0
    still = [50.0 + 0.01 * random.standard_normal(time.size) for _ in range(2)]
    found = evaluate_run(record(still[0], still[1], (time, time, 0.0 * time)), FACTS).draw_wires
    assert found is not None
    assert found.out == ()
    assert found.offset_mm is None


@pytest.mark.slow
def test_in_the_document() -> None:
    one_wire = evaluate_run(make_record(*ELLIPSE.columns(1.0, 500.0, 3.5)), FACTS)
    entries = evaluation_document([run(offset=0.1), one_wire])["runs"]
    assert entries[0]["draw_wires"]["largest_difference_mm"] > 0.1
    assert set(entries[0]["draw_wires"]) == {
        "largest_difference_mm", "at_s", "offset_mm", "scale_mismatch", "remaining_mm", "limit_mm", "out",
    }  # fmt: skip
    assert entries[1]["draw_wires"] is None


@pytest.mark.slow
def test_from_a_run_file(tmp_path: Path) -> None:
    loaded, facts = load_run(write(tmp_path / "r1.h5"))
    assert loaded.wire_difference_mm is not None
    np.testing.assert_allclose(loaded.wire_difference_mm, 2.0, atol=1e-3)
    assert facts.force_delay_s == 0.0008
    assert facts.moving_mass_kg is None


def told_of(two_of: Callable[[Floats, Floats], Floats]) -> list[str]:
    """Return the kinds of findings about two wires alone; fifteen samples a cycle, one wire is right."""
    time, stroke, force = ELLIPSE.columns(1.0, 15.0, 2.6)
    two = two_of(time, stroke)
    seen = record(stroke, two, (time, stroke, force))
    signals = Signals(time, {"force": force, "stroke_1": stroke, "stroke_2": two})
    return [finding.kind for finding in strokes_and_piston(RunView(seen, seen, (), FACTS), signals, None)]


@pytest.mark.slow
def test_a_wire_that_slips_is_no_factor() -> None:
    """A straight line through both says one, but what it leaves is more than what it explains."""
    assert told_of(lambda t, x: x - 9.0 * (t > 0.3)) == []
    assert told_of(lambda _, x: 1.08 * x) == ["scale"]
    assert told_of(lambda _, x: 7.0 - x) == ["sign"]
