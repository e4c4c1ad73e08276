"""How far a served stand may have come: its clock, held back for a reader that does not keep up."""

from __future__ import annotations

from drivers.simulated.ring import SampleRing
from foundation.clock import Clock

AHEAD = 6_000
"""Most samples that a fast stand runs ahead of the acknowledged one: guards see nothing older than 6 s."""
READING_S = 2.0
"""A client counts as reading for so long after its last acknowledgement [s of the wall]."""


class Pace:
    """Stand time of a served stand.

    At speed 1 it is the clock's: a reader that is too slow loses samples, as with a real device. A faster
    stand waits for whoever reads its ring, so that a slow computer costs time and not samples. Time that was
    waited is not made up: the stand goes on from where it is, at its speed.

    Parameters
    ----------
    clock : Clock
        Stand time as it would be, and the wall's.
    speed : float
        Stand seconds in one second of the wall.
    ring : SampleRing
        Says what has been acknowledged.
    period_s : float
        Sample period [s of stand time].
    """

    def __init__(self, clock: Clock, speed: float, ring: SampleRing, period_s: float) -> None:
        self._clock = clock
        self._waits = speed > 1.0
        self._ring = ring
        self._period_s = period_s
        self._waited_s = 0.0
        self._now_s = 0.0
        self._seen = 0
        self._seen_s = 0.0
        self._acknowledged: int | None = None
        self._most = 0

    def now_s(self) -> float:
        """Get the stand time [s] to which the stand may be advanced; it never steps back."""
        now_s = self._clock.now_s() - self._waited_s
        if self._waits and self._is_read():
            most_s = max(self._now_s, self._most * self._period_s)
            if now_s > most_s:
                self._waited_s += now_s - most_s
                now_s = most_s
        self._now_s = max(self._now_s, now_s)
        return self._now_s

    def _is_read(self) -> bool:
        """Return whether a client reads the ring at present; keep how many samples there may be for it."""
        ring, wall_s = self._ring, self._clock.wall_s()
        if ring.acknowledgements != self._seen:
            before, self._acknowledged = self._acknowledged, ring.acknowledged
            self._seen, self._seen_s = ring.acknowledgements, wall_s
            if before is None or ring.acknowledged < before:  # a new reader, who may begin far behind
                self._most = ring.total
                before = ring.acknowledged
            # Whoever is far behind gains on the stand without bringing it to a halt: its heartbeat counts on.
            self._most = max(ring.acknowledged + AHEAD, self._most + (ring.acknowledged - before) // 2)
        elif wall_s - self._seen_s > READING_S:
            self._acknowledged = None
        return self._acknowledged is not None
