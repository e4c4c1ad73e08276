"""The controller's clock against the host's, by the blocks that came through quickest."""

from __future__ import annotations

from collections import deque

KEPT_S = 30.0
"""The quickest block of so long counts [s]: longer than a computer is too busy to read anything in time, and
so short that clocks 100 ppm apart go by no more than 3 ms."""


class ClockOffset:
    """The least delay between a block's newest sample and its arrival.

    What a busy computer reads late must not be taken for a clock that has gone slow, nor its samples for
    ones that come later than those of another stream.
    """

    def __init__(self) -> None:
        self._least: deque[tuple[float, float]] = deque()  # arrival and delay; both rise

    @property
    def value_s(self) -> float:
        """Return host time minus the controller's, to the wire's quickest trip [s]; 0 before any block."""
        return self._least[0][1] if self._least else 0.0

    def take(self, received_s: float, newest_s: float) -> float:
        """Take a block; return the offset.

        Parameters
        ----------
        received_s : float
            When it came, host stand time [s].
        newest_s : float
            Time stamp of its newest sample, by the controller's clock [s].
        """
        delay_s = received_s - newest_s
        while self._least and self._least[-1][1] >= delay_s:
            self._least.pop()
        self._least.append((received_s, delay_s))
        while self._least[0][0] < received_s - KEPT_S:
            self._least.popleft()
        return self.value_s
