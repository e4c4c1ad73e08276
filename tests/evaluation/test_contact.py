"""First contact: found with preload and without, and what a wrong zero makes of verdicts and U."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluate_file
from bufferstand.evaluation.facts.document_types import Verdict
from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loops.first_contact import find_first_contact
from bufferstand.evaluation.record.interpolated_force import InterpolationLimits
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.requirements.contact_zero import beside
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.contacts import TIGHT, Approach
from tests.evaluation.signals import StaticTest

SAMPLE = Path(__file__).resolve().parents[2] / "sample_runs" / "runs" / "001-static-5mm_s.h5"
GOOD = Approach()


def some(count: int) -> list[Approach]:
    """Return tests of many kinds, drawn with a fixed seed."""
    random = np.random.default_rng(1)
    return [
        Approach(
            contact_mm=float(random.uniform(-5.0, 5.0)),
            preload_kN=float(random.choice([0.0, 0.5, 5.0, 10.0, 20.0, 50.0])),
            approach_mm=float(random.uniform(0.5, 8.0)),
            noise_kN=float(random.choice([0.01, 0.1, 0.5])),
            noise_mm=float(random.choice([0.002, 0.01, 0.05])),
            offset_kN=float(random.uniform(-2.0, 2.0)),
            friction_kN=float(random.choice([0.0, 0.3, 0.8])),
            rate_Hz=float(random.choice([20.0, 100.0, 400.0])),
            slope=float(random.uniform(1.0, 4.0)),
            seed=seed,
        )
        for seed in range(count)
    ]


def covered(tests: list[Approach]) -> float:
    """Return the share of tests in which the truth lies within U of what was found."""
    inside = 0
    for test in tests:
        found = test.found()
        assert found.stroke_mm is not None, test
        assert found.expanded_uncertainty is not None
        inside += abs(found.stroke_mm - test.contact_mm) <= found.expanded_uncertainty
    return inside / len(tests)


def test_the_contact_lies_within_its_u() -> None:
    assert covered(some(150)) >= 0.96


@pytest.mark.long
def test_the_contact_lies_within_its_u_in_many() -> None:
    assert covered(some(2000)) >= 0.975


@pytest.mark.parametrize("preload_kN", [5.0, 10.0, 20.0, 50.0])
@pytest.mark.parametrize("contact_mm", [0.0, 0.2, 1.5, 5.0, -3.0])
def test_a_preload_tells_the_place_sharply(preload_kN: float, contact_mm: float) -> None:
    found = replace(GOOD, preload_kN=preload_kN, contact_mm=contact_mm).found()
    assert found.how == "jump"
    assert found.stroke_mm == pytest.approx(contact_mm, abs=0.08)
    assert found.expanded_uncertainty is not None
    assert found.expanded_uncertainty < 0.15
    assert found.recorded_zero_offset_mm == -found.stroke_mm
    assert found.beyond == (abs(contact_mm) > 0.15)
    assert found.rest_force_kN == pytest.approx(0.1, abs=0.1)


def test_more_noise_never_makes_it_surer() -> None:
    """Tendency."""
    tests = [replace(GOOD, preload_kN=0.0, noise_kN=noise) for noise in (0.05, 0.2, 0.8)]
    us = [test.found().expanded_uncertainty for test in tests]
    assert us == sorted(us, key=lambda u: u or 0.0)


def test_a_record_that_begins_loaded_does_not_show_it() -> None:
    run = StaticTest().evaluate()
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm is None
    assert "begins loaded, with 15.0 kN" in run.first_contact.why
    assert any(w.startswith("no first contact: the record begins loaded") for w in run.warnings)
    assert run.verdict == "pass"
    late = GOOD.columns()[0] > 15.0
    record = make_record(*(column[late] for column in GOOD.columns()))
    assert find_first_contact(record, 22.0).stroke_mm is None


def test_the_shipped_static_run_begins_at_its_zero() -> None:
    run = evaluate_file(SAMPLE, Options(draws=0))
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm == pytest.approx(0.0, abs=0.1)
    assert not run.first_contact.beyond


@pytest.mark.parametrize("preload_kN", [8.0, 20.0])
def test_a_record_that_begins_with_the_motion_shows_it_in_the_next_stroke(preload_kN: float) -> None:
    test = replace(GOOD, contact_mm=3.0, approach_mm=0.1, preload_kN=preload_kN)
    record = test.record()
    begun = record.time_s > 1.01
    rest = make_record(record.time_s[begun], record.stroke_mm[begun], record.force_kN[begun])
    assert find_first_contact(rest, 22.0).stroke_mm is None
    run = evaluate_run(rest, RunFacts("static-1", "static", **TIGHT), Options(draws=0))  # type: ignore[arg-type]
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm == pytest.approx(3.0, abs=0.1)


def test_a_record_that_begins_in_contact_and_motion_does_not_show_it() -> None:
    time, stroke, force = replace(GOOD, preload_kN=20.0, slope=14.0, speed_mm_per_s=28.0).columns()
    begun = time > 1.0 + 6.5 / 28.0
    found = find_first_contact(make_record(time[begun], stroke[begun], force[begun]), 4.8, 0.05)
    assert found.stroke_mm is None


@pytest.mark.parametrize("preload_kN", [20.0, 0.0])
def test_a_later_stroke_shows_it_by_a_preload_only(preload_kN: float) -> None:
    """A specimen without one may not have come back to where it was."""
    test = replace(GOOD, contact_mm=3.0, preload_kN=preload_kN)
    turn_s = 1.0 + 2.0 * (102.0 + test.approach_mm) / test.speed_mm_per_s
    found = find_first_contact(test.record(), turn_s + 23.6, 0.05, turn_s + 0.1)
    assert (found.stroke_mm is not None) == (preload_kN > 0.0)


def test_a_drift_does_not_hide_the_contact() -> None:
    """The force falls far below the level of the first rest."""
    test = replace(GOOD, contact_mm=3.0, approach_mm=0.05, offset_kN=0.0)
    time, stroke, force = test.columns()
    drifting = make_record(time, stroke, force - 40.0 * time / time[-1])
    run = evaluate_run(drifting, RunFacts("static-1", "static", **TIGHT), Options(draws=0))  # type: ignore[arg-type]
    assert any(finding.kind == "drift" for finding in run.findings)
    assert run.first_contact is not None
    assert run.first_contact.beyond


@pytest.mark.parametrize(("offset_kN", "drift_kN"), [(12.0, 0.0), (-12.0, 0.0), (0.0, -40.0)])
def test_a_force_that_is_off_does_not_hide_the_contact(offset_kN: float, drift_kN: float) -> None:
    """It moves up to the contact at one force, whatever the cell makes of nothing."""
    time, stroke, force = replace(GOOD, contact_mm=3.0).columns()
    record = make_record(time, stroke, force + offset_kN + drift_kN * time / time[-1])
    found = find_first_contact(record, 22.6, 0.05)
    assert found.stroke_mm == pytest.approx(3.0, abs=0.1)
    assert found.beyond


def test_a_short_approach_shows_that_stroke_and_force_are_both_off() -> None:
    """0.4 mm before contact, in three samples: the specimen is released, and nothing on record says 0."""
    test = replace(GOOD, contact_mm=2.6, approach_mm=0.4, offset_kN=16.0, speed_mm_per_s=12.0, rate_Hz=87.0)
    run = test.evaluate()
    (zero,) = (finding for finding in run.findings if finding.kind == "zero")
    assert zero.size == pytest.approx(16.0, abs=0.3)
    assert run.first_contact is not None
    assert run.first_contact.beyond
    assert run.first_contact.stroke_mm == pytest.approx(2.6, abs=0.2)
    assert row(run, "full-release").verdict == "inconclusive"


@pytest.mark.parametrize("approach_mm", [1.0, 2.0])
def test_a_short_approach_shows_a_small_preload(approach_mm: float) -> None:
    """Half a per cent of the largest force, which guides may rub by, is half of it."""
    test = replace(GOOD, contact_mm=2.0, preload_kN=8.0, speed_mm_per_s=20.0, rate_Hz=80.0)
    found = replace(test, approach_mm=approach_mm).found()
    assert found.how == "jump"
    assert found.stroke_mm == pytest.approx(2.0, abs=0.2)
    assert found.beyond
    rubbing = replace(test, approach_mm=approach_mm, friction_kN=1.5).found()
    assert rubbing.stroke_mm is None or abs(rubbing.stroke_mm - 2.0) <= (rubbing.expanded_uncertainty or 0.0)


@pytest.mark.parametrize(("approach_mm", "begins_s"), [(0.05, 0.84), (1.6, 1.0)])
def test_a_rest_of_few_samples_is_seen_by_the_jump_behind_it(approach_mm: float, begins_s: float) -> None:
    """Nine samples before the motion, or six with which it begins."""
    test = replace(GOOD, contact_mm=-4.0, approach_mm=approach_mm, offset_kN=0.0, rate_Hz=60.0)
    time, stroke, force = replace(test, speed_mm_per_s=16.0, slope=4.0).columns()
    on = time > begins_s
    found = find_first_contact(make_record(time[on], stroke[on], force[on]), 7.2, 0.05)
    assert found.how == "jump"
    assert found.stroke_mm == pytest.approx(-4.0, abs=0.3)
    assert found.beyond


def test_a_jump_between_coarse_samples_is_no_rise() -> None:
    """The branch moves 1.4 mm between two samples, and by more force than noise."""
    test = replace(GOOD, contact_mm=3.0, approach_mm=0.05, speed_mm_per_s=28.0, rate_Hz=20.0, preload_kN=14.0)
    found = replace(test, slope=1.5, offset_kN=0.0).found()
    assert found.how == "jump"
    assert found.stroke_mm == pytest.approx(3.0, abs=1.5)
    assert found.beyond


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("approach_mm", [0.0, 0.2])
def test_a_preload_is_met_at_the_rest_itself_amid_noise(approach_mm: float, seed: int) -> None:
    """0.45 mm from sample to sample, noise of 0.1 mm and 0.5 kN, and guides that may rub by 3 kN."""
    noisy = replace(GOOD, noise_kN=0.5, noise_mm=0.09, offset_kN=0.0, speed_mm_per_s=22.7, rate_Hz=50.0)
    stiff = replace(noisy, contact_mm=1.7, approach_mm=approach_mm, frame_kN_per_mm=65.0, seed=seed)
    found = replace(stiff, preload_kN=13.0).found()
    assert (found.how, found.beyond) == ("jump", True)
    assert found.stroke_mm == pytest.approx(1.7, abs=found.expanded_uncertainty)
    assert not replace(stiff, preload_kN=13.0, contact_mm=0.0).found().beyond
    assert replace(stiff, preload_kN=0.0, slope=8.0).found().how == "rise"


def test_an_approach_of_six_samples_shows_a_small_preload_amid_noise() -> None:
    """Guides may rub by half of the preload, and noise hides as much in each sample."""
    noisy = replace(GOOD, noise_kN=0.4, noise_mm=0.004, offset_kN=0.0, speed_mm_per_s=10.6, rate_Hz=59.5)
    found = replace(noisy, contact_mm=2.75, approach_mm=1.0, preload_kN=7.0, slope=2.2).found()
    assert (found.how, found.beyond) == ("jump", True)
    assert found.stroke_mm == pytest.approx(2.75, abs=found.expanded_uncertainty)


def test_a_force_that_is_interpolated_does_not_show_where_it_leaps() -> None:
    record = replace(GOOD, contact_mm=3.0).record()
    halved = np.zeros((2, record.time_s.size))
    blurred = replace(record, between=InterpolationLimits(0.1, record.time_s, halved))
    sharp, wide = (find_first_contact(one, 22.6, 0.05) for one in (record, blurred))
    assert sharp.expanded_uncertainty is not None
    assert wide.expanded_uncertainty is not None
    assert wide.expanded_uncertainty > 0.3 + sharp.expanded_uncertainty
    assert abs((wide.stroke_mm or 0.0) - 3.0) < wide.expanded_uncertainty


def test_a_force_of_the_other_sign_shows_the_contact() -> None:
    time, stroke, force = replace(GOOD, contact_mm=3.0).columns()
    run = evaluate_run(
        make_record(time, stroke, -force),
        RunFacts("static-1", "static", **TIGHT),  # type: ignore[arg-type]
        Options(draws=0),
    )
    assert any(finding.kind == "sign" for finding in run.findings)
    assert run.first_contact is not None
    assert run.first_contact.stroke_mm == pytest.approx(3.0, abs=0.1)
    assert run.first_contact.rest_force_kN == pytest.approx(-0.1, abs=0.1)


def test_a_preload_that_rests_on_the_cell_is_no_short_approach() -> None:
    """It begins at contact, or with half its preload along the frame's compliance."""
    for offset_mm in (0.06, 0.2):
        run = replace(GOOD, approach_mm=-offset_mm, rate_Hz=400.0).evaluate()
        assert not any(finding.kind == "zero" for finding in run.findings)


