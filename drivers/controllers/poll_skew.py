"""The time between the parts of a polled sample: measured, with its effect on a figure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

KEPT = 10_000
"""Polls that a statement is made of at most."""
TYPICAL_DAMPING = 0.23
"""W_a/W_s of a buffer over 40 mm, of which a statement is made: a smaller one suffers more by a skew."""


@dataclass(frozen=True)
class PolledAt:
    """When one poll was made.

    Parameters
    ----------
    middle_s : tuple of float
        Middle of each read, by stand time [s].
    round_trip_s : tuple of float
        Duration of each read [s].
    """

    middle_s: tuple[float, ...]
    round_trip_s: tuple[float, ...]


@dataclass(frozen=True)
class ReadSkew:
    """Statistics of one read against the one that stamps the sample.

    Parameters
    ----------
    mean_s, spread_s : float
        Mean and standard deviation of its middle minus the stamp [s].
    u_s : float
        Standard uncertainty of a value's time about stamp plus mean: the spread, and the unknown instant
        inside both round trips (rectangular) [s].
    p50_s, p99_s : float
        Of its round trip [s].
    """

    mean_s: float
    spread_s: float
    u_s: float
    p50_s: float
    p99_s: float


def damping_error(damping: float, frequency_Hz: float, skew_s: float, mean_force_ratio: float = 1.0) -> float:
    """Return what a skew changes of a damping D = W_a/W_s, as a share of it, to first order.

    With a sine stroke, W_a = π F_a x_a sin δ and W_s = 2 x_a F_m + W_a/2. A skew τ turns δ by ω τ, and half
    of what W_a changes by is W_s's, too: ΔD/D = (1 - D/2) ω τ / tan δ, sin δ = (2/π) (F_m/F_a) D / (1 - D/2).

    Parameters
    ----------
    damping : float
        W_a/W_s, as the evaluation defines it (EN 15551), above 0. It is no loss factor.
    frequency_Hz, skew_s : float
    mean_force_ratio : float
        Mean force over force amplitude; 1 where the spring is just relieved in each cycle, and more with a
        prestress, whose error is smaller.

    Raises
    ------
    ValueError
        If no sine loop has this damping.
    """
    remaining = 1.0 - damping / 2.0
    sine = 2.0 / math.pi * mean_force_ratio * damping / remaining
    if not 0.0 < sine < 1.0:
        raise ValueError(
            f"no sine loop has a damping of {damping:g} at a mean force ratio {mean_force_ratio:g}"
        )
    return remaining * 2.0 * math.pi * frequency_Hz * skew_s * math.sqrt(1.0 - sine**2) / sine


class SkewMeter:
    """Collects when polls were made.

    Parameters
    ----------
    reads : sequence of sequence of str
        Channels of each read.
    stamping : str
        Channel whose read gives the sample its time.
    """

    def __init__(self, reads: Sequence[Sequence[str]], stamping: str) -> None:
        self._reads = [tuple(read) for read in reads]
        self.stamp_index = next(i for i, read in enumerate(self._reads) if stamping in read)
        self._polls: deque[PolledAt] = deque(maxlen=KEPT)

    def add(self, poll: PolledAt) -> None:
        """Take one poll."""
        self._polls.append(poll)

    def __len__(self) -> int:
        return len(self._polls)

    def clear(self) -> None:
        """Begin anew."""
        self._polls.clear()

    def skews(self) -> Mapping[str, ReadSkew]:
        """Return the statistics by channel; every channel of one read has the same.

        Raises
        ------
        ValueError
            If nothing was polled.
        """
        if not self._polls:
            raise ValueError("no poll to make a statement of")
        middle = np.array([poll.middle_s for poll in self._polls])
        trip = np.array([poll.round_trip_s for poll in self._polls])
        offset = middle - middle[:, [self.stamp_index]]
        # An instant anywhere inside a round trip, about its middle: half-width / sqrt(3) (GUM 4.3.7).
        inside = np.mean(trip, axis=0) / 2.0 / math.sqrt(3.0)
        found: dict[str, ReadSkew] = {}
        for index, read in enumerate(self._reads):
            spread = float(np.std(offset[:, index]))
            apart = index != self.stamp_index
            u_s = math.hypot(spread, float(inside[index]), float(inside[self.stamp_index]) if apart else 0.0)
            p50, p99 = (float(value) for value in np.percentile(trip[:, index], (50, 99)))
            found |= dict.fromkeys(read, ReadSkew(float(np.mean(offset[:, index])), spread, u_s, p50, p99))
        return found

    def text(self, rate_Hz: float) -> str:
        """Return what the polling costs, in words."""
        skews = self.skews()
        force, stroke = skews["force"], skews["stroke_1"]
        slow, fast = (_percent(frequency_Hz, force.u_s) for frequency_Hz in (1.0, 2.5))
        return (
            f"POLLED, not sampled by the device: {rate_Hz:g} polls/s by the computer's clock; force is read "
            f"{force.mean_s * 1e3:+.3f} ms from stroke (standard deviation {force.spread_s * 1e3:.3f} ms; "
            f"mean corrected), round trip of force {force.p50_s * 1e3:.2f}, p99 {force.p99_s * 1e3:.2f} "
            f"ms, of stroke {stroke.p50_s * 1e3:.2f}, {stroke.p99_s * 1e3:.2f} ms; u(delay) = "
            f"{force.u_s * 1e3:.3f} ms, which makes the damping uncertain by {slow} at 1 Hz and {fast} at "
            f"2.5 Hz (of a W_a/W_s of {TYPICAL_DAMPING:g}; {len(self)} polls)"
        )


def _percent(frequency_Hz: float, u_s: float) -> str:
    """Return the standard uncertainty of a damping, in words; the law is linear for small errors only."""
    percent = 100.0 * damping_error(TYPICAL_DAMPING, frequency_Hz, u_s)
    return f"{percent:.2g} %" if percent < 50.0 else "more than 50 %"
