"""Proof loads judged: was the force reached, and what deformation stays after relief (paper 2.1, Table 2).

Read from the samples, not from cycles: a specimen that stays deformed does not close its cycle. A force that
was not reached is a shortcoming of the test, not of the specimen: inconclusive.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.facts import RequirementResult
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.requirements.checklist import SERVICEABLE, judge_item
from bufferstand.evaluation.requirements.conditions import why_not
from bufferstand.evaluation.requirements.decision import govern
from bufferstand.evaluation.requirements.limit_set import ProofLoad
from bufferstand.evaluation.requirements.rows import Case, RowLimits, judged, row, shown, spoiling
from bufferstand.evaluation.requirements.stated_accuracy import (
    force_expanded_kN,
    stroke_difference_expanded_mm,
)
from bufferstand.foundation.numbers import median

PEAK_SAMPLES = 5
"""The force reached is the largest mean of so many samples in a row: never a single one."""
REST_S = 1.0
"""Strokes before and after are medians over the last so many seconds with the specimen relieved: the first
kilonewtons of the ramp, which still count as relieved, do not shift them."""


@dataclass(frozen=True)
class Relief:
    """Strokes of the relieved specimen [mm] before and after the load; None where the record has none.

    ``after_s`` is how long after the load the second was read.
    """

    before_mm: float | None
    after_mm: float | None
    after_s: float


def judge_proof(case: Case) -> list[RequirementResult]:
    """Return force, load cycles, permanent deformation and serviceability of the proof load of a run."""
    load = case.limits.proof_load(case.facts.proof_load)
    if load is None:
        return [_unknown_load(case)]
    force = _force(case, load)
    deformation = _deformation(case, load)
    if deformation is not None and deformation.verdict not in ("fail", "conditional-fail"):
        deformation = govern(deformation, [force])
    rows = [force, _cycles(case, load), deformation]
    if load.serviceable:
        rows.append(judge_item(case, SERVICEABLE.model_copy(update={"clause": load.clause})))
    return [result for result in rows if result is not None]


def _unknown_load(case: Case) -> RequirementResult:
    loads = case.limits.proof.load if case.limits.proof else ()
    names = ", ".join(load.id for load in loads)
    given = case.facts.proof_load
    why = (
        f"the limit set has no proof load {given}"
        if given
        else "which proof load was applied is not on record"
    )
    why += f" ([test] proof_load, one of {names})"
    text = "proof load"
    return row(
        case, "proof-load", None, text, RowLimits(None, None, "kN"), "inconclusive", why, condition=True
    )


def peak_force_kN(force_kN: FloatArray) -> float | None:  # noqa: N802 - the unit's own letters
    """Return the largest mean of five finite samples in a row [kN]; None below five samples."""
    force = force_kN[np.isfinite(force_kN)]
    if force.size < PEAK_SAMPLES:
        return None
    means = np.convolve(force, np.full(PEAK_SAMPLES, 1.0 / PEAK_SAMPLES), mode="valid")
    return float(np.max(means))


def find_relief(record: Record, threshold_kN: float) -> Relief:
    """Return the strokes of the relieved specimen before the first and after the last load.

    Parameters
    ----------
    record : Record
    threshold_kN : float
        Up to this force (either sign) the specimen counts as relieved.
    """
    good = np.isfinite(record.force_kN) & np.isfinite(record.stroke_mm)
    time, stroke, force = record.time_s[good], record.stroke_mm[good], record.force_kN[good]
    loaded = np.flatnonzero(np.abs(force) > threshold_kN)
    if loaded.size == 0:
        return Relief(None, None, 0.0)
    first, last = int(loaded[0]), int(loaded[-1])
    before = _rest_mm(time[:first], stroke[:first])
    after = _rest_mm(time[last + 1 :], stroke[last + 1 :])
    return Relief(before, after, float(time[-1] - time[last]))


def _rest_mm(time_s: FloatArray, stroke_mm: FloatArray) -> float | None:
    """Return the median stroke of the last second of a stretch; None below five samples."""
    if time_s.size == 0:
        return None
    late = stroke_mm[time_s >= time_s[-1] - REST_S]
    return median(late) if late.size >= PEAK_SAMPLES else None


def _force(case: Case, load: ProofLoad) -> RequirementResult:
    identity, text = f"proof-load-{load.id.lower()}", f"{load.id}, {load.text}: force reached"
    limits = RowLimits.of(load.force_min_kN, "none", "kN")
    peaks = [result.quantities.force_max_kN for result in case.cycles]
    weakest = min((peak for peak in peaks if peak is not None), default=None)
    # A load that is repeated must be reached each time.
    repeated = load.cycles_min != "none" and weakest is not None
    reached = weakest if repeated else peak_force_kN(case.record.force_kN)
    if reached is None:
        unknown = "no force on record"
        return row(case, identity, None, text, limits, "inconclusive", unknown, cited=load, condition=True)
    result = judged(
        case,
        identity,
        None,
        text,
        limits,
        reached,
        None,
        load,
        uncertainty=force_expanded_kN(case.facts, reached),
        condition=True,
    )
    why = f"{reached:.1f} kN reached" + (" in the weakest cycle" if repeated else "")
    missing = next((stroke for stroke in case.strokes if not stroke.cycle.bounded), None)
    if repeated and missing is not None:
        return replace(result, verdict="inconclusive", why=f"{why}; {why_not(missing)}")
    if repeated and (finding := spoiling(case, "load-cycles", None)):
        return replace(result, verdict="inconclusive", why=f"{why}; {finding.text}")
    if result.verdict in ("fail", "conditional-fail"):
        return replace(result, verdict="inconclusive", why=f"{why}: the test stopped short of the proof load")
    return replace(result, why=f"{why}; {result.why}")


def _cycles(case: Case, load: ProofLoad) -> RequirementResult | None:
    limits = RowLimits.of(load.cycles_min, "none", "cycles")
    if limits.nothing:
        return None
    text = f"{load.id}: {shown(load.cycles_min)} load cycles"
    count = float(len(case.cycles))
    result = judged(
        case, "load-cycles", None, text, limits, count, None, load, uncertainty=0.0, condition=True
    )
    why = f"{count:.0f} complete cycles on record; {result.why}"
    if result.verdict == "fail":
        return replace(result, verdict="inconclusive", why=why)
    return replace(result, why=why)


def _deformation(case: Case, load: ProofLoad) -> RequirementResult | None:
    limits = RowLimits.of("none", load.permanent_deformation_max_mm, "mm")
    proof = case.limits.proof
    if limits.nothing or proof is None:
        return None
    identity = "permanent-deformation"
    text = f"{load.id}: permanent deformation within the manufacturer's tolerance"
    relief = find_relief(case.record, proof.relief_force_max_kN)
    if relief.before_mm is None or relief.after_mm is None:
        when = "before" if relief.before_mm is None else "after"
        why = f"the record shows no relieved specimen {when} the load ({proof.relief_force_max_kN:g} kN)"
        return row(case, identity, None, text, limits, "inconclusive", why, cited=load)
    residual = relief.after_mm - relief.before_mm
    uncertainty = stroke_difference_expanded_mm(case.facts, residual)
    result = judged(case, identity, None, text, limits, residual, None, load, uncertainty=uncertainty)
    return replace(result, why=f"{result.why}; {residual:.2f} mm, {relief.after_s:.1f} s after relief")
