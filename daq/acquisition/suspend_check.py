"""Whether this program ran without a pause, and what a wait with the valve off does if it did not."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from bufferstand.foundation import NotInCharge

LONGEST_CALL_S = 4.0
"""No call to a controller takes longer where its ``timeout_s`` is half a second [s of the wall]."""
EXPLAINS_S = 2.0
"""So long a pause of this program explains a device's fault that is seen behind it [s of the wall]."""
ANEW_MOST, ANEW_WITHIN_S = 3, 60.0
"""So often a wait takes a controller anew that does not go on as it did, within a time [s of the wall]."""


class ProgramSuspended(Exception):  # noqa: N818 - it names the fact
    """This program did not look for so long [s] that nothing seen before is to be believed."""

    def __init__(self, for_s: float) -> None:
        self.short = f"the computer slept {for_s:.0f} s"
        """For a line that says more than this."""
        super().__init__(f"{self.short} (or this program stood still: stopped, overloaded)")
        self.for_s = for_s


class SuspendWatch:
    """Times of the wall at which the program looked, and what it does in a wait with the valve off.

    Parameters
    ----------
    wall_s : float
        Now [s of the wall].
    """

    def __init__(self, wall_s: float) -> None:
        self._looked_s = wall_s
        self._explains_until_s = wall_s
        self._anew_at_s: deque[float] = deque(maxlen=ANEW_MOST)
        self.lock_lost: Callable[[NotInCharge], object] | None = None
        """In a wait with the valve off: told that another program has the stand; None: a reason to stop."""
        self.take_anew: Callable[[], str] | None = None
        """Looks at the stand as at a start, and takes it again; returns why it cannot be had."""
        self.longest_call_s = LONGEST_CALL_S
        """No call to the controller takes longer [s of the wall]: else this program stood still in it."""

    @property
    def waits(self) -> bool:
        """Whether the campaign waits with the valve off, and may take its stand anew."""
        return self.lock_lost is not None and self.take_anew is not None

    def look(self, wall_s: float, most_s: float) -> float:
        """Return how long nobody had looked by now, where that is more than ``most_s``; else 0 [s]."""
        still_s, self._looked_s = self.since_s(wall_s), wall_s
        if still_s <= most_s:
            return 0.0
        self._explains_until_s = wall_s + EXPLAINS_S
        return still_s

    def since_s(self, wall_s: float) -> float:
        """Return how long nobody has looked by now [s]."""
        return wall_s - self._looked_s

    def explains(self, wall_s: float) -> bool:
        """Return whether what is seen now may come of the last pause."""
        return wall_s <= self._explains_until_s

    def may_take_anew(self, wall_s: float) -> bool:
        """Return whether a controller that does not go on as it did is taken anew once more, and count it."""
        before = self._anew_at_s
        if not self.waits or (len(before) == ANEW_MOST and wall_s - before[0] < ANEW_WITHIN_S):
            return False
        before.append(wall_s)
        return True
