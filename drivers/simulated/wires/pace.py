"""The clock of a served stand, held back for a reader that does not keep up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bufferstand.drivers.simulated.machine import SampleRing
from bufferstand.foundation import Clock

AHEAD = 250
"""Most samples that a stand runs ahead of a reader who had seen its newest: guards see nothing much older."""
READING_S = 2.0
"""A client counts as reading for so long after its last acknowledgement [s of the wall]."""
POLLS_AHEAD, POLLS_LATE = 1.1, 2.9
"""So many polls a stand runs ahead of one who polls it: the next one is due before, and none is left out. At
the wall's speed, where polls are late as real ones are, it lets them be late by so many more."""
TURN_S, LONGEST_TURN_S = 0.001, 0.1
"""A reader who polls is thought to need so long from a reply to its stamp, and at most [s of the wall]."""
TURN_KEPT = 0.95
"""Share of the longest time seen that still counts at the next one."""
PATIENCE_S = 30.0
"""A client whose link is still open counts as reading for so long [s of the wall]: it may be starved."""
CREDIT_S = 0.25
"""Longest time of the wall that counts between two looks [s]: in between, this process was starved itself."""


class Link(Protocol):
    """The connection over which a client asked."""

    @property
    def is_open(self) -> bool:
        """Whether the client still has it open; True where a wire cannot tell."""
        ...


class StandPace:
    """Stand time of a served stand.

    A real stand waits for nobody: a reader that is too slow loses samples. A stand that ``waits`` does so
    for whoever reads its ring, so that a slow or starved computer costs time and not samples. Time that was
    waited is not made up: the stand goes on from where it is, at its speed. It then lives in its own time
    altogether: its watchdog counts :meth:`lived_s`.

    Whenever the reader gets less than a whole block it has seen all that there is, and the stand may run
    ``AHEAD`` samples on. A reader that is behind is let gain without bringing the stand to a halt, whose
    heartbeat counts on: the stand makes one sample for two that are read. What a reader skips, as a
    driver does that begins at a full ring, it has not read.

    A reader that polls a stand without a window sees the newest sample; the stand may then run on until
    behind its next poll. Between the requests of one poll, and until a reader has had time to stamp the last
    one, the stand's time goes on by what a round trip takes there, not by what it takes this computer.

    Parameters
    ----------
    clock : Clock
        Stand time as it would be, and the wall's.
    speed : float
        Stand seconds in one second of the wall.
    waits : bool
        Whether it waits for its reader.
    """

    def __init__(self, clock: Clock, speed: float, *, waits: bool) -> None:
        self._clock = clock
        self._speed = speed
        self.waits = waits
        self._ring: SampleRing | None = None
        self._period_s = 0.0
        self._block = 1
        self._ahead = float(AHEAD)
        self._polled = False
        self._trip_s: Callable[[], float] = lambda: 0.0
        self._held = (0.0, 0.0)
        self._turn_s = TURN_S
        self._parted_s: float | None = None
        self._asker: Callable[[], Link | None] = lambda: None
        self._waited_s = 0.0
        self._now_s = 0.0
        self._seen = 0
        self._looked_s = clock.wall_s()
        self._unread_s = 0.0
        self._acknowledged: int | None = None
        self._link: Link | None = None
        self._most = 0.0

    def watch(
        self, ring: SampleRing, period_s: float, block: int, asker: Callable[[], Link | None] = lambda: None
    ) -> None:
        """Begin to hold the stand back.

        Parameters
        ----------
        ring : SampleRing
            Says what has been made and acknowledged.
        period_s : float
            Sample period [s of stand time].
        block : int
            Samples of a whole block.
        asker : callable
            Gives the link of the last request.
        """
        self._ring, self._period_s, self._block, self._asker = ring, period_s, block, asker

    def expect_polls(self, every_s: float, trip_s: Callable[[], float]) -> None:
        """Let its reader poll instead of reading a window.

        Parameters
        ----------
        every_s : float
            Time between two polls [s of stand time].
        trip_s : callable
            Gives how long the next request takes with its reply [s of stand time].
        """
        self._polled, self._trip_s = True, trip_s
        self._ahead = (POLLS_AHEAD + POLLS_LATE / max(1.0, self._speed)) * every_s / self._period_s

    def now_s(self) -> float:
        """Get the stand time [s] to which the stand may be advanced; it never steps back."""
        now_s = self._clock.now_s() - self._waited_s
        if self.waits and self._ring is not None:
            # What a starved process could not make is no debt either: the stand is never far behind its time.
            ahead = float(AHEAD)
            if self._is_read(self._ring):
                ahead = min(ahead, self._most - self._ring.total)
                until_s, most = self._held
                if self._looked_s < until_s:
                    ahead = min(ahead, most - self._ring.total)
            most_s = max(self._now_s, (self._ring.periods + ahead) * self._period_s)
            if now_s > most_s:
                self._waited_s += now_s - most_s
                now_s = most_s
        self._now_s = max(self._now_s, now_s)
        return self._now_s

    def lived_s(self) -> float:
        """Get the time of the wall [s] that the stand has lived: without what it waited, if it waits."""
        return self._now_s / self._speed if self.waits else self._clock.wall_s()

    def _is_read(self, ring: SampleRing) -> bool:
        """Return whether a client reads the ring at present; keep how many samples there may be for it."""
        wall_s = self._clock.wall_s()
        self._unread_s += min(CREDIT_S, wall_s - self._looked_s)
        self._looked_s = wall_s
        if ring.acknowledgements != self._seen:
            readable = (ring.acknowledgements - self._seen) * self._block
            self._seen, self._unread_s, self._link = ring.acknowledgements, 0.0, self._asker()
            before, self._acknowledged = self._acknowledged, ring.acknowledged
            self._hold(ring, wall_s)
            if ring.polling:
                self._most = self._held[1]
            elif ring.total - ring.acknowledged < self._block:
                self._most = ring.total + self._ahead
            elif before is None or ring.acknowledged < before:  # a new reader, who begins far behind
                self._most = ring.total
            else:  # who skips a backlog has not read it, and the stand may not run on by half of it
                self._most += min(ring.acknowledged - before, readable) // 2
        elif self._unread_s > (PATIENCE_S if self._link is not None and self._link.is_open else READING_S):
            self._acknowledged = None
        return self._acknowledged is not None

    def _hold(self, ring: SampleRing, wall_s: float) -> None:
        """Let little time pass until who polls can have stamped the reply: as long as it took before."""
        if not self._polled:
            return
        if self._parted_s is not None:
            turn_s = min(LONGEST_TURN_S, wall_s - self._parted_s)
            self._turn_s = max(turn_s, TURN_KEPT * self._turn_s)
        self._parted_s = wall_s if ring.polling else None
        most = (self._now_s + self._trip_s()) / self._period_s - ring.missed
        self._held = (wall_s + self._turn_s, most)