def row(run: RunEvaluation, identity: str, cycle: int = 1) -> RequirementResult:
    return next(r for r in run.requirements if (r.id, r.cycle) == (identity, cycle))


def test_a_right_zero_changes_nothing() -> None:
    run = GOOD.evaluate()
    assert run.verdict == "pass"
    assert run.first_contact is not None
    assert not run.first_contact.beyond
    assert not any("first contact" in r.why for r in run.requirements)


def test_a_wrong_zero_is_named_and_in_u() -> None:
    right, run = GOOD.evaluate(), replace(GOOD, contact_mm=1.5).evaluate()
    assert run.verdict == "pass"
    for identity in ("preload", "force-at-25mm", "force-at-60mm", "force-at-100mm"):
        read, true = row(run, identity), row(right, identity)
        assert read.measured is not None
        assert true.measured is not None
        assert read.expanded_uncertainty is not None
        assert abs(read.measured - true.measured) < read.expanded_uncertainty
        assert "counted from first contact" in read.why
    for identity in ("stored-energy", "absorbed-energy-ratio"):
        assert row(run, identity).measured == pytest.approx(row(right, identity).measured, rel=2e-3)
        assert "first contact" not in row(run, identity).why
    (said,) = [w for w in run.warnings if "stroke zero" in w]
    assert said.startswith(
        "first contact at 1.52 ± 0.05 mm of the recorded stroke: the stroke zero lies 1.52"
    )
    assert "preload reads 15.92 instead of 19.85 kN" in said


