"""The noise of force and stroke over frequency, from the record itself.

White noise of N samples averages out with √N. Mains hum and noise with correlated neighbours (coloured) do
not. What noise makes of a figure follows from its density over frequency: of a figure that is
∫ w(t) n(t) dt the variance is ∫ S(f) |W(f)|² df (two-sided density S, W the Fourier transform of w).

The density comes from what motion does not explain. Differences of high order of means over 1, 2, 4 … samples
see all that is faster than some 25 harmonics of a cycle; below that, what cycles that follow each other
differ by shows it, or what the readings of a rest between strokes do. Below the slowest that is seen it is
taken to go on as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bufferstand.evaluation.cycles import EASED_S
from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.loops import InertiaForce
from bufferstand.evaluation.numerics import (
    FloatArray,
    HumLine,
    difference_sigma,
    lines_of,
    noise_sigma,
    without_lines,
)
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.hum_at_rests import (
    beside_lines,
    lines_at_rests,
    without_resting_lines,
)

BLOCKS_A_CYCLE = 64
"""Means over blocks count while a cycle has so many: fifth differences of a loop's fifth harmonic leave 1e-5
of its range then."""
_LEAST_BLOCKS = 256
"""Blocks on a record from which their differences say something."""
_PLACE = 0.4
"""Differences of means over a time see mostly this frequency, as a share of one over that time."""
_MOST_THREES = 12
"""So often three cycles in a row are compared."""
_OF_SECOND_DIFFERENCE = 6.0
"""Variance of a second difference in that of its values: 1 + 4 + 1."""
_SINE = 0.1
"""Up to this distortion a stroke repeats as sines do."""
_LEAST_POINTS = 24
_LOWEST = 3
"""Harmonic from which on cycles are compared: below, they drift and settle, and that is taken out of them."""
_INTERPOLATED = 5
"""Samples a period down to which a cubic between samples keeps what noise there is."""
_LEAST_FREEDOM = 16
"""Values of which a density is the mean, at least."""
_MOST_SAMPLES = 2**16
_ROWS, _ROW = 4, 2**14
"""Of a longer record so many stretches of so many samples are looked at."""


_LEAST_REST, _MOST_REST, _LEAST_PIECES = 64, 2048, 4
"""Samples of a piece of a rest in which slow noise is looked for, and pieces that there shall be."""
_EVEN = 1.02
"""A piece lacks no samples that takes no longer than so much of their usual step."""
_SLOWER = 1.5
"""Noise that is by so much denser than where it was seen last is slower: a mean of 16 is not so by chance."""

Point = tuple[float, float]
"""Frequency and density."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Two-sided density of a channel's noise [unit²/Hz], shape (K,), at rising frequencies; and hum.

    ``step_s``: distance of the samples it was found in. Between its frequencies it is interpolated by powers,
    beyond them it is level.
    """

    frequency_Hz: FloatArray
    density: FloatArray
    step_s: float
    lines: tuple[HumLine, ...] = ()

    def at(self, frequency_Hz: FloatArray) -> FloatArray:
        """Return the density at frequencies, 0 beyond what the samples can show."""
        frequency = np.log(np.maximum(frequency_Hz, 1e-12))
        found = np.exp(np.interp(frequency, *self._powers))
        return np.where(frequency_Hz <= 0.5 / self.step_s * (1.0 + 1e-9), found, 0.0)

    @cached_property
    def _powers(self) -> tuple[FloatArray, FloatArray]:
        """Logarithms of its frequencies and densities."""
        return np.log(self.frequency_Hz), np.log(np.maximum(self.density, 1e-300))

    def variance(self, time_s: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the variance of sums of noise over points of a curve [unit²], shape (...,).

        Parameters
        ----------
        time_s : array, shape (M,)
            Moments of the points. A point is one sample, the mean of some, or read between them.
        weights : array, shape (..., M)
            What the noise of each counts in the sum.
        """
        cell = np.gradient(time_s)
        density = weights / np.where(cell > 0.0, cell, np.inf)
        even_s = np.linspace(time_s[0], time_s[-1], time_s.size)
        if np.ptp(cell) > 1e-6 * even_s[-1] / even_s.size:
            rows = [np.interp(even_s, time_s, row) for row in density.reshape(-1, time_s.size)]
            density = np.stack(rows).reshape(density.shape)
        step_s = float(even_s[1] - even_s[0])
        size = 1 << int(2 * time_s.size - 1).bit_length()
        frequency_Hz = np.fft.rfftfreq(size, step_s)
        power = np.abs(np.fft.rfft(density, size) * step_s) ** 2
        power[..., 1:-1] *= 2.0
        # Of points that are means of samples the faster noise is folded: white noise stays what it is.
        total = power @ self.at(np.minimum(frequency_Hz, 0.5 / self.step_s)) * frequency_Hz[1]
        for line in self.lines:
            wave = np.exp(-2j * np.pi * line.frequency_Hz * even_s)
            total = total + 0.5 * line.amplitude**2 * np.abs(density @ wave * step_s) ** 2
        return np.asarray(total)

    def mean_variance(self, samples: float) -> float:
        """Return the variance of the mean of so many neighbouring samples [unit²]."""
        points = max(8, min(256, round(4.0 * samples)))
        moments = np.linspace(0.0, samples * self.step_s, points, endpoint=False)
        return float(self.variance(moments, np.full(points, 1.0 / points)))

    def summit_variance(self, samples: float) -> float:
        """Return the variance of the summit of a parabola through so many neighbouring samples [unit²].

        It sees waves down to two thirds of their length, which the mean of as many samples does not.
        """
        points = max(8, min(256, round(4.0 * samples)))
        moments = np.linspace(0.0, samples * self.step_s, points, endpoint=False)
        place = (2.0 * np.arange(points) + 1.0) / points - 1.0
        return float(self.variance(moments, 0.75 * (3.0 - 5.0 * place**2) / points))

    def series(self, generator: np.random.Generator, rows: int, points: int, step_s: float) -> FloatArray:
        """Return made noise of even points, shape (rows, points): as samples, or as a curve through them."""
        size = 1 << int(2 * points - 1).bit_length()
        frequency_Hz = np.asarray(np.fft.rfftfreq(size, step_s), dtype=np.float64)
        random = generator.standard_normal((2, rows, frequency_Hz.size))
        # Of points that are means of samples the faster noise is folded; a curve through samples has none.
        shown_Hz = frequency_Hz if step_s < self.step_s else np.minimum(frequency_Hz, 0.5 / self.step_s)
        root = np.sqrt(0.5 * self.at(shown_Hz) * size / step_s)
        root[[0, -1]] *= np.sqrt(2.0)  # these two have no imaginary part
        made = np.fft.irfft((random[0] + 1j * random[1]) * root, size)
        found = made[:, :points]
        for line in self.lines:
            phase = 2.0 * np.pi * generator.random((rows, 1))
            found = found + line.amplitude * np.cos(
                2.0 * np.pi * line.frequency_Hz * step_s * np.arange(points) + phase
            )
        return found

    @cached_property
    def sigma(self) -> float:
        """Standard deviation of a sample's noise, of whatever frequency."""
        frequency = np.linspace(0.0, 0.5 / self.step_s, 2001)
        hum = sum(0.5 * line.amplitude**2 for line in self.lines)
        return float(np.sqrt(2.0 * np.trapezoid(self.at(frequency), frequency) + hum))


