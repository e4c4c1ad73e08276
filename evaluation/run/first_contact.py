"""The first contact of a run, and the warnings about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bufferstand.evaluation.facts import CycleResult, Finding, FirstContact, RequirementResult, RunFacts
from bufferstand.evaluation.loops import by_force_at_rest, by_ways_out, contact_decimals, first_shown
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.requirements import COUNTED

_ZERO_MOVES = ("drift", "offset-jump", "gain-jump")
_ZERO_OFF = (*_ZERO_MOVES, "zero", "unit", "sign")
"""Beside these the stated limit of the force's zero says nothing of what the force shows at rest."""


def first_contact_of(
    record: Record, facts: RunFacts, results: Sequence[CycleResult], findings: Sequence[Finding] = ()
) -> FirstContact | None:
    """Return the first contact of a static run; None of any other, and of one without a stroke.

    A record that begins with the motion has no rest before its first stroke, but before the others.

    Parameters
    ----------
    record : Record
    facts : RunFacts
    results : sequence of CycleResult
    findings : sequence of Finding
        What speaks against the run: behind a jump of the stroke nothing is looked for.
    """
    if facts.kind != "static" or not results:
        return None
    wires = facts.stroke_uncertainty
    stated_mm = sum(wire.zero or 0.0 for wire in wires) / max(1, len(wires))
    stated_mm *= _scale_of(record, facts, findings)
    moves = any(one.quantity == "force" and one.kind in _ZERO_MOVES for one in findings)
    turned = any(one.kind == "sign" and one.quantity == "force" for one in findings)
    record = replace(record, force_kN=-record.force_kN) if turned else record
    jumped_s = min((one.start_s for one in findings if one.kind == "stroke-jump"), default=np.inf)
    cycles = [result.cycle for result in results]
    found = first_shown(record, cycles, stated_mm, jumped_s, moves=moves)
    zero_kN = None if facts.force_uncertainty is None else facts.force_uncertainty.zero
    if zero_kN and not any(one.quantity == "force" and one.kind in _ZERO_OFF for one in findings):
        found = by_force_at_rest(found, record, cycles[0].top.time_s, zero_kN)
    if not moves:
        found = by_ways_out(found, record, cycles, jumped_s)
    rest_kN = found.rest_force_kN
    return replace(found, rest_force_kN=-rest_kN) if turned and rest_kN is not None else found


def _scale_of(record: Record, facts: RunFacts, findings: Sequence[Finding]) -> float:
    """Return what a millimetre is in a stroke whose unit is wrong, as far as the specimen's stroke tells."""
    length = facts.specimen.get("max_stroke_mm")
    wrong = any(one.kind == "unit" and one.quantity == "stroke" for one in findings)
    if not wrong or not isinstance(length, int | float) or length <= 0.0:
        return 1.0
    return float(np.ptp(record.stroke_mm)) / float(length)


def contact_warnings(contact: FirstContact | None, requirements: Sequence[RequirementResult]) -> list[str]:
    """Say that the stroke zero is off, and what hangs on it; or that the record does not show the contact.

    Parameters
    ----------
    contact : FirstContact or None
    requirements : sequence of RequirementResult
        As judged (:func:`bufferstand.evaluation.requirements.contact_zero.beside`).
    """
    if contact is None:
        return []
    if contact.stroke_mm is None:
        return [f"no first contact: {contact.why}; strokes are counted from the recorded zero"]
    if not contact.beyond:
        return []
    side = "before" if contact.stroke_mm > 0.0 else "behind"
    digits = contact_decimals(contact.expanded_uncertainty or 0.0)
    text = f"{contact.why}: the stroke zero lies {abs(contact.stroke_mm):.{digits}f} mm {side} it"
    told = [row for row in requirements if COUNTED in row.why and row.measured is not None]
    first = [row for row in told if row.cycle == told[0].cycle]
    if not first:
        return [text]
    each = "; ".join(f"{row.id} reads {row.measured:.4g} instead of {_counted(row)}" for row in first)
    of = "" if first[0].cycle is None else f"in cycle {first[0].cycle} "
    return [f"{text}; {of}{each}"]


def _counted(row: RequirementResult) -> str:
    return row.why.partition(COUNTED)[0].rpartition("; ")[2].strip()
