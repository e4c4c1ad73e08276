"""The largest recorded stroke at which first contact may have been.

Strokes count from first contact. Where the approach does not show it, the force does: the specimen was met
no later than where it begins to push. So a residual stroke shows by strokes that began at a smaller stroke,
whatever the zero is. If every stroke begins at the same place, a residual stroke and a wrong zero look alike.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bufferstand.evaluation.requirements.rows import Case

_SURE = 6.0
_RUBS_KN = 2.0
"""Guides rub by no more."""
_RUBS_SHARE = 0.005
"""Nor by more than this share of the largest force."""
_LOWEST = 50
"""The lowest force is that below which one of so many samples lies: one that stands alone is none."""


def highest_contact(case: Case) -> tuple[float | None, str]:
    """Return the highest place of first contact on the recorded stroke [mm], None if open; and by what.

    Parameters
    ----------
    case : Case
        Of a static run.
    """
    contact = case.contact
    text = "no first contact on it" if contact is None else contact.why
    places = list(_pushed(case))
    if contact is not None and contact.stroke_mm is not None:
        places.append(contact.stroke_mm + (contact.expanded_uncertainty or 0.0))
    elif places:
        text += f", it pushes from {min(places):.2f} mm on"
    return (min(places) if places else None), text


def _pushed(case: Case) -> Iterator[float]:
    """Yield from which stroke on the specimen pushes in each loading branch [mm].

    It pushes where the force is above the lowest on record, at which it did not pull, or above 0 and the
    limit that its channel states. A force that is not to be believed shows nothing.
    """
    if any(one.quantity == "force" and one.effect == "spoils" for one in case.spoiled.findings):
        return
    force_kN, stated = case.record.force_kN, case.facts.force_uncertainty
    rank = force_kN.size // _LOWEST
    level = float(np.partition(force_kN, rank)[rank])
    rubs = max(_RUBS_KN, _RUBS_SHARE * float(np.max(force_kN)))
    if stated is not None and stated.zero is not None:
        level = min(level, stated.zero)
    for prepared in case.prepared.values():
        loop = prepared.loop
        pushes = loop.force_kN[loop.loading] > level + rubs + _SURE * prepared.noise.force_kN
        if np.any(pushes):
            yield float(np.min(loop.stroke_mm[loop.loading][pushes]))
