"""A short stretch of samples that is judged as a whole: a touch, or the last seconds before a trip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.channels import STROKE_CHANNELS

Floats = NDArray[np.float64]

SMOOTHED_S = 0.02
"""Means over so long [s] are looked at: a period of the mains' hum goes with it."""


@dataclass(frozen=True)
class SampleStretch:
    """Samples of one clock, shape (n,) each, and those of the second force beside them.

    Parameters
    ----------
    time_s : NDArray
        Rising [s].
    values : mapping of str to NDArray
        The controller's channels.
    second_s, second_kN : NDArray
        Time on the same clock [s], to some 10 ms, and the second force; empty where there is none.
    """

    time_s: Floats
    values: Mapping[str, Floats]
    second_s: Floats = field(default_factory=lambda: np.empty(0))
    second_kN: Floats = field(default_factory=lambda: np.empty(0))

    def __len__(self) -> int:
        """Return how many samples there are of the controller."""
        return len(self.time_s)

    @property
    def wires(self) -> tuple[str, ...]:
        """Return the draw wires there are."""
        return tuple(name for name in self.values if name in STROKE_CHANNELS)

    @property
    def told(self) -> Floats | None:
        """Return where the piston was told to be; None where that is not sampled [mm]."""
        return self.values.get("command")

    def last(self, span_s: float) -> SampleStretch:
        """Return its last ``span_s`` seconds."""
        since_s = float(self.time_s[-1]) - span_s
        return self._where(self.time_s >= since_s, self.second_s >= since_s)

    def until(self, until_s: float) -> SampleStretch:
        """Return it up to an instant [s]."""
        return self._where(self.time_s <= until_s, self.second_s <= until_s)

    def _where(self, rows: NDArray[np.bool_], second: NDArray[np.bool_]) -> SampleStretch:
        values = {name: value[rows] for name, value in self.values.items()}
        return SampleStretch(self.time_s[rows], values, self.second_s[second], self.second_kN[second])

    def smoothed(self) -> SampleStretch:
        """Return means over :data:`SMOOTHED_S`, each at the middle of its time."""
        if len(self) < 3:
            return self
        width = self._width(self.time_s)
        values = {name: _means(value, width) for name, value in self.values.items()}
        time = self.time_s[width // 2 :][: len(self) - width + 1]
        if len(self.second_s) < 3:
            return SampleStretch(time, values, self.second_s, self.second_kN)
        wide = self._width(self.second_s)
        second_s = self.second_s[wide // 2 :][: len(self.second_s) - wide + 1]
        return SampleStretch(time, values, second_s, _means(self.second_kN, wide))

    @staticmethod
    def _width(time: Floats) -> int:
        period_s = float(np.median(np.diff(time)))
        return max(1, min(len(time), round(SMOOTHED_S / period_s) if period_s > 0.0 else 1))


def _means(values: Floats, width: int) -> Floats:
    return np.asarray(np.convolve(values, np.full(width, 1.0 / width), mode="valid"), dtype=np.float64)


def noise_of(values: Floats) -> float:
    """Return the standard deviation of noise from the differences of neighbours, whatever the trend."""
    if len(values) < 3:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(values)))) / float(np.sqrt(2.0))