def test_without_stated_errors_u_is_what_the_zero_makes() -> None:
    right, run = GOOD.evaluate(), replace(GOOD, contact_mm=3.0).evaluate(stated=False)
    read, true = row(run, "force-at-60mm"), row(right, "force-at-60mm")
    assert read.measured is not None
    assert true.measured is not None
    assert read.expanded_uncertainty is not None
    assert abs(read.measured - true.measured) < 1.1 * read.expanded_uncertainty
    assert "U is what the zero makes of it, and no more" in read.why
    assert row(run, "absorbed-energy-ratio").expanded_uncertainty is None
    assert row(run, "full-release").expanded_uncertainty is None


# From the recorded zero the verdict would be a false one.
NEAR = {
    "false fail": replace(GOOD, preload_kN=11.4, contact_mm=1.5),
    "false pass": replace(GOOD, preload_kN=8.0, contact_mm=-1.5),
}


@pytest.mark.parametrize("name", NEAR)
def test_a_verdict_that_hangs_on_the_zero_is_none(name: str) -> None:
    run = NEAR[name].evaluate()
    assert {r.verdict for r in run.requirements if r.id == "preload"} == {"inconclusive"}
    assert "from first contact: the stroke zero is off" in row(run, "preload").why
    assert row(run, "preload").conformance_probability is None
    assert run.verdict == "inconclusive"


