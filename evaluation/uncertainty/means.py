"""Means over the cycles of a run, with the uncertainty of the mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import CycleResult, Measured, Summary
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.uncertainty.monte_carlo import COVERAGE, NORMAL_95, half_width_95

LEAST_SCATTER = 3
"""The scatter between cycles counts from so many on."""


@dataclass
class MeanOfDraws:
    """Drawn figures summed over cycles: errors of the channels are common to all and do not average out.

    What differs from cycle to cycle within a draw is noise. Its variance is kept apart, to be averaged over
    all cycles used and not only over those drawn, and to be told from what the cycles really differ by.
    """

    sums: dict[str, FloatArray] = field(default_factory=dict)
    """Deviations from the mean of the draws, summed over cycles, shape (N,)."""
    squares: dict[str, float] = field(default_factory=dict)
    """Mean square of these deviations, summed over cycles."""
    counts: dict[str, int] = field(default_factory=dict)
    drawn: int = 0

    def add(self, drawn: Mapping[str, FloatArray]) -> None:
        """Add the drawn figures of one cycle, arrays of shape (N,) by name."""
        self.drawn += 1
        for name, values in drawn.items():
            deviation = values - np.mean(values)
            self.sums[name] = self.sums.get(name, 0.0) + deviation
            self.squares[name] = self.squares.get(name, 0.0) + float(np.mean(deviation**2))
            self.counts[name] = self.counts.get(name, 0) + 1

    def known(self, name: str) -> bool:
        """Say whether every cycle that was drawn gave draws of a figure."""
        return self.drawn > 0 and self.counts.get(name) == self.drawn

    def means(self) -> dict[str, FloatArray]:
        """Return the deviations of the mean of every known figure, shape (N,), by name."""
        return {name: own / self.drawn for name, own in self.sums.items() if self.known(name)}

    def noise_variance(self, name: str) -> float:
        """Return the variance that noise alone gives a figure of one cycle; 0 where one cycle was drawn."""
        if self.drawn < 2:
            return 0.0
        common = float(np.mean(self.sums[name] ** 2)) / self.drawn
        return max(0.0, self.squares[name] - common) / (self.drawn - 1)

    def variance(self, name: str) -> float:
        """Return the variance of the mean over the cycles that were drawn."""
        return float(np.mean(self.sums[name] ** 2)) / self.drawn**2

    def half_width_95(self, name: str) -> float:
        """Return the half-width about the mean that holds 95 % of the draws of that mean."""
        return half_width_95(self.sums[name]) / self.drawn


@dataclass(frozen=True)
class _Noise:
    """Variance by noise: expected between the cycles used, and of their mean."""

    between: float
    of_mean: float


def summarise(cycles: Sequence[CycleResult], used: tuple[int, ...], draws: MeanOfDraws) -> Summary:
    """Return the means over the cycles used.

    The standard uncertainty joins that of the channels, that of the noise, and what the cycles scatter by
    beyond their noise (from three cycles on). A figure that one of the cycles lacks has no mean.
    """
    numbers_used = set(used)
    chosen = [c for c in cycles if c.cycle.index in numbers_used]
    values = {}
    columns = zip(*(c.quantities for c in chosen), strict=True) if chosen else [()] * len(QUANTITIES)
    for name, column in zip(QUANTITIES.names, columns, strict=True):
        numbers = [number for number in column if number is not None]
        if not numbers or len(numbers) < len(chosen):
            values[name] = Measured(None, missing=_why_no_mean(chosen, name))
            continue
        mean = sum(numbers) / len(numbers)
        if not draws.known(name):
            values[name] = Measured(mean)
            continue
        single = draws.noise_variance(name)
        noise = _Noise(single, single / len(numbers))
        if name == "frequency_Hz":
            noise = _of_frequency(chosen)
        drawn = draws.variance(name)
        channels = max(0.0, drawn - single / draws.drawn)
        if draws.drawn == 1:
            channels, noise = drawn, _Noise(noise.between, 0.0)
        if name == "frequency_Hz":
            scatter = _frequency_beyond_noise(chosen, noise)
        else:
            scatter = _beyond_noise(numbers, noise)
        whole = channels + noise.of_mean
        half_width = draws.half_width_95(name) * float(np.sqrt(whole / drawn)) if drawn > 0.0 else 0.0
        values[name] = Measured(
            mean,
            COVERAGE * float(np.hypot(np.sqrt(whole), scatter)),
            COVERAGE,
            float(np.hypot(half_width, NORMAL_95 * scatter)),
            scatter,
        )
    return Summary(used, values)


def _why_no_mean(chosen: Sequence[CycleResult], name: str) -> str:
    """Return why there is no mean: no cycle stands for it, or the first that lacks the figure, and why."""
    lacking = next((one for one in chosen if name in one.missing), None)
    if lacking is None:
        return "no cycle is complete and steady"
    return f"cycle {lacking.cycle.index}: {lacking.missing[name]}"


def _beyond_noise(numbers: Sequence[float], noise: _Noise) -> float:
    """Return the standard uncertainty of a mean by what its numbers scatter beyond their noise (type A).

    The noise itself is in the draws already. Where the numbers scatter more, the noise of their mean is
    larger by the same ratio (that of Birge).
    """
    if len(numbers) < LEAST_SCATTER:
        return 0.0
    found = float(np.var(numbers, ddof=1))
    excess = max(0.0, found - noise.between)
    share = noise.of_mean / noise.between if noise.between > 0.0 else 1.0 / len(numbers)
    return float(np.sqrt(excess * min(share, 1.0)))


def _frequency_beyond_noise(chosen: Sequence[CycleResult], noise: _Noise) -> float:
    """Return the same for frequencies, whose noise differs much from cycle to cycle: each by its own."""
    if len(chosen) < LEAST_SCATTER:
        return 0.0
    each = np.array([1.0 / c.cycle.duration_s for c in chosen])
    variance = each**4 * np.array([_duration_variance(c) for c in chosen])
    if not np.all(variance > 0.0):
        return _beyond_noise(each.tolist(), noise)
    ratio = float(np.mean((each - np.average(each, weights=1.0 / variance)) ** 2 / variance))
    # Where their noise differs much, those of little noise make the ratio, those of much the other factor.
    return min(float(np.sqrt(noise.of_mean * max(0.0, ratio - 1.0))), float(np.std(each, ddof=1)))


def _duration_variance(result: CycleResult) -> float:
    return result.cycle.start.u_leave_s**2 + result.cycle.end.u_time_s**2


def _of_frequency(chosen: Sequence[CycleResult]) -> _Noise:
    """Return the noise of frequencies: the end of a cycle is the start of the next, so that one error of its
    moment makes one cycle longer and the other shorter, and leaves their mean.
    """
    count = len(chosen)
    own = total = 0.0
    shared: float | None = None  # net weight of the error of the moment at which the last cycle ended
    before = None
    for result in chosen:
        cycle = result.cycle
        weight = 1.0 / cycle.duration_s**2
        joined = before is not None and before == cycle.start and cycle.start.dwell_s == 0.0
        at_start = (shared if joined and shared is not None else 0.0) + weight
        if shared is not None and not joined and before is not None:
            total += (shared * before.u_time_s) ** 2
        total += (at_start * cycle.start.u_leave_s) ** 2
        own += weight**2 * _duration_variance(result)
        shared, before = -weight, cycle.end
    if before is not None and shared is not None:
        total += (shared * before.u_time_s) ** 2
    between = (own - total / count) / (count - 1) if count > 1 else 0.0
    return _Noise(between, total / count**2)
