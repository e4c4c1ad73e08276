"""What a record is understood to be: rest, a slower logger, one that writes by event, rounded stamps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.gaps.bridging import bridged
from bufferstand.evaluation.record.clock_stamps import understand
from bufferstand.evaluation.record.event_logging import EventChanges, event_changes, silent_beyond_beat
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.record.time_steps import unusual_steps
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED, Ellipse, Floats, StaticTest

FACTS = RunFacts("r", "harmonic", **STATED)  # type: ignore[arg-type]
STATIC = RunFacts("s", "static", **STATED)  # type: ignore[arg-type]
WAVE = Ellipse()


def evaluated(time: Floats, stroke: Floats, force: Floats, facts: RunFacts = FACTS) -> RunEvaluation:
    return evaluate_run(make_record(time, stroke, force), facts, Options(draws=100))


def same_figures(one: RunEvaluation, other: RunEvaluation, rel: float) -> None:
    for name in (
        "absorbed_energy_J",
        "stored_energy_J",
        "damping",
        "amplitude_mm",
        "storage_stiffness_kN_per_mm",
    ):
        assert other.summary.values[name].value == pytest.approx(one.summary.values[name].value, rel=rel), (
            name
        )


def test_a_change_of_rate_is_no_gap() -> None:
    time = np.concatenate((np.arange(500) * 0.001, 0.5 + np.arange(200) * 0.01, 2.5 + np.arange(500) * 0.001))
    assert unusual_steps(time).size == 0
    np.testing.assert_array_equal(unusual_steps(np.delete(time, [100, 600])), [100, 599])


def test_a_logger_that_changes_its_rate_keeps_its_cycles() -> None:
    time, stroke, force = WAVE.columns(1.0, 1000.0, 8.4, noise=1e-4)
    keep = (time < 3.0) | (np.arange(time.size) % 10 == 0)
    whole, run = evaluated(time, stroke, force), evaluated(time[keep], stroke[keep], force[keep])
    assert [r.cycle.complete for r in run.cycles] == [r.cycle.complete for r in whole.cycles]
    same_figures(whole, run, 3e-4)


@given(lost=st.sets(st.integers(10, 480), max_size=3), rate=st.sampled_from([50.0, 1000.0, 12_345.6]))
@settings(max_examples=40, deadline=None)
def test_every_lost_sample_of_an_even_record_shows(lost: set[int], rate: float) -> None:
    time = np.delete(np.arange(500) / rate, sorted(lost))
    gaps = unusual_steps(time)
    missing = set((np.round(time[gaps - 1] * rate).astype(int) + 1).tolist())
    assert missing == {at for at in lost if at - 1 not in lost}


def test_rest_is_rest_whether_logged_or_not() -> None:
    """At first the logger slows down at rest, then it stops: the pauses are pauses in all three."""
    made = StaticTest(pause_s=8.0, cycles=4)
    time, stroke, force = made.columns()
    whole = evaluated(time, stroke, force, STATIC)
    rest = np.convolve(np.abs(np.gradient(stroke)) > 0.03, np.ones(21), mode="same") == 0
    for kept in (~rest | (np.arange(time.size) % 100 == 0), ~rest):
        assert np.count_nonzero(~kept) > 2000
        run = evaluated(time[kept], stroke[kept], force[kept], STATIC)
        assert [r.cycle.complete for r in run.cycles] == [True] * 4
        assert {r.id: r.verdict for r in run.requirements if r.condition} == {
            r.id: r.verdict for r in whole.requirements if r.condition
        }
        for one, other in zip(whole.cycles, run.cycles, strict=True):
            assert other.cycle.start_s == pytest.approx(one.cycle.start_s, abs=0.03)
            assert other.quantities.absorbed_energy_J == pytest.approx(
                one.quantities.absorbed_energy_J, rel=2e-4
            )


def by_event(
    columns: tuple[Floats, ...], step_mm: float, step_kN: float, beat_s: float = np.inf
) -> list[Floats]:
    """Return the rows of a logger that writes when either channel has changed by its step, or by a timer."""
    time, stroke, force = columns
    kept, x, f = [0], stroke[0], force[0]
    for at in range(1, time.size):
        due = time[at] - time[kept[-1]] > beat_s
        if due or abs(stroke[at] - x) >= step_mm or abs(force[at] - f) >= step_kN:
            kept.append(at)
            x, f = stroke[at], force[at]
    return [column[kept] for column in columns]


def test_a_record_by_event_keeps_its_cycles() -> None:
    made = StaticTest(pause_s=30.0, noise_mm=0.0, noise_kN=0.0, rate_Hz=1000.0)
    columns = made.columns()
    whole = evaluated(*columns, STATIC)
    time, stroke, force = by_event(columns, 0.2, 2.0)
    assert event_changes(time, stroke, force) is not None
    run = evaluated(time, stroke, force, STATIC)
    assert any("written by event" in w for w in run.warnings)
    assert [r.cycle.complete for r in run.cycles] == [True] * 3
    counts = [r.verdict for r in run.requirements if r.id == "cycle-count"]
    assert counts == ["pass"], "it has lost nothing in its pauses, however long they are"
    for one, other in zip(whole.cycles, run.cycles, strict=True):
        assert other.quantities.absorbed_energy_J == pytest.approx(one.quantities.absorbed_energy_J, rel=5e-3)


def test_what_an_event_logger_lost_is_found() -> None:
    made = StaticTest(pause_s=30.0, noise_mm=0.0, noise_kN=0.0, rate_Hz=1000.0)
    columns = by_event(made.columns(), 0.2, 2.0)
    kept = np.delete(np.arange(columns[0].size), slice(100, 200))
    jumps = make_record(*columns).breaks  # of the force, where the stroke is released
    record = make_record(*(column[kept] for column in columns))
    assert record.breaks == (100, *(at - 100 for at in jumps))


@pytest.mark.parametrize("beat_s", [1.0, 5.0])
def test_a_stroke_that_a_logger_with_a_timer_lost_may_have_happened(beat_s: float) -> None:
    """It would have written in a rest: that it did not is no rest, but rows that are lost."""
    made = StaticTest(pause_s=30.0, noise_mm=0.01, noise_kN=0.1, rate_Hz=100.0)
    time, stroke, force = by_event(made.columns(), 0.2, 2.0, beat_s)
    whole = evaluated(time, stroke, force, STATIC)
    assert whole.record.breaks == ()
    first = whole.cycles[0].cycle
    kept = (time < first.start_s - 0.5) | (time > first.end_s + 0.5)
    run = evaluated(time[kept], stroke[kept], force[kept], STATIC)
    (row,) = (r for r in run.requirements if r.id == "cycle-count")
    assert (row.verdict, row.measured) == ("inconclusive", 2.0)
    assert "may hide a stroke" in row.why


@pytest.mark.parametrize("seed", range(20))
def test_waits_that_noise_ends_are_no_timer(seed: int) -> None:
    """Some of many are alike by chance; longer ones beside them have lost nothing."""
    rng = np.random.default_rng(seed)
    step_s = np.full(2000, 0.02)
    waited = np.zeros(2000, dtype=bool)
    waited[:300] = True
    step_s[:300] = 0.02 * np.round(2.0 + rng.exponential(20.0, 300))
    events = EventChanges(np.where(waited, 0.1, 1.0), waited)
    assert silent_beyond_beat(np.append(0.0, np.cumsum(step_s)), events).size == 0


@pytest.mark.parametrize("columns", [WAVE.columns(1.0, 200.0, 8.0), StaticTest().columns()])
def test_even_records_are_not_by_event(columns: tuple[Floats, Floats, Floats]) -> None:
    assert event_changes(*columns) is None
    jitter = np.sort(columns[0] + np.random.default_rng(2).uniform(0.0, 0.004, columns[0].size))
    assert event_changes(jitter, *columns[1:]) is None


def test_doubled_rows_count_once() -> None:
    time, stroke, force = WAVE.columns(1.0, 200.0, 6.5)
    whole = evaluated(time, stroke, force)
    run = evaluated(*(np.repeat(column, 2) for column in (time, stroke, force)))
    assert any(f"{time.size} doubled rows, the first at 0 s" in w for w in run.warnings)
    same_figures(whole, run, 1e-12)
    again = [np.concatenate((column[:700], column[650:])) for column in (time, stroke, force)]
    run = evaluated(*again)
    assert any("50 doubled rows, the first at 3.25 s" in w for w in run.warnings)
    same_figures(whole, run, 1e-12)
    assert run.record.breaks == ()


@pytest.mark.parametrize("rate", [1000.0, 700.0, 333.0, 1234.5])
def test_rounded_stamps_are_spread_again(rate: float) -> None:
    time, stroke, force = WAVE.columns(1.0, rate, 8.4)
    stamps = np.round(time, 2)
    found = understand(stamps)
    assert found is not None
    assert found.clock_s == pytest.approx(0.01)
    off = found.time_s - time
    assert np.max(np.abs(off - np.median(off))) <= 0.005
    whole, run = evaluated(time, stroke, force), evaluated(stamps, stroke, force)
    assert any("stamps rounded to 0.01 s" in w for w in run.warnings)
    assert [r.cycle.complete for r in run.cycles] == [r.cycle.complete for r in whole.cycles]
    same_figures(whole, run, 2e-3)
    for one, other in zip(whole.cycles, run.cycles, strict=True):
        if one.cycle.complete:
            u = other.expanded_uncertainty["frequency_Hz"]
            assert u is not None
            assert u >= 0.9 * 2.0 * 0.005 * np.sqrt(2.0 / 3.0), "half a step of the clock at either end"
            assert abs(other.quantities.frequency_Hz - one.quantities.frequency_Hz) <= u  # type: ignore[operator]


def test_a_clock_that_stood_still_or_stumbled_is_not_coarse() -> None:
    time = np.arange(1000) * 0.01
    assert understand(time) is None
    stuck = time.copy()
    stuck[300:700] = stuck[300]
    assert understand(stuck) is None
    stumbled = time.copy()
    stumbled[300:400] -= 2.0
    assert understand(stumbled) is None


def test_a_clock_that_was_set_back_leaves_the_figures_and_not_the_count() -> None:
    made = StaticTest(pause_s=8.0, cycles=3)
    time, stroke, force = made.columns()
    whole = evaluated(time, stroke, force, STATIC)
    for back_s, at_s in ((3600.0, 47.0), (3600.0, 60.0), (30.0, 60.0)):
        at = int(np.searchsorted(time, at_s))
        set_back = np.where(np.arange(time.size) < at, time, time - back_s)
        run = evaluated(set_back, stroke, force, STATIC)
        assert any("the clock was set back 1 time(s)" in w for w in run.warnings)
        assert [r.verdict for r in run.requirements if r.id == "cycle-count"] == ["inconclusive"]
        paused = [r.verdict for r in run.requirements if r.id == "pause-limit"]
        assert paused == (["inconclusive", "pass"] if at_s == 47.0 else ["pass", "pass"])
        hit = [r.cycle.start_s < at_s < r.cycle.end_s for r in whole.cycles]
        assert [r.cycle.bounded for r in run.cycles] == [not own for own in hit]
        for one, other in zip(whole.cycles, run.cycles, strict=True):
            if other.cycle.bounded:
                assert other.quantities.absorbed_energy_J == pytest.approx(
                    one.quantities.absorbed_energy_J, rel=1e-4
                )


def test_nothing_to_bridge_costs_nothing() -> None:
    record = make_record(*WAVE.columns(1.0, 200.0, 4.0))
    assert bridged(record).record is record