def white(sigma: float, step_s: float) -> Spectrum:
    """Return the density of white noise of samples."""
    return Spectrum(np.array([1.0 / step_s]), np.array([sigma**2 * step_s]), step_s)


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of force [kN] and stroke [mm], estimated from the record.

    Standard deviations of the white noise of a sample, and the densities; without one the noise is white.
    ``force_lines``: hum on the force, which is an error of its own
    (:mod:`bufferstand.evaluation.uncertainty.hum_and_drift`).
    """

    force_kN: float
    stroke_mm: float
    force: Spectrum | None = None
    stroke: Spectrum | None = None
    force_lines: tuple[HumLine, ...] = ()


def record_noise(record: Record, inertia: InertiaForce | None = None, cycles: Sequence[Cycle] = ()) -> Noise:
    """Return the noise of force and stroke.

    The noise of an acceleration is smooth, so that differences do not show it: it is added.

    Parameters
    ----------
    record : Record
    inertia : InertiaForce, optional
        What the correction for a moving mass added.
    cycles : sequence of Cycle
        Complete ones, in order. Without them the noise is taken for white.
    """
    time_s, forces, strokes = map(record.as_read, (record.time_s, record.force_kN, record.stroke_mm))
    force_kN, stroke_mm = noise_sigma(forces), record.stroke_sampling.sigma
    force, stroke = (
        _spectrum(time_s, values, sigma, cycles)
        for values, sigma in ((forces, force_kN), (strokes, stroke_mm))
    )
    if inertia is not None:
        added = inertia.noise_kN
        force_kN = float(np.hypot(force_kN, added))
        if force is not None:
            density = force.density + added**2 * force.step_s
            force = Spectrum(force.frequency_Hz, density, force.step_s, force.lines)
    lines = () if force is None else force.lines
    if force is not None:
        force = replace(force, lines=())
    return Noise(force_kN, stroke_mm, force, stroke, lines)


def stroke_spectrum(record: Record, cycles: Sequence[Cycle]) -> Spectrum | None:
    """Return the density of the stroke's noise alone, as :func:`record_noise` has it."""
    time_s, strokes = map(record.as_read, (record.time_s, record.stroke_mm))
    return _spectrum(time_s, strokes, record.stroke_sampling.sigma, cycles)


