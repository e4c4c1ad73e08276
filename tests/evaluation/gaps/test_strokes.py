"""Strokes are numbered as they happened: a lost sample moves no limit from one stroke to another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.made_to_order import MadeTest, OneCycle, table
from tests.evaluation.signals import BUFFER, STARTED, STATED

FACTS = RunFacts("static-1", "static", specimen=dict(BUFFER), started=STARTED, **STATED)  # type: ignore[arg-type]
BAD_FIRST = MadeTest((OneCycle(loss=0.45), OneCycle(), OneCycle(), OneCycle()))
"""The first stroke absorbs less than the half that is asked of it, and more than is asked of later ones."""
GOOD = MadeTest((OneCycle(), OneCycle(loss=0.46), OneCycle(loss=0.46), OneCycle(loss=0.46)))
"""Later strokes absorb enough for later ones, and too little for a first one."""
Kept = NDArray[np.bool_]


def without(record: Record, lost: Kept) -> Record:
    """Return a record cleaned from the samples that are left."""
    return make_record(
        record.time_s[~lost],
        record.stroke_mm[~lost],
        record.force_kN[~lost],
        temperatures=record.temperatures,
    )


def judged(record: Record, **facts: Any) -> RunEvaluation:
    return evaluate_run(record, replace(FACTS, **facts), Options(draws=100))


def lost_from(record: Record, first_mm: float, last_mm: float, stroke: int) -> Kept:
    """Return the samples of a stroke's loading branch between two strokes."""
    time, x = record.time_s, record.stroke_mm
    tops = np.flatnonzero(np.diff((x > 50.0).astype(int)) == 1)
    about = tops[stroke - 1]
    start = about - int(np.argmax(x[:about][::-1] < 1.0))
    top = about + int(np.argmax(x[about:] > 101.0))
    lost = np.zeros(time.size, dtype=bool)
    lost[start:top] = (x[start:top] > first_mm) & (x[start:top] < last_mm)
    return lost


def one_lost(record: Record, at: int) -> Kept:
    lost = np.zeros(record.time_s.size, dtype=bool)
    lost[at] = True
    return lost


@pytest.mark.parametrize("test", [BAD_FIRST, GOOD])
def test_one_sample_lost_in_the_first_stroke_changes_no_verdict(test: MadeTest) -> None:
    record = test.record()
    whole = table(judged(record))
    assert whole["absorbed-energy-ratio", 1] == ("fail" if test is BAD_FIRST else "pass")
    for at in (150, 250, 352, 353, 355, 400, 500):
        assert table(judged(without(record, one_lost(record, at)))) == whole, at


@pytest.mark.parametrize("test", [BAD_FIRST, GOOD])
def test_a_first_stroke_that_cannot_be_evaluated_keeps_its_number(test: MadeTest) -> None:
    """Never a pass of the bad buffer, never a fail of the good one."""
    record = test.record()
    whole = table(judged(record))
    run = judged(without(record, lost_from(record, 20.0, 60.0, 1)))
    assert [r.cycle.complete for r in run.cycles] == [False, True, True, True]
    assert all(value is None for value in run.cycles[0].quantities[:-2])
    verdicts = table(run)
    assert verdicts["cycle-count", None] == "pass"
    assert verdicts.keys() == whole.keys()
    for (identity, cycle), verdict in verdicts.items():
        if cycle == 1 and identity != "temperature-range":
            assert verdict == "inconclusive", identity
        else:
            assert verdict == whole[identity, cycle], (identity, cycle)
    assert run.verdict == "inconclusive"
    (why,) = (r.why for r in run.requirements if (r.id, r.cycle) == ("absorbed-energy-ratio", 1))
    assert why.startswith("stroke 1 happened but is not evaluated: what is not on record")


def test_one_sample_lost_in_a_pause_changes_nothing() -> None:
    record = GOOD.record()
    whole = judged(record)
    at = int(np.argmin(np.abs(record.time_s - (whole.cycles[0].cycle.end_s + 1.0))))
    run = judged(without(record, one_lost(record, at)))
    assert table(run) == table(whole)
    for one, other in zip(whole.cycles, run.cycles, strict=True):
        # The level of a rest is a mean over its samples: one fewer moves it by a thousandth of their noise.
        assert other.quantities.absorbed_energy_J == pytest.approx(one.quantities.absorbed_energy_J, rel=1e-7)


def test_a_logger_that_stops_at_rest_has_lost_nothing() -> None:
    """Pauses of 3 s are shorter than a stroke of 10 s: none is hidden, and they are pauses as before."""
    record = GOOD.record()
    whole = judged(record)
    lost = np.zeros(record.time_s.size, dtype=bool)
    for before, after in zip(whole.cycles[:-1], whole.cycles[1:], strict=True):
        lost |= (record.time_s > before.cycle.end_s + 0.3) & (record.time_s < after.cycle.start_s - 0.3)
    assert np.count_nonzero(lost) > 300
    run = judged(without(record, lost))
    assert table(run) == table(whole)
    assert any(w.startswith("rest without samples") for w in run.warnings)
    pauses = [r.measured for r in run.requirements if r.id == "pause-limit"]
    assert pauses == pytest.approx(
        [r.measured for r in whole.requirements if r.id == "pause-limit"], abs=0.05
    )


