"""Which cycles of its loop a simulated controller misses: at random, by the seed alone."""

from __future__ import annotations

import numpy as np

NEVER = 1 << 62
"""A period that no stand lives to see."""


class MissedCycles:
    """A schedule of missed cycles, as far apart as those of a Poisson process.

    Parameters
    ----------
    per_h : float
        Their mean number in an hour of the controller's clock; 0 for none.
    rate_Hz : float
        Cycles a second.
    seed : numpy.random.SeedSequence
    """

    def __init__(self, per_h: float, rate_Hz: float, seed: np.random.SeedSequence) -> None:
        self._share = per_h / (3600.0 * rate_Hz)
        self._random = np.random.Generator(np.random.PCG64(seed))
        self.next = -1
        """Number of the period that is missed next, of all that have passed."""
        self.draw()

    def draw(self) -> None:
        """Find the next one, behind the one that is known."""
        self.next = self.next + int(self._random.geometric(self._share)) if self._share > 0.0 else NEVER