def test_a_specimen_that_rests_behind_the_zero_is_released() -> None:
    """It stands at 3 mm of the recorded stroke before each cycle, and is 2 mm away from contact there."""
    run = replace(GOOD, approach_mm=2.0, contact_mm=5.0).evaluate()
    assert {r.verdict for r in run.requirements if r.id == "full-release"} == {"inconclusive"}
    assert "invalid" not in {r.verdict for r in run.requirements}
    assert run.verdict == "inconclusive"


def test_a_row_that_is_read_from_a_spoiled_channel_keeps_no_u() -> None:
    base = replace(row(GOOD.evaluate(), "preload"), verdict="inconclusive", expanded_uncertainty=None)
    (found,) = beside([base], [replace(base, measured=1.0)])
    assert found.expanded_uncertainty is None


def test_rows_joined() -> None:
    base = row(GOOD.evaluate(), "preload")
    assert beside([base], [base]) == [base]
    cases: list[tuple[Verdict, Verdict, Verdict]] = [
        ("pass", "conditional-pass", "conditional-pass"),
        ("conditional-fail", "fail", "conditional-fail"),
        ("pass", "fail", "inconclusive"),
        ("fail", "pass", "inconclusive"),
        ("invalid", "pass", "inconclusive"),
        ("not-tested", "pass", "inconclusive"),
        ("fail", "fail", "fail"),
    ]
    for one, two, joined in cases:
        (found,) = beside([replace(base, verdict=one)], [replace(base, verdict=two, measured=1.0)])
        assert found.verdict == joined


def test_a_stroke_that_is_held_on_its_way_to_contact_tells_nothing() -> None:
    """Its samples before the force rises are all at one place: there is no slope of the force over them."""
    time = np.arange(0.0, 12.0, 0.01)
    stroke = np.interp(time, [1.0, 11.0], [-2.0, 98.0])
    held = np.round(stroke / 6.0) * 6.0
    force = 30.0 + np.where(stroke > 8.0, 20.0 + 4.0 * (stroke - 8.0), 0.0)
    force = force + 0.05 * np.random.default_rng(1).standard_normal(time.size)
    assert find_first_contact(make_record(time, held, force), 11.0).stroke_mm is None