def _spectrum(
    time_s: FloatArray, values: FloatArray, sigma: float, cycles: Sequence[Cycle]
) -> Spectrum | None:
    """Return the density of a channel's noise; None where there is none, or nothing to tell its colour by."""
    if not cycles or time_s.size < _LEAST_BLOCKS or sigma <= 0.0:
        return None
    step_s = float(np.median(np.diff(time_s[:_MOST_SAMPLES])))
    lengths_s = [cycle.duration_s for cycle in cycles]
    cycle_s = min(lengths_s)
    rows = _stretches(values)
    lines = lines_of(rows, step_s, cycle_s, float(np.median(lengths_s)))
    resting = () if lines else lines_at_rests(time_s, values, cycles, step_s)
    rows = without_lines(rows, step_s, lines) if lines else without_resting_lines(rows, step_s, resting)
    if lines := lines or resting:
        sigma = noise_sigma(rows.ravel())
    fast = beside_lines(_by_differences(rows, step_s, cycle_s, sigma), step_s, resting)
    slow = _by_cycles(time_s, values, cycles, lines)
    lowest = fast[0][0] if slow else np.inf
    both = [point for point in slow if point[0] < lowest] + fast
    rests = [] if slow else _by_rests(time_s, values, cycles, lines, step_s)
    if any(f < fast[0][0] and density > _SLOWER * fast[0][1] for f, density in rests):
        both = rests + [point for point in fast if point[0] > rests[-1][0]]
    frequency, density = np.array(both).T
    return Spectrum(frequency, density, step_s, lines)


def _stretches(values: FloatArray) -> FloatArray:
    if values.size <= _MOST_SAMPLES:
        return values[None, :]
    starts = np.linspace(0, values.size - _ROW, _ROWS).astype(np.intp)
    return np.stack([values[start : start + _ROW] for start in starts])


def _by_differences(rows: FloatArray, step_s: float, cycle_s: float, sigma: float) -> list[Point]:
    """Return frequencies and densities by differences of means over blocks, slowest first."""
    found = [(_PLACE / step_s, sigma**2 * step_s)]
    size = 2
    while size * step_s * BLOCKS_A_CYCLE <= cycle_s and rows.size // size >= _LEAST_BLOCKS:
        whole = rows.shape[1] // size * size
        means = rows[:, :whole].reshape(rows.shape[0], -1, size).mean(axis=2)
        spread = np.median([difference_sigma(row) for row in means])
        found.append((_PLACE / (size * step_s), float(spread) ** 2 * size * step_s))
        size *= 2
    return found[::-1]


def _by_cycles(
    time_s: FloatArray, values: FloatArray, cycles: Sequence[Cycle], lines: Sequence[HumLine]
) -> list[Point]:
    """Return frequencies and densities by what three cycles in a row differ by, slowest first.

    Only where the stroke is as good as a sine: cycles of a static test differ because the specimen settles.
    """
    threes = [
        (one, middle, other)
        for one, middle, other in zip(cycles, cycles[1:], cycles[2:], strict=False)
        if other.index == one.index + 2 and all(_repeats(c) for c in (one, middle, other))
    ]
    if not threes:
        return []
    chosen = np.unique(np.linspace(0, len(threes) - 1, _MOST_THREES).round().astype(int))
    inside = [np.diff(np.searchsorted(time_s, (c.start_s, c.end_s)))[0] for i in chosen for c in threes[i]]
    points = min(2048, int(min(inside)))
    if points < _LEAST_POINTS:
        return []
    power = np.stack([_difference_power(time_s, values, threes[i], points, lines) for i in chosen])
    return _in_bands(power, float(np.mean([threes[i][1].duration_s for i in chosen])))


