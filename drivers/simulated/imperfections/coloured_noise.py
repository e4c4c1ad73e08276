"""Noise that is not white: flicker, as amplifiers have it, and the mains.

Flicker is the sum of first-order (Ornstein–Uhlenbeck) processes of equal variance whose time constants are
a decade apart; their spectra add to one that falls as 1/f between the slowest and the fastest corner (M. S.
Keshner, 1/f noise, Proc. IEEE 70 (1982) 212). Each is exact from sample to sample, ``x' = a x + √(1 − a²) n``
with ``a = exp(−dt/τ)``, and begins in its stationary state.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

FloatArray = NDArray[np.float64]

TIME_CONSTANTS_S = (0.03, 0.3, 3.0)
"""Corners at 5.3, 0.53 and 0.053 Hz."""
MAINS_HZ = 50.0
_AHEAD = 512  # samples made at once: a slice of a few costs as much as one of hundreds


class ColouredNoise:
    """Adds flicker and hum to channels that are sampled together; slices of any length get the same.

    Parameters
    ----------
    flicker : sequence of float
        Standard deviation by channel, in its unit.
    hum : sequence of float
        Amplitude of the mains by channel.
    dt_s : float
        Sample period [s].
    seed : numpy.random.SeedSequence
    """

    def __init__(
        self, flicker: Sequence[float], hum: Sequence[float], dt_s: float, seed: np.random.SeedSequence
    ) -> None:
        self._share = np.array(flicker) / np.sqrt(len(TIME_CONSTANTS_S))
        self._hum = np.array(hum)
        self._random = np.random.Generator(np.random.PCG64(seed))
        self._keeps = np.exp(-dt_s / np.array(TIME_CONSTANTS_S))
        self._gains = np.sqrt(1.0 - self._keeps**2)
        self._state = self._random.standard_normal((len(TIME_CONSTANTS_S), 1, len(flicker)))

        self._made: FloatArray = np.empty((len(TIME_CONSTANTS_S), 0, len(flicker)))
        self._used = 0

    def add(self, time_s: FloatArray, values: FloatArray) -> None:
        """Add to values, shape (n, channels), of samples at times [s], shape (n,), in place."""
        if np.any(self._share):
            for made in self._next(len(time_s)):
                values += made
        if np.any(self._hum):
            values += self._hum * np.sin(2.0 * np.pi * MAINS_HZ * time_s)[:, np.newaxis]

    def _next(self, count: int) -> FloatArray:
        """Return the flicker of the next samples, shape (scales, count, channels)."""
        left = self._made.shape[1] - self._used
        if left < count:
            fresh = self._make(max(_AHEAD, count - left))
            self._made = np.concatenate((self._made[:, self._used :], fresh), axis=1)
            self._used = 0
        self._used += count
        return self._made[:, self._used - count : self._used]

    def _make(self, count: int) -> FloatArray:
        """Go on with each process for ``count`` samples, shape (scales, count, channels)."""
        scales, _, channels = self._made.shape
        drawn = self._random.standard_normal((count, scales, channels))
        made = np.empty((scales, count, channels))
        for scale, (keep, gain) in enumerate(zip(self._keeps, self._gains, strict=True)):
            made[scale], self._state[scale] = _first_order(drawn[:, scale], keep, gain, self._state[scale])
        made *= self._share
        return made


def _first_order(
    drawn: FloatArray, keep: float, gain: float, last: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the process driven by ``drawn`` (n, channels) and its last value, (1, channels)."""
    band = np.ones((2, drawn.shape[0]))
    band[1] = -keep  # x[i] − keep x[i − 1] = gain n[i]; scipy.signal's filter takes half a second to import
    driven = gain * drawn
    driven[:1] += keep * last
    made, _ = dtbtrs(band, driven, uplo="L", diag="U")
    return made, made[-1:]
