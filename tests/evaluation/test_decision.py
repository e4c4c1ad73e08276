"""Decision rules and the verdict of a run."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.facts import DecisionRule
from bufferstand.evaluation.facts.document_types import Verdict
from bufferstand.evaluation.facts.results import RequirementResult
from bufferstand.evaluation.requirements.decision import (
    conformance_probability,
    decide,
    govern,
    run_verdict,
)


def result(verdict: Verdict, *, condition: bool = False, identity: str = "x") -> RequirementResult:
    return RequirementResult(
        "EN 15551", "2022", identity, 1, "…", 1.0, 0.1, 0.0, 2.0, "kN", 1.0, verdict, "why", condition
    )


def test_jcgm_106_example() -> None:
    assert conformance_probability(13.6, 1.8, 12.5, 16.3) == pytest.approx(0.6626, abs=5e-5)


def test_one_sided_limits() -> None:
    assert conformance_probability(10.0, 1.0, 10.0) == pytest.approx(0.5)
    assert conformance_probability(12.0, 1.0, 10.0) == pytest.approx(0.97725, abs=1e-5)
    assert conformance_probability(12.0, 1.0, None, 10.0) == pytest.approx(0.02275, abs=1e-5)
    assert conformance_probability(3.0, 0.0, 2.0, 4.0) == 1.0
    assert conformance_probability(5.0, 0.0, 2.0, 4.0) == 0.0


@given(st.floats(-10, 10), st.floats(0.01, 5), st.floats(-5, 0), st.floats(0, 5))
def test_probability_is_one_of_three_that_add_up(value: float, u: float, low: float, high: float) -> None:
    inside = conformance_probability(value, u, low, high)
    below = conformance_probability(value, u, None, low)
    above = conformance_probability(value, u, high, None)
    assert 0.0 <= inside <= 1.0
    assert inside + below + above == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("value", "simple", "guarded"),
    [
        (9.0, "fail", "fail"),
        (9.6, "fail", "conditional-fail"),
        (10.2, "pass", "conditional-pass"),
        (10.5, "pass", "pass"),
        (15.0, "pass", "pass"),
        (19.9, "pass", "conditional-pass"),
        (20.2, "fail", "conditional-fail"),
        (20.6, "fail", "fail"),
    ],
)
def test_rules(value: float, simple: Verdict, guarded: Verdict) -> None:
    assert decide(value, 0.5, 10.0, 20.0, "simple")[0] == simple
    assert decide(value, 0.5, 10.0, 20.0, "guard-band")[0] == guarded


def test_without_uncertainty() -> None:
    assert decide(15.0, None, 10.0, 20.0, "simple")[0] == "pass"
    verdict, why = decide(15.0, None, 10.0, 20.0, "guard-band")
    assert verdict == "inconclusive"
    assert "uncertainty" in why


def test_guard_band_never_passes_what_simple_fails() -> None:
    for tenth in range(80, 230):
        value = tenth / 10.0
        if decide(value, 0.7, 10.0, 20.0, "guard-band")[0] == "pass":
            assert decide(value, 0.7, 10.0, 20.0, "simple")[0] == "pass"


def test_conditions_govern() -> None:
    broken = result("fail", condition=True, identity="speed-limit")
    unshown = result("inconclusive", condition=True, identity="temperature-range")
    met = result("pass", condition=True)
    assert govern(result("pass"), [met]).verdict == "pass"
    invalid = govern(result("fail"), [unshown, broken])
    assert invalid.verdict == "invalid"
    assert "speed-limit" in invalid.why
    unclear = govern(result("fail"), [unshown, met])
    assert unclear.verdict == "inconclusive"
    assert "temperature-range" in unclear.why
    assert govern(result("not-tested"), [broken]).verdict == "not-tested"


@pytest.mark.parametrize(
    ("verdicts", "expected"),
    [
        ([], None),
        (["pass", "pass"], "pass"),
        (["pass", "conditional-pass"], "conditional-pass"),
        (["conditional-fail", "conditional-pass"], "conditional-fail"),
        (["pass", "not-tested"], "inconclusive"),
        (["conditional-fail", "inconclusive"], "inconclusive"),
        (["fail", "inconclusive", "not-tested"], "fail"),
        (["fail", "invalid"], "invalid"),
    ],
)
def test_run_verdict(verdicts: list[Verdict], expected: Verdict | None) -> None:
    assert run_verdict([result(v) for v in verdicts]) == expected


def test_broken_condition_makes_the_run_invalid() -> None:
    assert run_verdict([result("fail", condition=True), result("fail")]) == "invalid"


@pytest.mark.parametrize("rule", ["simple", "guard-band"])
def test_a_limit_itself_is_within_unless_more_than_it_is_asked_for(rule: DecisionRule) -> None:
    exact = {"expanded": 0.0, "lower": 10.0, "upper": 20.0, "rule": rule}
    assert decide(10.0, **exact)[0] == "pass"
    assert decide(20.0, **exact)[0] == "pass"
    assert decide(math.nextafter(10.0, 0.0), **exact)[0] == "fail"
    assert decide(math.nextafter(20.0, 30.0), **exact)[0] == "fail"
    assert decide(20.0, **exact, beyond=True)[0] == "pass"
    assert decide(math.nextafter(10.0, 20.0), **exact, beyond=True)[0] == "pass"


def test_where_more_than_the_limit_is_asked_for_the_limit_itself_is_not_enough() -> None:
    assert decide(10.0, None, 10.0, 20.0, "simple", beyond=True) == ("fail", "outside the limits")
    assert decide(10.0, None, 10.0, None, "simple", beyond=True)[0] == "fail"
    assert decide(10.0, 0.5, 10.0, 20.0, "guard-band", beyond=True)[0] == "conditional-fail"
    assert decide(10.0, 0.5, 10.0, 20.0, "guard-band")[0] == "conditional-pass"


def test_a_side_without_a_limit_bounds_nothing() -> None:
    for rule in ("simple", "guard-band"):
        assert decide(-1e9, 0.5, None, 20.0, rule)[0] == "pass"
        assert decide(1e9, 0.5, 10.0, None, rule)[0] == "pass"
        assert decide(0.0, 0.5, None, None, rule)[0] == "pass"


def test_an_exact_value_is_within_the_limits_for_sure_or_for_sure_not() -> None:
    assert conformance_probability(2.0, 0.0, 2.0, 4.0) == 1.0
    assert conformance_probability(4.0, 0.0, 2.0, 4.0) == 1.0
    assert conformance_probability(1.9, 0.0, 2.0, None) == 0.0
    assert conformance_probability(4.1, 0.0, None, 4.0) == 0.0
    assert conformance_probability(0.5, 0.5, 0.5, 1.0) == pytest.approx(0.34134, abs=1e-5)
