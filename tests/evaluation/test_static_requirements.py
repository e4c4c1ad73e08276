"""A static test that meets everything, and records that each break exactly one requirement or condition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.facts.document_types import Verdict
from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.requirements.limit_set import shipped_limit_set
from tests.evaluation.signals import BUFFER, StaticTest, later

GOOD = StaticTest()
FORCES = ("preload", "force-at-25mm", "force-at-60mm", "force-at-100mm")
REQUIREMENTS = (*FORCES, "stored-energy", "absorbed-energy-ratio")
CYCLE_CONDITIONS = ("temperature-range", "speed-limit", "immediate-unloading", "full-release", "full-stroke")


def by_id(run: RunEvaluation, identity: str) -> list[RequirementResult]:
    return [r for r in run.requirements if r.id == identity]


def verdicts(run: RunEvaluation, identity: str) -> list[Verdict]:
    return [r.verdict for r in by_id(run, identity)]


GOOD_RUN = GOOD.evaluate()


def test_good_test_passes_everything() -> None:
    assert {r.verdict for r in GOOD_RUN.requirements} == {"pass"}
    assert GOOD_RUN.verdict == "pass"
    # nothing is wrong; what has no value or no uncertainty by its nature says so
    assert [text for text in GOOD_RUN.warnings if not text.startswith("no ")] == []
    assert len(GOOD_RUN.warnings) == 5


def test_rows_of_a_good_test() -> None:
    for identity in (*REQUIREMENTS, *CYCLE_CONDITIONS):
        assert [r.cycle for r in by_id(GOOD_RUN, identity)] == [1, 2, 3]
    assert [r.cycle for r in by_id(GOOD_RUN, "pause-limit")] == [2, 3]
    for identity in ("cycle-count", "rest-after-assembly"):
        assert [r.cycle for r in by_id(GOOD_RUN, identity)] == [None]
    for row in GOOD_RUN.requirements:
        assert row.standard == "EN 15551"
        # no text of the standard was at hand: the paper that quotes it is the source, and no clause
        assert row.edition is None
        assert row.clause is None
        assert "paper “Stiffness characteristics of railway buffers”, " in row.source
        assert row.why
        assert row.condition == (row.id not in REQUIREMENTS)
        if row.id in REQUIREMENTS:
            assert row.measured is not None
            assert row.expanded_uncertainty is not None
            assert row.expanded_uncertainty > 0.0
            assert row.conformance_probability is not None


def test_measured_values() -> None:
    branch = {stroke: 15.0 + 2.0 * stroke + 3.8e-6 * stroke**4 for stroke in (25.0, 60.0, 100.0)}
    stored = 15.0 * 102.0 + 102.0**2 + 3.8e-6 * 102.0**5 / 5.0
    for number in range(3):
        for stroke, force in branch.items():
            row = by_id(GOOD_RUN, f"force-at-{stroke:.0f}mm")[number]
            assert row.measured == pytest.approx(force, rel=2e-3)
            assert (row.unit, row.lower_limit is not None) == ("kN", True)
        assert by_id(GOOD_RUN, "preload")[number].measured == pytest.approx(15.0, abs=0.1)
        assert by_id(GOOD_RUN, "stored-energy")[number].measured == pytest.approx(stored, rel=1e-3)
        assert by_id(GOOD_RUN, "stored-energy")[number].unit == "J"
        ratio = by_id(GOOD_RUN, "absorbed-energy-ratio")[number]
        assert ratio.measured == pytest.approx(GOOD_RUN.cycles[number].quantities.damping)
        assert ratio.lower_limit == (0.5, 0.42, 0.42)[number]


# What is changed, and which requirement alone fails then, in which cycles.
BROKEN_REQUIREMENTS: dict[str, tuple[StaticTest, str, list[Verdict]]] = {
    "preload too small": (replace(GOOD, preload_kN=8.0), "preload", ["fail"] * 3),
    "preload too large": (replace(GOOD, preload_kN=55.0, cubic=3.2e-6), "preload", ["fail"] * 3),
    "too soft at the end": (replace(GOOD, cubic=1.2e-6), "force-at-100mm", ["fail"] * 3),
    "too little absorbed in the first": (
        replace(GOOD, loss=0.47),
        "absorbed-energy-ratio",
        ["fail", "pass", "pass"],
    ),
    "too little absorbed": (replace(GOOD, loss=0.41), "absorbed-energy-ratio", ["fail"] * 3),
}


@pytest.mark.parametrize("name", BROKEN_REQUIREMENTS)
def test_one_requirement_fails(name: str) -> None:
    test, identity, expected = BROKEN_REQUIREMENTS[name]
    run = test.evaluate()
    assert verdicts(run, identity) == expected
    others = {r.id for r in run.requirements if r.verdict != "pass"} - {identity}
    assert others == set()
    assert run.verdict == "fail"


def shaped(run_test: StaticTest, points: list[tuple[float, float]]) -> RunEvaluation:
    """Evaluate a test whose loading branch goes through given points."""
    from bufferstand.evaluation.facts.run_facts import Options
    from bufferstand.evaluation.record.record import make_record
    from bufferstand.evaluation.run.evaluate import evaluate_run

    time, stroke, force = replace(run_test, noise_mm=0.0, noise_kN=0.0).columns()
    old = 15.0 + 2.0 * stroke + 3.8e-6 * stroke**4
    knots = np.array(points)
    new = np.interp(stroke, knots[:, 0], knots[:, 1])
    record = make_record(time, stroke, force / old * new, temperatures=run_test.record().temperatures)
    return evaluate_run(record, run_test.facts(), Options(draws=200))


@pytest.mark.parametrize(
    ("identity", "points"),
    [
        ("force-at-25mm", [(0, 15), (18, 20), (32, 32), (60, 150), (102, 700)]),
        ("force-at-25mm", [(0, 15), (18, 130), (32, 140), (60, 150), (102, 700)]),
        ("force-at-60mm", [(0, 15), (25, 60), (55, 80), (65, 95), (102, 700)]),
        ("force-at-60mm", [(0, 15), (25, 60), (55, 410), (65, 420), (102, 700)]),
        ("stored-energy", [(0, 12), (25, 40), (60, 105), (85, 200), (102, 370)]),
    ],
)
def test_window_in_the_middle(identity: str, points: list[tuple[float, float]]) -> None:
    run = shaped(GOOD, points)
    assert verdicts(run, identity) == ["fail"] * 3
    assert {r.id for r in run.requirements if r.verdict == "fail"} == {identity}
    assert run.verdict == "fail"


# What is changed, which condition is broken in which cycles, and in which cycles the results are invalid.
BROKEN_CONDITIONS: dict[str, tuple[StaticTest, str, list[int | None], set[int]]] = {
    "too cold": (replace(GOOD, temperature_C=14.0), "temperature-range", [1, 2, 3], {1, 2, 3}),
    "too warm": (replace(GOOD, temperature_C=26.0), "temperature-range", [1, 2, 3], {1, 2, 3}),
    "warms up": (replace(GOOD, temperature_C=22.0, temperature_rise_C=4.0), "temperature-range", [3], {3}),
    "loaded too fast": (
        replace(GOOD, speed_mm_per_s=52.0, rate_Hz=500.0, unloading_speed_mm_per_s=20.0),
        "speed-limit",
        [1, 2, 3],
        {1, 2, 3},
    ),
    "unloaded too fast": (
        replace(GOOD, unloading_speed_mm_per_s=55.0, rate_Hz=500.0),
        "speed-limit",
        [1, 2, 3],
        {1, 2, 3},
    ),
    "two cycles": (replace(GOOD, cycles=2), "cycle-count", [None], {1, 2}),
    "long pauses": (replace(GOOD, pause_s=610.0, rate_Hz=20.0), "pause-limit", [2, 3], {2, 3}),
    "fresh from assembly": (replace(GOOD, started=later(71.0)), "rest-after-assembly", [None], {1, 2, 3}),
    "held at the top": (replace(GOOD, dwell_s=5.0), "immediate-unloading", [1, 2, 3], {1, 2, 3}),
    "not released": (replace(GOOD, residual_mm=4.0), "full-release", [2, 3], {2, 3}),
}


@pytest.mark.parametrize("name", BROKEN_CONDITIONS)
def test_one_condition_is_broken(name: str) -> None:
    test, identity, where, governed = BROKEN_CONDITIONS[name]
    run = test.evaluate()
    assert [r.cycle for r in by_id(run, identity) if r.verdict == "fail"] == where
    broken = {r.id for r in run.requirements if r.condition and r.verdict != "pass"}
    assert broken == {identity}
    for row in run.requirements:
        if row.id in REQUIREMENTS:
            assert row.verdict == ("invalid" if row.cycle in governed else "pass"), row
            assert (identity in row.why) == (row.cycle in governed)
    assert run.verdict == "invalid"


UNSHOWN: dict[str, tuple[StaticTest, str]] = {
    "no temperature": (replace(GOOD, temperature_C=None), "temperature-range"),
    "no assembly date": (replace(GOOD, specimen={**BUFFER, "assembled": None}), "rest-after-assembly"),
    "no start": (replace(GOOD, started=None), "rest-after-assembly"),
    "no elastic system": (replace(GOOD, specimen={**BUFFER, "elastic_system": None}), "rest-after-assembly"),
}


@pytest.mark.parametrize("name", UNSHOWN)
def test_condition_that_the_record_cannot_show(name: str) -> None:
    test, identity = UNSHOWN[name]
    run = test.evaluate()
    assert set(verdicts(run, identity)) == {"inconclusive"}
    assert all(r.measured is None for r in by_id(run, identity))
    for row in run.requirements:
        if row.id in REQUIREMENTS:
            assert row.verdict == "inconclusive"
            assert identity in row.why
    assert run.verdict == "inconclusive"


def test_failure_behind_an_unshown_condition_is_inconclusive() -> None:
    run = replace(GOOD, temperature_C=None, preload_kN=8.0).evaluate()
    assert set(verdicts(run, "preload")) == {"inconclusive"}
    assert run.verdict == "inconclusive"


def test_rest_is_no_matter_for_ring_springs() -> None:
    run = replace(GOOD, specimen={**BUFFER, "elastic_system": "ring-spring", "assembled": None}).evaluate()
    assert by_id(run, "rest-after-assembly") == []
    assert run.verdict == "pass"


@pytest.mark.parametrize("hours", [72.0, 100.0])
def test_rest_of_72_hours_is_enough(hours: float) -> None:
    run = replace(GOOD, started=later(hours)).evaluate()
    assert verdicts(run, "rest-after-assembly") == ["pass"]
    assert by_id(run, "rest-after-assembly")[0].measured == pytest.approx(hours)


STOPS_SHORT = replace(GOOD, top_mm=94.0, cubic=5.0e-6)


def test_record_that_stops_short() -> None:
    run = STOPS_SHORT.evaluate()
    assert verdicts(run, "full-stroke") == ["inconclusive"] * 3
    assert verdicts(run, "force-at-100mm") == ["not-tested"] * 3
    assert verdicts(run, "absorbed-energy-ratio") == ["inconclusive"] * 3
    assert verdicts(run, "stored-energy") == ["pass"] * 3
    for identity in ("preload", "force-at-25mm", "force-at-60mm"):
        assert verdicts(run, identity) == ["pass"] * 3
    assert run.verdict == "inconclusive"
    assert by_id(run, "absorbed-energy-ratio")[0].measured is not None


def test_record_that_stops_short_of_the_energy() -> None:
    run = replace(GOOD, top_mm=70.0).evaluate()
    assert verdicts(run, "stored-energy") == ["inconclusive"] * 3
    assert verdicts(run, "force-at-60mm") == ["pass"] * 3
    assert run.verdict == "inconclusive"


def test_fail_outranks_inconclusive_in_a_short_record() -> None:
    run = replace(STOPS_SHORT, preload_kN=8.0).evaluate()
    assert run.verdict == "fail"


def test_stroke_within_the_tolerance_of_a_legal_buffer_is_full() -> None:
    run = replace(GOOD, top_mm=100.0, specimen={**BUFFER, "max_stroke_mm": 100.0}).evaluate()
    assert verdicts(run, "full-stroke") == ["pass"] * 3
    assert verdicts(run, "force-at-100mm") == ["pass"] * 3


def test_energy_counts_up_to_the_force_cap() -> None:
    stiff = replace(GOOD, cubic=1.2e-5, noise_kN=0.0, noise_mm=0.0)
    run = stiff.evaluate()
    cut = 0.0
    for stroke in np.arange(80.0, 102.0, 1e-3):
        if 15.0 + 2.0 * stroke + 1.2e-5 * stroke**4 >= 1000.0:
            cut = float(stroke)
            break
    stored = 15.0 * cut + cut**2 + 1.2e-5 * cut**5 / 5.0
    row = by_id(run, "stored-energy")[0]
    assert row.measured == pytest.approx(stored, rel=1e-3)
    assert "counted to 9" in row.why
    assert (run.cycles[0].quantities.stored_energy_J or 0.0) > stored
    assert verdicts(run, "force-at-100mm") == ["fail"] * 3
    ratio = by_id(run, "absorbed-energy-ratio")[0].measured
    assert ratio is not None
    assert 0.4 < ratio < 0.56


def test_reading_of_the_preload_is_an_option() -> None:
    curved = replace(GOOD, noise_kN=0.0, noise_mm=0.0)
    line = curved.evaluate()
    point = curved.evaluate(preload_reading="at-0.5mm")
    assert by_id(line, "preload")[0].measured == pytest.approx(15.0, abs=0.05)
    assert by_id(point, "preload")[0].measured == pytest.approx(16.0, abs=0.05)
    assert "16.0 kN at 0.5 mm" in by_id(line, "preload")[0].why
    assert "15.0 kN extrapolated" in by_id(point, "preload")[0].why


def test_guard_band_gives_conditional_verdicts() -> None:
    """Damping 0.507 against 0.50 with U of 0.007: simple acceptance passes, the guard band hesitates."""
    near = replace(GOOD, loss=0.517)
    simple, guarded = near.evaluate(), near.evaluate(decision_rule="guard-band")
    row = by_id(simple, "absorbed-energy-ratio")[0]
    assert row.measured is not None
    assert row.expanded_uncertainty is not None
    assert 0.5 < row.measured < 0.5 + row.expanded_uncertainty
    assert row.verdict == "pass"
    assert row.conformance_probability is not None
    assert 0.5 < row.conformance_probability < 0.98
    assert by_id(guarded, "absorbed-energy-ratio")[0].verdict == "conditional-pass"
    assert guarded.verdict == "conditional-pass"
    below = replace(GOOD, loss=0.5145).evaluate(decision_rule="guard-band")
    assert by_id(below, "absorbed-energy-ratio")[0].verdict == "conditional-fail"
    assert below.verdict == "conditional-fail"


def test_without_stated_uncertainty() -> None:
    run = replace(GOOD, stated=False).evaluate()
    assert run.verdict == "pass"
    for row in run.requirements:
        if row.id in REQUIREMENTS:
            assert row.expanded_uncertainty is None
            assert row.conformance_probability is None
    assert any("no expanded uncertainties" in w for w in run.warnings)
    guarded = replace(GOOD, stated=False).evaluate(decision_rule="guard-band")
    assert guarded.verdict == "inconclusive"


def test_specimen_that_the_limits_are_not_for() -> None:
    hook = replace(GOOD, specimen={"id": "H", "kind": "draw-gear"}).evaluate()
    assert hook.requirements == ()
    assert hook.verdict is None
    assert any("the specimen is a draw-gear" in w for w in hook.warnings)
    long = replace(GOOD, specimen={**BUFFER, "max_stroke_mm": 150.0}).evaluate()
    assert long.requirements == ()
    assert any("the specimen has 150 mm" in w for w in long.warnings)


def test_specimen_of_unknown_stroke_is_judged_with_a_warning() -> None:
    run = replace(GOOD, specimen={"id": "?"}).evaluate()
    assert run.requirements
    assert any("kind and max_stroke_mm is not on record" in w for w in run.warnings)


def test_other_limits() -> None:
    limits = shipped_limit_set()
    stricter = limits.model_copy(
        update={"energy": limits.energy.model_copy(update={"stored_min_J": 30000.0})}
    )
    assert stricter.sha256 != limits.sha256
    from bufferstand.evaluation.facts.run_facts import Options
    from bufferstand.evaluation.run.evaluate import evaluate_run

    run = evaluate_run(GOOD.record(), GOOD.facts(), Options(draws=100), stricter)
    assert verdicts(run, "stored-energy") == ["fail"] * 3
    assert run.limit_set is not None
    assert run.limit_set["sha256"] == stricter.sha256


def test_fourth_cycle_is_not_judged() -> None:
    run = replace(GOOD, cycles=4).evaluate()
    assert run.verdict == "pass"
    assert {r.cycle for r in run.requirements} == {None, 1, 2, 3}
    assert "first 3 are judged" in by_id(run, "cycle-count")[0].why


def test_no_cycle_at_all() -> None:
    run = replace(GOOD, cycles=0).evaluate()
    assert run.verdict == "invalid"
    assert verdicts(run, "cycle-count") == ["fail"]
