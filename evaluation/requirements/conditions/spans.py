"""The value of a condition as a span: as far as the record leaves it open.

Every condition is judged so (:meth:`ValueSpan.verdict`): met where nothing in the span breaks it, broken
where nothing in it meets it, else not to be told. What widens each span: docs/evaluation/requirements.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.facts import RequirementResult, Verdict
from bufferstand.evaluation.gaps import ASTIR
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.requirements.rows import Case, RowLimits, condition_row


@dataclass(frozen=True)
class ValueSpan:
    """A value lies from ``least`` to ``most``; ``why`` says what keeps the record from telling it better."""

    least: float
    most: float
    why: str = ""

    def verdict(self, limits: RowLimits) -> Verdict:
        """Return whether all values of the span keep the limits, or none does, or some."""
        if limits.meets(self.least) and limits.meets(self.most):
            return "pass"
        above = limits.upper is not None and self.least > limits.upper
        below = limits.lower is not None and self.most < limits.lower
        return "fail" if above or below else "inconclusive"

    def text(self, unit: str) -> str:
        """Return what the span is, and why."""
        most = f" and {self.most:.4g}" if np.isfinite(self.most) else " and more"
        return f"{self.why or 'what is not on record'}: anything between {self.least:.4g}{most} {unit}"


def spanned_row(
    case: Case,
    identity: str,
    cycle: int | None,
    text: str,
    limits: RowLimits,
    span: ValueSpan,
    why: str,
    measured: float | None,
    uncertainty: float | None = None,
) -> RequirementResult:
    """Return the row of a condition by what the record says of its value; ``measured`` is for the reader."""
    verdict = span.verdict(limits)
    if verdict == "inconclusive":
        why = f"{why}; {span.text(limits.unit)}"
    return condition_row(case, identity, cycle, text, limits, measured, verdict, why, uncertainty)


def rows_read(case: Case, start_s: float, end_s: float) -> tuple[FloatArray, FloatArray]:
    """Return time [s] and stroke [mm] of the samples that were read between two moments."""
    record = case.record
    first, last = np.searchsorted(record.time_s, (start_s, end_s), side="left").tolist()
    last += int(last < record.time_s.size and record.time_s[last] == end_s)
    time_s, stroke_mm = record.time_s[first:last], record.stroke_mm[first:last]
    if not record.filled_s:
        return time_s, stroke_mm
    read = record.read[first:last]
    return time_s[read], stroke_mm[read]


def unsure_s(case: Case, moment_s: float) -> float:
    """Return by how much a moment of the motion may be another one: the step of time that it lies in.

    Where that is a hole in which the specimen rests, the motion began or ended within its own step beside it
    (:data:`bufferstand.evaluation.gaps.bridging.ASTIR` of them). Half the step of a rounded clock comes on
    top."""
    record = case.record
    for hole in case.holes:
        if hole.start_s <= moment_s <= hole.end_s:
            if not hole.rest:
                return hole.length_s + record.moment_error_s
            break
    rest = next(((a, b) for a, b in record.filled_s if a <= moment_s <= b), None)
    if rest is not None:
        return ASTIR * _step_beside_s(case, moment_s, *rest) + record.moment_error_s
    after = int(np.clip(np.searchsorted(record.time_s, moment_s), 1, record.time_s.size - 1))
    return float(record.time_s[after] - record.time_s[after - 1]) + record.moment_error_s


def _step_beside_s(case: Case, moment_s: float, start_s: float, end_s: float) -> float:
    """Return the step of time before a rest or behind it, whichever a moment in it is nearer to."""
    read_s = case.record.as_read(case.record.time_s)
    before = moment_s - start_s <= end_s - moment_s
    row = int(np.searchsorted(read_s, start_s)) if before else int(np.searchsorted(read_s, end_s)) + 1
    row = min(max(row, 1), read_s.size - 1)
    return float(read_s[row] - read_s[row - 1])
