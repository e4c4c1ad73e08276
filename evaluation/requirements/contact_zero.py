"""The effect of a wrong stroke zero on verdicts: each row is read from recorded zero and from contact.

The strokes of a requirement are counted from first contact. A zero that is off by more than its uncertainty
is a known error that is not corrected, so that U grows by all of it (JCGM 100, F.2.4.5). A verdict that
depends on it is inconclusive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bufferstand.evaluation.facts import RequirementResult, Verdict

COUNTED = " counted from first contact"
"""Words behind the value that a row has from the contact."""
_DECIDED: tuple[Verdict, ...] = ("pass", "fail")
_SAME: tuple[tuple[Verdict, ...], ...] = (("pass", "conditional-pass"), ("fail", "conditional-fail"))
"""Verdicts that differ by their distance from the limit only; the weaker one comes last."""


def beside(
    recorded: Sequence[RequirementResult], from_contact: Sequence[RequirementResult]
) -> list[RequirementResult]:
    """Return the rows as read from the recorded zero, with what the other zero says of each.

    Parameters
    ----------
    recorded, from_contact : sequences of RequirementResult
        The same requirements in the same order, read from either zero.
    """
    return [_joined(one, other) for one, other in zip(recorded, from_contact, strict=True)]


def _joined(one: RequirementResult, other: RequirementResult) -> RequirementResult:
    if one.verdict == other.verdict and one.measured == other.measured:
        return one
    why, uncertainty, probability = one.why, one.expanded_uncertainty, one.conformance_probability
    if one.measured is not None and other.measured is not None and one.measured != other.measured:
        why += f"; {other.measured:.4g} {one.unit}{COUNTED}"
        unstated = uncertainty is None and not one.condition and one.verdict in _DECIDED
        if unstated:  # a row that is read from a spoiled channel is not decided, and keeps none
            why += "; U is what the zero makes of it, and no more: the channels state none"
        if unstated or uncertainty is not None:
            uncertainty = (uncertainty or 0.0) + abs(other.measured - one.measured)
    verdict = _verdict(one.verdict, other.verdict)
    if verdict == "inconclusive":
        probability = None
    elif probability is not None and other.conformance_probability is not None:
        probability = min(probability, other.conformance_probability)
    if verdict != one.verdict and verdict == "inconclusive":
        why += f"; {other.verdict} from first contact: the stroke zero is off"
    return replace(
        one, verdict=verdict, why=why, expanded_uncertainty=uncertainty, conformance_probability=probability
    )


def _verdict(one: Verdict, other: Verdict) -> Verdict:
    if one == other:
        return one
    for family in _SAME:
        if one in family and other in family:
            return family[-1]
    return "inconclusive"
