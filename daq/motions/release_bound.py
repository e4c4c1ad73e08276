"""How far a release may go back: to where nothing can press the specimen, whatever the force reads.

A controller's release goes on until it reads no force, and a wrong zero, a frozen or an exchanged force never
is none. What is taken for its end: the first contact that was touched off, or where none was the piston's own
zero, from which a campaign's motions begin. Beyond that so much more as a specimen grows by heat, or as a
contact lies before the piston's zero. And the force must have stayed as it is while the piston went back: one
that changes is believed for some way, it may be a load, and the position wrong.
"""

from __future__ import annotations

import math
from collections import deque

from bufferstand.foundation.channels import Zero

GROWN_MM = 5.0
"""So far before first contact nothing touches: 0.5 m of elastomer grow by 4 mm in 40 K (2e-4 per K)."""
UNTOUCHED_MM = 10.0
"""… and so far before the piston's own zero, where nobody touched off: the farthest that a touch takes."""
STAYS_KN, STAYS_SHARE, OVER_MM = 1.0, 0.05, 4.0
"""A force that changes by no more than this, and this share of it, over so much of the way is no load's."""
FALLS_MM, SPECIMEN_MM = 15.0, 110.0
"""One that changes is believed for so much more of the way, and no less from where the release began; from an
unknown contact for a buffer's whole stroke (105 mm, EN 15551) from there."""


def contact_of(zero: Zero | None) -> float | None:
    """Return where the piston touched the specimen, by its own zero [mm]; None where that was not found."""
    found = None if zero is None or zero.how != "touch" else zero.of("position")
    return None if found is None else found.value


class ReleaseBound:
    """Looks on at a release, and says when it has let go of the specimen.

    Parameters
    ----------
    began_mm : float
        Where the piston stood, by the controller's own reading and zero.
    contact_mm : float or None
        First contact by the same zero; None where none was touched off.
    """

    def __init__(self, began_mm: float, contact_mm: float | None) -> None:
        self._from = "its own zero (no contact was touched off)" if contact_mm is None else "first contact"
        self._contact_mm = 0.0 if contact_mm is None else contact_mm
        self._end_mm = min(0.0, self._contact_mm) - (UNTOUCHED_MM if contact_mm is None else GROWN_MM)
        whole_mm = FALLS_MM if contact_mm is not None else SPECIMEN_MM
        self._last_mm = min(self._end_mm - FALLS_MM, began_mm - whole_mm)
        self._seen: deque[tuple[float, float]] = deque()

    def look(self, position_mm: float, force_kN: float, own_kN: float) -> str:
        """Return that the release has let go though a force is read, with figures; empty while it has not.

        Parameters
        ----------
        position_mm : float
            Of the piston, by the controller's own reading.
        force_kN : float
            By the best channel.
        own_kN : float
            As the controller reads it, by which it goes on.
        """
        if not math.isfinite(position_mm):
            return ""
        self._seen.append((position_mm, force_kN))
        while len(self._seen) > 1 and self._seen[1][0] >= position_mm + OVER_MM:
            self._seen.popleft()
        if position_mm >= self._end_mm or not (self._stays(position_mm) or position_mm < self._last_mm):
            return ""
        return (
            f"the force reads {force_kN:+.1f} kN (the controller's own reading: {own_kN:+.1f} kN) though the "
            f"stand has let go: the piston is {self._contact_mm - position_mm:.1f} mm back from {self._from};"
            " no load is read there, look at zero, scale and wire of channel force"
        )

    def _stays(self, position_mm: float) -> bool:
        """Return whether the force has not changed with the way; one that is no number shows no load."""
        before_mm, before_kN = self._seen[0]
        now_kN = self._seen[-1][1]
        if before_mm < position_mm + OVER_MM:
            return False
        return not abs(now_kN - before_kN) > STAYS_KN + STAYS_SHARE * abs(before_kN)