def _by_rests(
    time_s: FloatArray, values: FloatArray, cycles: Sequence[Cycle], lines: Sequence[HumLine], step_s: float
) -> list[Point]:
    """Return frequencies and densities by the readings of rests between cycles, slowest first.

    A parabola takes out what relaxes and drifts; without what a stand eases at either end of the rest.
    """
    turns = {
        (turn.time_s, turn.leave_s) for c in cycles for turn in (c.start, c.end) if turn.dwell_s > EASED_S
    }
    ends_s = np.array(sorted(turns)).reshape(-1, 2) + np.array((EASED_S, -EASED_S))
    ends = np.searchsorted(time_s, ends_s)
    length = np.maximum(ends[:, 1] - ends[:, 0], 0)
    most = min(int(np.max(length, initial=0)), int(np.sum(length)) // _LEAST_PIECES, _MOST_REST)
    if most < _LEAST_REST:
        return []
    size = 1 << (most.bit_length() - 1)
    starts = [at for first, last in ends.tolist() for at in range(first, last - size + 1, size)]
    pieces = [slice(at, at + size) for at in starts]
    even = [p for p in pieces if time_s[p.stop - 1] - time_s[p.start] <= _EVEN * (size - 1) * step_s]
    if not even:
        return []
    return _in_bands(np.stack([_power(time_s[p], values[p], lines, step_s) for p in even]), size * step_s)


def _power(time_s: FloatArray, values: FloatArray, lines: Sequence[HumLine], step_s: float) -> FloatArray:
    """Return the density of what a parabola and hum leave of even samples, shape (N // 2 + 1,)."""
    phase = np.arange(values.size) / values.size
    waves = [2.0 * np.pi * line.frequency_Hz * time_s for line in lines]
    known = [np.ones(values.size), phase, phase**2, *map(np.cos, waves), *map(np.sin, waves)]
    matrix = np.stack(known, axis=1)
    found, *_ = np.linalg.lstsq(matrix, values, rcond=None)
    window = 1.0 - np.cos(2.0 * np.pi * phase)
    power = np.abs(np.fft.rfft((values - matrix @ found) * window)) ** 2
    return np.asarray(power * step_s / np.sum(window**2))


def _repeats(cycle: Cycle) -> bool:
    return cycle.steady and cycle.stroke_distortion is not None and cycle.stroke_distortion <= _SINE


def _difference_power(
    time_s: FloatArray, values: FloatArray, three: Sequence[Cycle], points: int, lines: Sequence[HumLine]
) -> FloatArray:
    """Return the density of the second difference of three cycles by harmonic, shape (points // 2 + 1,).

    A cycle may be a little larger than the others, begin a little later, and drift: what that makes of the
    difference, in proportion to the loop and to its slope, is taken out, and so is what changes evenly.
    """
    phase = np.arange(points) / points
    one, middle, other = (_between(time_s, values, c.start_s + phase * c.duration_s) for c in three)
    difference = one - 2.0 * middle + other
    mean = (one + middle + other) / 3.0
    slope = np.roll(mean, -1) - np.roll(mean, 1)
    known = np.stack((np.ones(points), phase, mean, slope))
    if lines:
        at_s = three[1].start_s + phase * three[1].duration_s
        waves = [2.0 * np.pi * line.frequency_Hz * at_s for line in lines]
        known = np.concatenate((known, np.cos(waves), np.sin(waves)))
    found, *_ = np.linalg.lstsq(known.T, difference, rcond=None)
    window = 1.0 - np.cos(2.0 * np.pi * phase)
    power = np.abs(np.fft.rfft((difference - found @ known) * window)) ** 2
    return np.asarray(power * three[1].duration_s / points / np.sum(window**2) / _OF_SECOND_DIFFERENCE)


def _between(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Return values at other moments, by the cubic through two samples to both sides (Lagrange)."""
    behind = np.clip(np.searchsorted(time_s, at_s), 2, time_s.size - 2)
    near = behind[:, None] + np.arange(-2, 2)
    moments = time_s[near]
    found = np.zeros(at_s.size)
    for k in range(4):
        others = [j for j in range(4) if j != k]
        weight = np.prod(
            (at_s[:, None] - moments[:, others]) / (moments[:, k, None] - moments[:, others]), axis=1
        )
        found += weight * values[near[:, k]]
    return found


def _in_bands(power: FloatArray, cycle_s: float) -> list[Point]:
    """Return the mean density over octaves of harmonics, each of enough values: the median of the rows."""
    rows, last = power.shape[0], 2 * (power.shape[1] - 1) // _INTERPOLATED
    found: list[Point] = []
    first = _LOWEST
    while first <= last:
        end = 2 * first
        while rows * (min(end, last + 1) - first) < _LEAST_FREEDOM and end <= last:
            end *= 2
        end = min(end, last + 1)
        if not found and rows * (end - first) < _LEAST_FREEDOM:
            break
        freedom = 2.0 * (end - first)
        median = (1.0 - 2.0 / (9.0 * freedom)) ** 3
        values = np.mean(power[:, first:end], axis=1)
        middle = float(np.sqrt(first * (end - 1)))
        found.append((middle / cycle_s, float(np.median(values)) / median))
        first = end
    return found
