"""Samples of a stretch of time, kept to be looked at afterwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards import CONTROLLER_STREAM
from bufferstand.daq.scaling import ScaledBlock


class CollectedSamples:
    """Samples of a stretch of time, of the controller and of a second way to the force."""

    def __init__(self) -> None:
        self._blocks: list[ScaledBlock] = []
        self._others: dict[str, list[NDArray[np.float64]]] = {}
        self._other_us: dict[str, list[NDArray[np.int64]]] = {}

    def take(self, block: ScaledBlock) -> None:
        """Take a block of any stream."""
        if block.stream == CONTROLLER_STREAM:
            self._blocks.append(block)
            return
        for name, values in block.values.items():
            self._others.setdefault(name, []).append(values)
            self._other_us.setdefault(name, []).append(block.time_us)

    def __len__(self) -> int:
        """Return the number of samples of the controller."""
        return sum(len(block) for block in self._blocks)

    def column(self, name: str) -> NDArray[np.float64]:
        """Return a channel, shape (n,); empty where there is none."""
        if name in self._others:
            return np.concatenate(self._others[name])
        parts = [block.values[name] for block in self._blocks if name in block.values]
        return np.concatenate(parts) if parts else np.zeros(0)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the controller's channels there are."""
        return tuple(self._blocks[0].values) if self._blocks else ()

    def other_time_s(self, name: str, *, device_clock: bool) -> NDArray[np.float64]:
        """Return the times of another stream's channel on the controller's clock, as :meth:`time_s` [s].

        Parameters
        ----------
        name : str
            The channel, of a stream that the host stamps.
        device_clock : bool
            Whether the controller stamps by its own clock: the least delay of its blocks tells the offset.
        """
        if name not in self._other_us or not self._blocks:
            return np.zeros(0)
        delays = [block.received_s - float(block.time_us[-1]) / 1e6 for block in self._blocks if len(block)]
        offset_s = min(delays) if device_clock else 0.0
        first_s = float(self._blocks[0].time_us[0]) / 1e6
        stamps = np.concatenate(self._other_us[name]) / 1e6 - offset_s - first_s
        return np.asarray(stamps, dtype=np.float64)

    def at_controller(self, name: str, *, device_clock: bool) -> NDArray[np.float64]:
        """Return a channel at the instants of the controller's samples, shape (n,): interpolated of others.

        Parameters
        ----------
        name : str
        device_clock : bool
            As for :meth:`other_time_s`.
        """
        own_s = self.other_time_s(name, device_clock=device_clock)
        if not own_s.size:
            return self.column(name)
        return np.asarray(np.interp(self.time_s(), own_s, self.column(name)))

    def time_s(self) -> NDArray[np.float64]:
        """Return the controller's time stamps [s], shape (n,), from 0."""
        stamps = np.concatenate([block.time_us for block in self._blocks])
        return np.asarray((stamps - stamps[0]) / 1e6, dtype=np.float64)
