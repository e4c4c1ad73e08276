"""Where first contact can lie by what else the record shows: the force at rest, and the ways out.

:mod:`bufferstand.evaluation.loops.first_contact` finds it on the first way in. A specimen that stands still
at a stroke and does not push there is not compressed there: the contact lies no farther before that stroke
than what the zero of the force and its noise hide. And a specimen pushes on the way out no farther than to
where it was met. A force that does is late, or its zero moves, so that the way in does not show the contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bufferstand.evaluation.facts import Cycle, FirstContact
from bufferstand.evaluation.loops.first_contact import noise_of_bends
from bufferstand.evaluation.record import Record

_LEAST_SLOPE = 0.5
"""A spring is stiffer than this [kN/mm]."""
_RUBS_KN, _RUBS_SHARE = 2.0, 0.005
"""Guides rub by no more than this, or this share of the largest force …"""
_SURE = 6.0
"""… and noise makes no more than so many standard deviations."""
_FEWEST, _MOST = 5, 200
"""The stroke stands still for so many samples at least; of so many a mean is taken."""
_ALONE = 5
"""So few samples that push show nothing."""


def by_force_at_rest(
    contact: FirstContact, record: Record, top_s: float, force_zero_kN: float
) -> FirstContact:
    """Return the contact of a first stroke, no farther before its rest than the force allows.

    Parameters
    ----------
    contact : FirstContact
    record : Record
    top_s : float
        Moment of the first upper turning point [s].
    force_zero_kN : float
        Limit of the error of the force's zero, as its channel states it.
    """
    if contact.stroke_mm is None or contact.expanded_uncertainty is None or contact.how != "rise":
        return contact
    rows = slice(0, int(np.searchsorted(record.time_s, top_s)) + 1)
    stroke, force = record.stroke_mm[rows], record.force_kN[rows]
    if stroke.size < 2 * _FEWEST:
        return contact
    noise_mm = noise_of_bends(stroke[:_MOST])
    stood_mm = float(np.median(stroke[:_FEWEST]))
    stands = int(np.argmax(stroke > stood_mm + max(0.05, _SURE * noise_mm)))
    if stands < _FEWEST:
        return contact
    resting = force[:stands][-_MOST:]
    level, u_level = float(np.mean(resting)), float(np.std(resting) / np.sqrt(resting.size))
    hidden_kN = max(0.0, level + force_zero_kN + 2.0 * u_level)
    least_mm = stood_mm - hidden_kN / _LEAST_SLOPE - 2.0 * noise_mm
    low, high = _ends(contact)
    return contact if least_mm <= low or least_mm >= high else _between(contact, least_mm, high)


def by_ways_out(
    contact: FirstContact, record: Record, cycles: Sequence[Cycle], jumped_s: float = np.inf
) -> FirstContact:
    """Return the contact as it may lie where the specimen still pushes before it on a way out.

    Parameters
    ----------
    contact : FirstContact
    record : Record
    cycles : sequence of Cycle
    jumped_s : float
        When the stroke jumps [s]: behind that nothing is looked for.
    """
    if contact.stroke_mm is None or contact.rest_force_kN is None or record.between is not None:
        return contact
    rubs_kN = max(_RUBS_KN, _RUBS_SHARE * float(np.max(record.force_kN)))
    above_kN = contact.rest_force_kN + rubs_kN + _SURE * noise_of_bends(record.force_kN)
    low, high = _ends(contact)
    lowest = low
    for cycle in cycles:
        if cycle.end.leave_s >= jumped_s:
            break
        rows = slice(*np.searchsorted(record.time_s, (cycle.top.leave_s, cycle.end.leave_s)).tolist())
        pushed_mm = record.stroke_mm[rows][record.force_kN[rows] > above_kN]
        if pushed_mm.size > _ALONE:
            lowest = min(lowest, float(np.partition(pushed_mm, _ALONE)[_ALONE]))
    return contact if lowest >= low else _between(contact, lowest, high)


def _ends(contact: FirstContact) -> tuple[float, float]:
    place, expanded = contact.stroke_mm or 0.0, contact.expanded_uncertainty or 0.0
    return place - expanded, place + expanded


def _between(contact: FirstContact, low_mm: float, high_mm: float) -> FirstContact:
    """Return a contact that lies anywhere between two strokes."""
    place, expanded = 0.5 * (low_mm + high_mm), 0.5 * (high_mm - low_mm)
    return replace(
        contact,
        stroke_mm=place,
        expanded_uncertainty=expanded,
        recorded_zero_offset_mm=-place,
        beyond=abs(place) > expanded + contact.stated_zero_mm,
        why=f"first contact at {place:.2f} ± {expanded:.2f} mm of the recorded stroke",
    )