def test_a_rest_longer_than_a_stroke_makes_the_count_inconclusive_and_leaves_the_figures() -> None:
    long = MadeTest(tuple(replace(cycle, pause_s=30.0) for cycle in GOOD.cycles))
    record = long.record()
    whole = judged(record)
    first, second = whole.cycles[0].cycle, whole.cycles[1].cycle
    lost = (record.time_s > first.end_s + 2.0) & (record.time_s < second.start_s - 2.0)
    run = judged(without(record, lost))
    verdicts = table(run)
    assert verdicts["cycle-count", None] == "inconclusive"
    assert verdicts["pause-limit", 2] == "pass"
    assert run.verdict == "inconclusive"
    assert [r.cycle.complete for r in run.cycles] == [True] * 4
    for one, other in zip(whole.cycles, run.cycles, strict=True):
        assert other.quantities.absorbed_energy_J == pytest.approx(one.quantities.absorbed_energy_J, rel=1e-5)
        assert other.quantities.stroke_max_mm == pytest.approx(one.quantities.stroke_max_mm, abs=1e-3)
    (why,) = (r.why for r in run.requirements if r.id == "cycle-count")
    assert "may hide a stroke" in why
    behind = (record.time_s > whole.cycles[3].cycle.end_s + 2.0) & (record.time_s < record.time_s[-1] - 2.0)
    assert table(judged(without(record, behind))) == table(whole), "no judged stroke is behind it"


@pytest.mark.parametrize(("share", "verdict"), [(0.95, "inconclusive"), (0.8, "pass")])
def test_a_hole_a_little_shorter_than_a_stroke_may_hide_one_too(share: float, verdict: str) -> None:
    """Strokes to one force are not of one length; one of eight tenths is none of the test."""
    stroke_s = min(result.cycle.duration_s for result in judged(GOOD.record()).cycles)
    record = MadeTest(tuple(replace(cycle, pause_s=30.0) for cycle in GOOD.cycles)).record()
    begins_s = judged(record).cycles[0].cycle.end_s + 2.0
    lost = (record.time_s > begins_s) & (record.time_s < begins_s + share * stroke_s)
    assert table(judged(without(record, lost)))["cycle-count", None] == verdict


def test_a_record_that_begins_while_the_stroke_falls_cannot_tell_which_stroke_is_the_first() -> None:
    """A first stroke of 0.46 fails as a first one and passes as a later one; 0.56 passes as either."""
    made = MadeTest((OneCycle(), OneCycle(loss=0.46), OneCycle(loss=0.46), OneCycle(loss=0.46)))
    record = made.record()
    fall_s = judged(record).cycles[0].cycle.top.time_s + 1.0
    begun = judged(without(record, record.time_s < fall_s))
    verdicts = table(begun)
    assert verdicts["absorbed-energy-ratio", 1] == "inconclusive"
    assert verdicts["absorbed-energy-ratio", 2] == "pass"
    assert begun.verdict == "inconclusive"
    assert any("which stroke cycle 1 was is not known" in w for w in begun.warnings)
    enough = MadeTest((OneCycle(),) * 4).record()
    begun = judged(without(enough, enough.time_s < fall_s))
    assert table(begun)["absorbed-energy-ratio", 1] == "pass"


def test_what_is_left_after_a_stroke_that_may_not_be_the_last_judged_breaks_nothing() -> None:
    """It is the fourth that happened and the third on record; release is asked for until after the third."""
    record = MadeTest((OneCycle(),) * 3 + (OneCycle(residual_mm=3.0), OneCycle())).record()
    whole = judged(record)
    assert table(whole)["full-release", 3] == "pass"
    begun = judged(without(record, record.time_s < whole.cycles[0].cycle.top.time_s + 1.0))
    (row,) = (r for r in begun.requirements if (r.id, r.cycle) == ("full-release", 3))
    assert (row.verdict, row.measured) == ("inconclusive", pytest.approx(3.0, abs=0.1))
    assert "that it is the last one judged is not known" in row.why


def test_a_record_that_ends_within_the_last_stroke_has_not_broken_the_count() -> None:
    record = MadeTest((OneCycle(),) * 3).record()
    cut_s = judged(record).cycles[2].cycle.top.time_s + 1.0
    run = judged(without(record, record.time_s > cut_s))
    verdicts = table(run)
    assert verdicts["cycle-count", None] == "inconclusive"
    assert verdicts["absorbed-energy-ratio", 3] == "inconclusive"
    two = MadeTest((OneCycle(),) * 2).record()
    assert table(judged(two))["cycle-count", None] == "fail"


def test_a_stroke_before_one_that_the_record_ends_in_is_not_the_last() -> None:
    """It is left 3 mm compressed: that breaks the next one's condition, of which nothing is on record."""
    record = MadeTest((OneCycle(residual_mm=3.0),) * 2).record()
    run = judged(record)
    assert table(run)["full-release", 2] == "fail"
    cut_s = run.cycles[1].cycle.top.time_s
    assert table(judged(without(record, record.time_s > cut_s)))["full-release", 1] == "pass"
