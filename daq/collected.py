"""Samples of a stretch of time, kept to be looked at afterwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.panel import CONTROLLER_STREAM
from daq.scaling import ScaledBlock


class Collected:
    """Samples of a stretch of time, of the controller and of a second way to the force."""

    def __init__(self) -> None:
        self._blocks: list[ScaledBlock] = []
        self._others: dict[str, list[NDArray[np.float64]]] = {}

    def take(self, block: ScaledBlock) -> None:
        """Take a block of any stream."""
        if block.stream == CONTROLLER_STREAM:
            self._blocks.append(block)
            return
        for name, values in block.values.items():
            self._others.setdefault(name, []).append(values)

    def __len__(self) -> int:
        """Return the number of samples of the controller."""
        return sum(len(block) for block in self._blocks)

    def column(self, name: str) -> NDArray[np.float64]:
        """Return a channel, shape (n,); empty where there is none."""
        if name in self._others:
            return np.concatenate(self._others[name])
        parts = [block.values[name] for block in self._blocks if name in block.values]
        return np.concatenate(parts) if parts else np.zeros(0)

    def time_s(self) -> NDArray[np.float64]:
        """Return the controller's time stamps [s], shape (n,), from 0."""
        stamps = np.concatenate([block.time_us for block in self._blocks])
        return np.asarray((stamps - stamps[0]) / 1e6, dtype=np.float64)
