"""How the acquisition's loop is paced."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bufferstand.drivers import StreamFacts
from bufferstand.drivers.delivery_rate import FEED_S

SHARE_OF_POLL = 0.25
"""Share of a poll's period after which the next pass comes."""


@dataclass(frozen=True)
class LoopPace:
    """How the loop is paced.

    Parameters
    ----------
    tick_s : float
        From the beginning of a pass to that of the next, where the reader is up to date [s of stand time].
    look_s : float
        So long at most a pass reads samples, so that sensors, status and watchdog always get their turn
        [s of the wall].
    judge_s : float
        Blocks that come within this time are judged together [s of the wall]: on a quick wire that saves
        processor time; a slower one has each block judged when it arrives.
    feed_s : float
        The watchdog is fed this often [s of the wall].
    anchor_s : float
        A clock anchor is recorded this often [s of stand time].
    """

    tick_s: float = 0.01
    look_s: float = 0.02
    judge_s: float = 0.003
    feed_s: float = FEED_S
    anchor_s: float = 1.0

    def suited_to(self, controller: StreamFacts) -> LoopPace:
        """Return the pace for a controller: a polled sample is not to wait for a pass longer than it must."""
        if controller.clock == "device":
            return self
        return replace(self, tick_s=min(self.tick_s, SHARE_OF_POLL / controller.rate_Hz))
