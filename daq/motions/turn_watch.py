"""Force and piston position on the way to a turn: how fast the force grows, what it came to, how stiff."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock

Floats = NDArray[np.float64]

AVERAGED = 5
"""Samples that are averaged for a turning force, so that noise does not overreach it."""
RATE_OVER_S = 0.03
"""The force's rate is that over this time [s]."""
STIFF_OVER_MM, STIFF_OVER_SHARE = 0.5, 0.05
"""The stiffness is that over this way before the turn [mm], or this share of the ramp where that is more."""
LEAST_SPAN_MM = 0.05
"""Over less than this no stiffness is measured [mm]."""
FEWEST = 8
"""Samples that a fit needs."""


class TurnWatch:
    """Keeps the samples of the ramp under way; a listener of the acquisition."""

    def __init__(self) -> None:
        self._sign = 1.0
        self._time: list[Floats] = []
        self._force: list[Floats] = []
        self._position: list[Floats] = []
        self._extreme_kN: float | None = None
        self._stiffness: float | None = None
        self.stiffness_before_kN_per_mm: float | None = None
        """dF/dposition before the turn before this one; None where it is not known."""

    def begin_turn(self, sign: float) -> None:
        """Forget the turn before: the way leads to greater forces now (+1), or to smaller ones (−1)."""
        self.stiffness_before_kN_per_mm = self.stiffness_kN_per_mm()
        self._sign, self._extreme_kN, self._stiffness = sign, None, None
        self._time, self._force, self._position = [], [], []

    def begin_ramp(self) -> None:
        """Forget the samples of the ramp before, not what the turn has come to."""
        self._extreme_kN = self._most()
        self._stiffness = self.stiffness_kN_per_mm()
        self._time, self._force, self._position = [], [], []

    def take(self, block: ScaledBlock) -> None:
        """Keep a block of the controller's samples; the stroke stands for a piston without encoder."""
        force = block.values.get("force")
        position = block.values.get("position", block.values.get("stroke"))
        if force is None or position is None or not len(block):
            return
        self._time.append(block.time_us.astype(np.float64) * 1e-6)
        self._force.append(force)
        self._position.append(position)

    @property
    def force_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Newest force, averaged [kN]; 0 before the first sample."""
        return float(self._force[-1][-AVERAGED:].mean()) if self._force else 0.0

    @property
    def position_mm(self) -> float:
        """Newest position [mm]; 0 before the first sample."""
        return float(self._position[-1][-1]) if self._position else 0.0

    @property
    def extreme_kN(self) -> float:  # noqa: N802
        """Greatest (on the way back: smallest) force since the turn began [kN]; 0 without samples."""
        return self._most() or 0.0

    def rate_kN_per_s(self) -> float | None:  # noqa: N802
        """Return how fast the force changes [kN/s]; None before enough samples have come."""
        if not self._time:
            return None
        newest_s = self._time[-1][-1]
        blocks = 1
        while blocks < len(self._time) and self._time[-blocks][0] >= newest_s - RATE_OVER_S:
            blocks += 1
        time, force = (np.concatenate(parts[-blocks:]) for parts in (self._time, self._force))
        late = time >= newest_s - RATE_OVER_S
        return _slope(time[late], force[late])

    def stiffness_kN_per_mm(self) -> float | None:  # noqa: N802
        """Return dF/dposition before the turn [kN/mm]; that of the ramp before if this one shows none."""
        if not self._position:
            return self._stiffness
        position, force = np.concatenate(self._position), np.concatenate(self._force)
        turned = int(np.argmax(self._sign * position)) + 1
        position, force = position[:turned], force[:turned]
        way_mm = float(np.ptp(position))
        near_mm = max(STIFF_OVER_MM, STIFF_OVER_SHARE * way_mm)
        near = self._sign * (position[-1] - position) <= near_mm
        if np.ptp(position[near]) < LEAST_SPAN_MM:
            return self._stiffness
        found = _slope(position[near], force[near])
        return found if found is not None and found > 0.0 else self._stiffness

    def _most(self) -> float | None:
        if not self._force:
            return self._extreme_kN
        force = np.concatenate(self._force)
        some = min(AVERAGED, len(force))
        smooth = self._sign * np.convolve(force, np.full(some, 1.0 / some), mode="valid")
        here = float(smooth.max())
        return self._sign * (here if self._extreme_kN is None else max(here, self._sign * self._extreme_kN))


def _slope(x: Floats, y: Floats) -> float | None:
    """Return the slope of the straight line through samples; None for too few."""
    if len(x) < FEWEST:
        return None
    apart = x - x.mean()
    spread = float(apart @ apart)
    return float(apart @ y) / spread if spread > 0.0 else None
