"""Requirements that an inspector answers: items that were inspected, and items that were not."""

from __future__ import annotations

from bufferstand.evaluation.facts import RequirementResult, Verdict
from bufferstand.evaluation.requirements.limit_set import InspectionItem, LimitSet
from bufferstand.evaluation.requirements.rows import Case, RowLimits, row

SERVICEABLE = InspectionItem(
    id="serviceable-condition", text="the specimen is in serviceable condition after the proof load"
)


def asked_items(limits: LimitSet) -> tuple[str, ...]:
    """Return the items that a set asks an inspector for."""
    loads = limits.proof.load if limits.proof else ()
    extra = (SERVICEABLE.id,) if any(load.serviceable for load in loads) else ()
    return (*(item.id for item in limits.inspection), *extra)


def judge_item(case: Case, item: InspectionItem) -> RequirementResult:
    """Return the row of one item: ``not-tested`` unless the inspector's file answers it."""
    verdict: Verdict = "not-tested"
    if case.inspection is None:
        why = "no inspector's file for this specimen"
    elif (found := case.inspection.finding(item.id)) is None or found.result == "fill-in":
        why = f"not filled in by {_by(case)}"
    else:
        verdict = "pass" if found.result == "in-order" else "fail"
        answer = "in order" if found.result == "in-order" else "defect"
        why = f"{answer}, {_by(case)}: {found.note}" if found.note else f"{answer}, {_by(case)}"
    return row(
        case, item.id, None, item.text, RowLimits(None, None, ""), verdict, why, cited=item, by_hand=True
    )


def _by(case: Case) -> str:
    if case.inspection is None:
        return ""
    inspected = case.inspection.inspection
    return f"{inspected.inspector}, {inspected.date.isoformat()}"
