"""From a value with uncertainty and its limits to a verdict, and from verdicts to that of the run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from bufferstand.evaluation.facts import DecisionRule, RequirementResult, Verdict


def conformance_probability(
    value: float, u: float, lower: float | None = None, upper: float | None = None
) -> float:
    """Return the probability that the true value lies within the limits, for a normal error.

    Parameters
    ----------
    value, u : float
        Measured value and its standard uncertainty, same unit.
    lower, upper : float or None
        Limits; None where there is none. Both tails count.

    Returns
    -------
    float
        0 to 1 (JCGM 106:2012, 7.4: value 13.6, u 1.8, limits 12.5 and 16.3 give 0.66).
    """
    if u <= 0.0:
        return float(_within(value, lower, upper))
    below_upper = 1.0 if upper is None else _normal((upper - value) / u)
    below_lower = 0.0 if lower is None else _normal((lower - value) / u)
    return below_upper - below_lower


def _normal(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def _within(value: float, lower: float | None, upper: float | None, *, beyond: bool = False) -> bool:
    least = lower is None or value > lower or (value == lower and not beyond)
    return least and (upper is None or value <= upper)


def decide(
    value: float,
    expanded: float | None,
    lower: float | None,
    upper: float | None,
    rule: DecisionRule,
    *,
    beyond: bool = False,
) -> tuple[Verdict, str]:
    """Return the verdict on a value and why (ILAC-G8:09/2019).

    ``simple`` acceptance judges the value alone. ``guard-band`` (w = U) passes or fails only what is clear
    of the limits by U, and calls the rest conditional. With ``beyond`` the value must be greater than the
    lower limit, which itself is not enough then.
    """
    inside = _within(value, lower, upper, beyond=beyond)
    if rule == "simple":
        return ("pass", "within the limits") if inside else ("fail", "outside the limits")
    if expanded is None:
        return "inconclusive", "the guard band needs an expanded uncertainty, and there is none"
    inner = _within(value, _moved(lower, expanded), _moved(upper, -expanded))
    outer = _within(value, _moved(lower, -expanded), _moved(upper, expanded))
    if inner:
        return "pass", "within the limits by more than U"
    if inside:
        return "conditional-pass", "within the limits, but by less than U"
    if outer:
        return "conditional-fail", "outside the limits, but by less than U"
    return "fail", "outside the limits by more than U"


def _moved(limit: float | None, by: float) -> float | None:
    return None if limit is None else limit + by


def govern(result: RequirementResult, conditions: Iterable[RequirementResult]) -> RequirementResult:
    """Return a result under the conditions that govern it (docs/evaluation-document.md).

    A broken condition makes it invalid, one that the record cannot show makes it inconclusive; what was
    never reached stays not tested.
    """
    if result.verdict == "not-tested":
        return result
    broken = [c for c in conditions if c.verdict == "fail"]
    unshown = [c for c in conditions if c.verdict == "inconclusive"]
    if broken:
        names = ", ".join(dict.fromkeys(c.id for c in broken))
        return replace(result, verdict="invalid", why=f"{result.why}; condition broken: {names}")
    if unshown:
        names = ", ".join(dict.fromkeys(c.id for c in unshown))
        return replace(result, verdict="inconclusive", why=f"{result.why}; condition not shown: {names}")
    return result


def run_verdict(results: Sequence[RequirementResult]) -> Verdict | None:
    """Return the verdict of a run; None where nothing is required of it."""
    if not results:
        return None
    verdicts = {result.verdict for result in results}
    if "invalid" in verdicts or any(r.condition and r.verdict == "fail" for r in results):
        return "invalid"
    if "fail" in verdicts:
        return "fail"
    if verdicts & {"inconclusive", "not-tested"}:
        return "inconclusive"
    order: tuple[Verdict, ...] = ("conditional-fail", "conditional-pass", "pass")
    return next(verdict for verdict in order if verdict in verdicts)
