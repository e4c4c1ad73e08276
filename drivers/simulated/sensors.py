"""What the stand's transducers make of the truth: delay, noise, shape errors and counts.

Per sample only the delay of the force is computed, because the controller itself acts on it; everything else
is done for a whole slice of samples at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foundation.channel import Channel
from foundation.errors import BadInput

FloatArray = NDArray[np.float64]


class Delay:
    """A signal path that delays, and optionally smooths, one signal.

    Parameters
    ----------
    delay_s : float
        Pure delay [s]; between two samples the signal is taken as straight.
    dt_s : float
        Sample period [s].
    low_pass_Hz : float, optional
        Corner frequency of a first-order low pass behind it; None for none.
    """

    def __init__(self, delay_s: float, dt_s: float, low_pass_Hz: float | None = None) -> None:
        if delay_s < 0.0:
            raise ValueError(f"a delay cannot be negative, got {delay_s}")
        whole = int(delay_s / dt_s)
        self._fraction = delay_s / dt_s - whole
        self._past = [0.0] * (whole + 2)
        self._at = 0
        omega_dt = None if low_pass_Hz is None else 2.0 * np.pi * low_pass_Hz * dt_s
        self._gain = 1.0 if omega_dt is None else float(-np.expm1(-omega_dt))
        self._smooth = 0.0

    def push(self, value: float) -> float:
        """Take the signal's present value; return what leaves the path now."""
        past = self._past
        at = self._at
        past[at] = value
        at += 1
        if at == len(past):
            at = 0
        self._at = at
        older = past[at]  # whole + 1 samples ago
        newer = past[at + 1 if at + 1 < len(past) else 0]
        delayed = newer + self._fraction * (older - newer)
        self._smooth += self._gain * (delayed - self._smooth)
        return self._smooth

    def settle(self, value: float) -> None:
        """Let the path come to rest at a constant value."""
        self._past = [value] * len(self._past)
        self._smooth = value


class CountedChannel:
    """Turns a physical quantity into a channel's raw counts, with noise.

    Parameters
    ----------
    channel : Channel
        Its calibration must be of first degree: the simulation inverts it.
    low, high : int
        Range of the counts; beyond it the converter is saturated.
    noise : float
        Standard deviation, in the channel's unit.
    seed : numpy.random.SeedSequence
        Of this channel's own noise, so that slices of any length draw the same sequence.

    Raises
    ------
    BadInput
        If the calibration cannot be inverted.
    """

    def __init__(
        self, channel: Channel, low: int, high: int, noise: float, seed: np.random.SeedSequence
    ) -> None:
        coefficients = channel.calibration.coefficients
        if len(coefficients) != 2 or coefficients[1] == 0.0:
            raise BadInput(
                f"channel “{channel.name}” has a calibration that is not of first degree",
                place="calibration.coefficients",
                remedy="the simulated stand needs [zero, slope] with a slope other than 0",
            )
        self._zero, self._slope = coefficients
        self._low, self._high = low, high
        self._noise = noise
        self._random = np.random.Generator(np.random.PCG64(seed))

    def counts(self, value: FloatArray) -> FloatArray:
        """Return whole counts (as floats within the range) of values of shape (n,)."""
        noisy = value
        if self._noise > 0.0:
            noisy = value + self._noise * self._random.standard_normal(value.shape[0])
        raw: FloatArray = np.clip(np.rint((noisy - self._zero) / self._slope), self._low, self._high)
        return raw

    def value(self, counts: float) -> float:
        """Return the physical value of counts."""
        return self._zero + self._slope * counts


@dataclass(frozen=True)
class WireErrors:
    """What a pair of draw wires does to a stroke.

    Parameters
    ----------
    linearity_mm : float
        Amplitude of the smooth deviation from the straight line [mm].
    period_mm : float
        Stroke over which the deviation repeats [mm]; the wires are a quarter of it apart.
    tilt : float
        Half the relative difference of the wires: the plate tilts as it goes in.
    """

    linearity_mm: float = 0.03
    period_mm: float = 250.0
    tilt: float = 0.001

    def apply(self, stroke_mm: FloatArray, wire: int) -> FloatArray:
        """Return what wire 1 or 2 feels of a true stroke, shape (n,)."""
        side = 1.0 if wire == 1 else -1.0
        shape = np.sin(2.0 * np.pi / self.period_mm * stroke_mm + (0.3 if wire == 1 else 0.3 + np.pi / 2))
        start = np.sin(0.3 if wire == 1 else 0.3 + np.pi / 2)
        felt: FloatArray = stroke_mm * (1.0 + side * self.tilt) + self.linearity_mm * (shape - start)
        return felt


class Resampler:
    """Takes a signal that is known at the samples of one device at the instants of another.

    Parameters
    ----------
    rate_Hz : float
        Of the other device, in stand time.
    delay_s : float
        Of the other device's path [s].
    """

    def __init__(self, rate_Hz: float, delay_s: float) -> None:
        self._rate_Hz = rate_Hz
        self._delay_s = delay_s
        self._taken = 0
        self._time_s = np.zeros(1)
        self._value = np.zeros(1)

    def take(self, time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return instants [s] and values that have become due with the next samples, shape (m,) each."""
        times = np.concatenate((self._time_s, time_s))
        values = np.concatenate((self._value, value))
        until = int(np.floor(times[-1] * self._rate_Hz + 1e-9))
        due = np.arange(self._taken + 1, until + 1) / self._rate_Hz
        self._taken = max(self._taken, until)
        kept = np.searchsorted(times, times[-1] - self._delay_s - 2.0 / self._rate_Hz)
        first = max(0, int(kept) - 1)
        self._time_s, self._value = times[first:], values[first:]
        return due, np.interp(due - self._delay_s, times, values)
