"""What the stand's transducers make of the truth: delay, noise, shape errors and counts.

Per sample only the delay of the force is computed, because the controller itself acts on it; everything else
is done for a whole slice of samples at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import Calibration, Channel

FloatArray = NDArray[np.float64]

_GATHER = 20


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


@dataclass(frozen=True)
class Converter:
    """How one channel is converted.

    Parameters
    ----------
    channel : Channel
        Its calibration must be of first degree: the simulation inverts it.
    low, high : float
        Range of the counts; beyond it the converter is saturated.
    noise : float
        Standard deviation, in the channel's unit.
    whole : bool
        Whether the counts are whole numbers.
    """

    channel: Channel
    low: float
    high: float
    noise: float
    whole: bool = True


class Converters:
    """Turns physical quantities into the raw counts of channels that are sampled together.

    Parameters
    ----------
    converters : sequence of Converter
    seed : numpy.random.SeedSequence
        Noise is drawn sample by sample, so that slices of any length draw the same.

    Raises
    ------
    BadInput
        If a calibration cannot be inverted.
    """

    def __init__(self, converters: Sequence[Converter], seed: np.random.SeedSequence) -> None:
        for converter in converters:
            try:
                converter.channel.calibration.counts_of(0.0)
            except ValueError:
                raise BadInput(
                    f"channel “{converter.channel.name}” has a calibration that is not of first degree",
                    place="calibration.coefficients",
                    remedy="the simulated stand needs [zero, slope] with a slope other than 0, or a table",
                ) from None
        self._calibrations = [converter.channel.calibration for converter in converters]
        straight = [_straight(calibration) for calibration in self._calibrations]
        self._curved = [column for column, line in enumerate(straight) if line is None]
        lines = [line or (0.0, 1.0) for line in straight]
        self._zero = np.array([line[0] for line in lines])
        self._slope = np.array([line[1] for line in lines])
        self._low = np.array([float(converter.low) for converter in converters])
        self._high = np.array([float(converter.high) for converter in converters])
        self._noise = np.array([converter.noise for converter in converters])
        self._fractional = [column for column, converter in enumerate(converters) if not converter.whole]
        self._random = np.random.Generator(np.random.PCG64(seed))

    def counts(self, values: FloatArray) -> FloatArray:
        """Return counts (as floats within the range) of values, shape (n, channels) each."""
        raw: FloatArray = self._random.standard_normal(values.shape)
        raw *= self._noise
        raw += values
        for column in self._curved:
            raw[:, column] = self._calibrations[column].counts_of(raw[:, column])
        raw -= self._zero
        raw /= self._slope
        fine = raw[:, self._fractional] if self._fractional else None
        np.rint(raw, out=raw)
        if fine is not None:
            raw[:, self._fractional] = fine
        np.maximum(raw, self._low, out=raw)  # half the time of numpy.clip for a slice of a few samples
        np.minimum(raw, self._high, out=raw)
        return raw

    def counts_of(self, column: int, value: FloatArray) -> FloatArray:
        """Return the counts of one channel's values, shape (n,) each, without noise."""
        if column in self._curved:
            raw = np.asarray(self._calibrations[column].counts_of(value), dtype=np.float64)
        else:
            raw = (value - self._zero[column]) / self._slope[column]
        if column not in self._fractional:
            raw = np.rint(raw)
        return np.clip(raw, self._low[column], self._high[column])

    def ends(self, column: int) -> tuple[float, float]:
        """Return the lowest and highest counts of a channel."""
        return float(self._low[column]), float(self._high[column])

    def values(self, counts: FloatArray) -> FloatArray:
        """Return the physical values of counts, same shape (…, channels)."""
        value: FloatArray = self._zero + self._slope * counts
        for column in self._curved:
            value[..., column] = self._calibrations[column].apply(counts[..., column])
        return value


def _straight(calibration: Calibration) -> tuple[float, float] | None:
    """Return zero and slope of a calibration that is a plain line; None for one with further stages."""
    plain = Calibration(coefficients=calibration.coefficients)
    line = calibration.coefficients
    same = calibration.model_copy(
        update={"id": plain.id, "certificate": "", "date": None, "valid_until": None}
    )
    return (line[0], line[1]) if same == plain and len(line) == 2 else None


class DrawWires:
    """What draw wires make of a stroke: a small smooth deviation each, and the plate's tilt.

    Parameters
    ----------
    linearity_mm : float
        Amplitude of the smooth deviation from the straight line [mm].
    tilt : float
        Half the relative difference of the wires: the plate tilts as it goes in.
    wires : int
        How many; they hang alternately on the one and on the other side of the plate.
    period_mm : float
        Stroke over which the deviation repeats [mm]; each wire is a quarter of it from the last.
    """

    def __init__(self, linearity_mm: float, tilt: float, wires: int = 2, period_mm: float = 250.0) -> None:
        self._linearity_mm = linearity_mm
        self._per_mm = 2.0 * np.pi / period_mm
        self._phase = np.array([0.3 + wire * np.pi / 2.0 for wire in range(wires)])
        self._start = np.sin(self._phase)
        self._gain = np.array([1.0 - tilt if wire % 2 else 1.0 + tilt for wire in range(wires)])

    def feel(self, stroke_mm: FloatArray) -> FloatArray:
        """Return what the wires feel of a true stroke of shape (n,): shape (n, wires)."""
        stroke = stroke_mm[:, np.newaxis]
        deviation = np.sin(self._per_mm * stroke + self._phase) - self._start
        felt: FloatArray = stroke * self._gain + self._linearity_mm * deviation
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
        self._pending: list[tuple[FloatArray, FloatArray]] = []
        self._gathered = 0

    def take(self, time_s: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return instants [s] and values that have become due with the next samples, shape (m,) each.

        Short slices are gathered first: nothing is lost, it comes a few samples later.
        """
        self._pending.append((time_s, value))
        self._gathered += time_s.shape[0]
        if self._gathered < _GATHER:
            return time_s[:0], value[:0]
        times = np.concatenate((self._time_s, *(part for part, _ in self._pending)))
        values = np.concatenate((self._value, *(part for _, part in self._pending)))
        self._pending.clear()
        self._gathered = 0
        until = int(np.floor(times[-1] * self._rate_Hz + 1e-9))
        due = np.arange(self._taken + 1, until + 1) / self._rate_Hz
        self._taken = max(self._taken, until)
        kept = np.searchsorted(times, times[-1] - self._delay_s - 2.0 / self._rate_Hz)
        first = max(0, int(kept) - 1)
        self._time_s, self._value = times[first:], values[first:]
        return due, np.interp(due - self._delay_s, times, values)
