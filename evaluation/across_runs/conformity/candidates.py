"""The facts of an evaluated run that decide whether it can be the conformity test."""

from __future__ import annotations

from collections.abc import Iterable

from bufferstand.evaluation.across_runs.conformity.purposes import Candidate, Standing
from bufferstand.evaluation.facts import RunEvaluation


def candidate_of(run: RunEvaluation) -> Candidate:
    """Return the facts of a run that decide; its record and cycles are not needed."""
    facts = run.facts
    step_kind = facts.step.get("kind")
    return Candidate(
        id=facts.id,
        path=facts.path,
        kind=facts.kind,
        specimen=_text(facts.specimen.get("id")),
        campaign=facts.campaign,
        started=None if facts.started is None else facts.started.isoformat(),
        step_kind=_text(step_kind),
        stated=facts.purpose,
        standing=standing_of((row.condition, row.verdict) for row in run.requirements),
        verdict=run.verdict,
    )


def standing_of(rows: Iterable[tuple[bool, str]]) -> Standing | None:
    """Return how the conditions of a run stand, by (is a condition, verdict) of each of its rows.

    ``met`` if all are, ``broken`` if one is, else ``open``: the record does not show one. None where nothing
    was judged.
    """
    rows = list(rows)
    verdicts = {verdict for condition, verdict in rows if condition}
    if not rows:
        return None
    if "fail" in verdicts:
        return "broken"
    return "met" if verdicts <= {"pass", "conditional-pass"} else "open"


def _text(value: object) -> str | None:
    return None if value is None else str(value)
