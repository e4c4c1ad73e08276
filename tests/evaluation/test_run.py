"""One run from record to result: summary, warnings, reproducibility."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import Quantities
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED, Ellipse, StaticTest

ELLIPSE = Ellipse()
FACTS = RunFacts("harmonic-1", "harmonic", specimen={"id": "B1"})
STATED_FACTS = replace(FACTS, **STATED)  # type: ignore[arg-type]


def test_summary_is_the_mean_of_steady_cycles() -> None:
    run = evaluate_run(make_record(*ELLIPSE.columns(1.0, 500.0, 6.5, noise=5e-4)), STATED_FACTS)
    used = [c for c in run.cycles if c.cycle.steady]
    assert run.summary.cycles_used == tuple(c.cycle.index for c in used)
    for name in ("damping", "stored_energy_J", "tangent_stiffness_kN_per_mm", "frequency_Hz"):
        mean = np.mean([getattr(c.quantities, name) for c in used])
        assert run.summary.values[name].value == pytest.approx(mean)
    damping = run.summary.values["damping"]
    assert damping.expanded_uncertainty is not None
    assert 0.001 < damping.expanded_uncertainty / (damping.value or 1.0) < 0.03
    assert damping.coverage_factor == 2.0


def test_channel_errors_do_not_average_out() -> None:
    """Twenty cycles are no better than three where the error is the cell's, not noise."""
    few = evaluate_run(make_record(*ELLIPSE.columns(1.0, 200.0, 4.5)), STATED_FACTS)
    many = evaluate_run(make_record(*ELLIPSE.columns(1.0, 200.0, 21.5)), STATED_FACTS)
    one, other = (r.summary.values["stored_energy_J"].expanded_uncertainty for r in (few, many))
    assert one is not None
    assert other == pytest.approx(one, rel=0.01)


def test_no_uncertainty_is_none_and_said() -> None:
    run = evaluate_run(make_record(*ELLIPSE.columns(1.0, 500.0, 4.5)), FACTS)
    for measured in run.summary.values.values():
        assert measured.expanded_uncertainty is None
    assert all(c.expanded_uncertainty == {} for c in run.cycles)
    assert any("no expanded uncertainties" in w for w in run.warnings)


def test_same_to_the_last_bit() -> None:
    record = make_record(*ELLIPSE.columns(1.0, 300.0, 4.5, noise=1e-3))
    first, again = evaluate_run(record, STATED_FACTS), evaluate_run(record, STATED_FACTS)
    assert first.summary == again.summary
    assert first.cycles == again.cycles
    assert evaluate_run(record, STATED_FACTS, Options(seed=5)).summary != first.summary


def test_more_draws_agree() -> None:
    record = make_record(*ELLIPSE.columns(1.0, 300.0, 4.5))
    few = evaluate_run(record, STATED_FACTS, Options(draws=2000)).summary.values["damping"]
    many = evaluate_run(record, STATED_FACTS, Options(draws=10_000)).summary.values["damping"]
    assert many.value == few.value
    assert many.expanded_uncertainty == pytest.approx(few.expanded_uncertainty or 0.0, rel=0.05)


def test_harmonic_run_has_no_verdict() -> None:
    run = evaluate_run(make_record(*ELLIPSE.columns(1.0, 500.0, 4.5)), FACTS)
    assert run.verdict is None
    assert run.requirements == ()
    assert run.limit_set is None


def test_defects_are_warned_of_and_bridged_where_they_are_short() -> None:
    time, stroke, force = ELLIPSE.columns(1.0, 500.0, 6.5)
    clean = evaluate_run(make_record(time, stroke, force), FACTS)
    force = force.copy()
    force[1000:1060] = force[1700:1705] = np.nan
    time = time.copy()
    time[2000:2004] = time[1999]
    run = evaluate_run(make_record(time, stroke, force), FACTS)
    (bridged,) = [w for w in run.warnings if w.startswith("interpolated across")]
    assert "NaN" in bridged
    assert "repeated time stamp" in bridged
    (long,) = [w for w in run.warnings if w.startswith("not on record, and too long")]
    assert "NaN) in 60 samples" in long
    (lost,) = [c for c in run.cycles if not c.cycle.bounded]
    assert not lost.cycle.complete
    assert lost.quantities == Quantities()
    assert run.summary.values["damping"].value == pytest.approx(
        clean.summary.values["damping"].value, rel=5e-5
    )


def test_lost_samples_that_change_next_to_nothing_are_notes() -> None:
    time, stroke, force = ELLIPSE.columns(1.0, 500.0, 6.5)
    few, many = force.copy(), force.copy()
    few[1540:1542] = np.nan
    many[1580:1592] = np.nan
    slight = evaluate_run(make_record(time, stroke, few), FACTS)
    bridged = [text for text in slight.warnings if "interpolated across" in text]
    assert len(bridged) == 2
    assert set(bridged) <= set(slight.notes)
    told = evaluate_run(make_record(time, stroke, many), FACTS)
    (cycle,) = [t for t in told.warnings if t.startswith("cycle") and "interpolated across" in t]
    assert cycle not in told.notes
    assert [t for t in told.notes if t.startswith("interpolated across: ")]


def test_empty_and_still_records() -> None:
    nothing = np.zeros(0)
    empty = evaluate_run(Record(nothing, nothing, nothing), replace(FACTS, problems=("no samples",)))
    assert empty.cycles == ()
    assert "no samples" in empty.warnings
    assert empty.summary.values["damping"].value is None
    still = evaluate_run(make_record(np.arange(100) * 0.01, np.zeros(100), np.zeros(100)), FACTS)
    assert any("no cycle found" in w for w in still.warnings)


def test_status_is_said() -> None:
    record = make_record(*ELLIPSE.columns(1.0, 500.0, 3.5))
    run = evaluate_run(record, replace(FACTS, status="recovered"))
    assert "the run is not whole: its status is recovered" in run.warnings


def test_run_that_is_not_its_step() -> None:
    record = make_record(*ELLIPSE.columns(1.0, 500.0, 4.5))
    step = {"prestress_mm": 52.0, "amplitude_mm": 20.5, "frequency_Hz": 1.0}
    assert not any("its step" in w for w in evaluate_run(record, replace(FACTS, step=step)).warnings)
    other = replace(FACTS, step={**step, "frequency_Hz": 1.27})
    assert (
        "the run is not its step: frequency_Hz is 1, planned was 1.27" in evaluate_run(record, other).warnings
    )


def test_same_warning_of_many_cycles_is_said_once() -> None:
    run = evaluate_run(make_record(*Ellipse(mean_mm=0.0, mean_kN=1.0).columns(1.0, 500.0, 6.5)), FACTS)
    two_sided = [w for w in run.warnings if "two-sided" in w]
    assert len(two_sided) == 1
    assert two_sided[0].startswith("cycles 2 to 6: ")


def test_every_missing_figure_is_explained() -> None:
    """Nothing is None without a warning that says why."""
    for record in (
        make_record(*Ellipse(mean_kN=-20.0).columns(1.0, 500.0, 3.5)),
        make_record(*ELLIPSE.columns(1.0, 500.0, 0.9)),
        StaticTest(temperature_C=None).record(),
    ):
        run = evaluate_run(record, FACTS)
        for result in run.cycles:
            missing = [name for name, value in result.quantities._asdict().items() if value is None]
            assert not missing or result.warnings or run.warnings
            if "damping" in missing:
                assert any("no damping" in w or "no energies" in w for w in result.warnings)
            if "temperature_start_C" in missing:
                assert any("no temperature" in w for w in run.warnings)
