"""Harmonics of the stroke and force of many cycles at once, by least squares over one period each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Cycle
from bufferstand.evaluation.numerics import BoolArray, FloatArray, IndexArray, basis_for
from bufferstand.evaluation.record import Record

HARMONICS = 10
"""Harmonics that are fitted to a cycle, where it has the samples for them."""
MOST_POINTS = 128
"""Even samples of a cycle are averaged in groups down to at most so many; what that takes from each harmonic
is given back."""
_MOST_UNEVEN = 400
"""Uneven ones to at most so many: 1e-5 less of the first harmonic."""
_EVEN = 0.05
"""Groups lie evenly when they are within this share of a sample's step of where they should be."""
_EVEN_SAMPLES = 1e-3
"""Samples by themselves do when they are within this share."""
_LEAST_ALIKE = 8
"""So many periods of one number of samples are solved by one matrix."""
_CHUNK_POINTS = 12_288
"""Points that are fitted together: more of them would leave the processor's cache."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Cosine and sine amplitudes of stroke and force of cycles, shape (R, 11, 2) each; row 0 the mean and 0.

    ``drift`` is that of the time since the start of the cycle over its duration, ``samples`` (R,) those
    inside each cycle.
    """

    stroke: FloatArray
    force: FloatArray
    drift: FloatArray
    samples: IndexArray

    def first_harmonic(self) -> NDArray[np.complex128]:
        """Return K* = K′ + i K″ of each cycle [kN/mm], ratio of first harmonics (ISO 4664-1)."""
        # cos, sin amplitudes a, b are the phasor a - i b of exp(+i ω t); force leads stroke when K″ > 0.
        force, stroke = (a[:, 1, 0] - 1j * a[:, 1, 1] for a in (self.force, self.stroke))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(force / stroke)

    def work_J(self) -> FloatArray:  # noqa: N802 - the unit keeps its capital
        """Return the work that stroke and force do with each other in harmonics 1 … 10, shape (R,) [J].

        π Σ k (A_k b_k - B_k a_k), with the cosine and sine amplitudes a, b of the stroke and A, B of the
        force: the integral of F dx over a period, whatever the form of the stroke. For a sine stroke only
        k = 1 is left, π K″ x_a² (ISO 4664-1).
        """
        order = np.arange(HARMONICS + 1)
        crossed = self.force[..., 0] * self.stroke[..., 1] - self.force[..., 1] * self.stroke[..., 0]
        return np.asarray(np.pi * np.sum(order * crossed, axis=1))

    def distortion(self, open_mm: FloatArray) -> FloatArray:
        """Return the root of the sum of squares of stroke harmonics 2 … 10 over the first, shape (R,).

        Parameters
        ----------
        open_mm : array, shape (R,)
            Stroke at the end of a cycle less that at its start: a drift that is taken off first.

        Returns
        -------
        array, shape (R,)
            NaN where there is no first harmonic.
        """
        closed = self.stroke - open_mm[:, None, None] * self.drift
        power = np.sum(closed**2, axis=2)
        others, first = np.sqrt(np.sum(power[:, 2:], axis=1)), np.sqrt(power[:, 1])
        return np.where(first > 0.0, others / np.where(first > 0.0, first, 1.0), np.nan)


def spectra(record: Record, cycles: Sequence[Cycle]) -> Spectra:
    """Return the harmonics of some cycles of a record."""
    start_s = np.array([cycle.start_s for cycle in cycles], dtype=np.float64)
    end_s = np.array([cycle.end_s for cycle in cycles], dtype=np.float64)
    return spectra_between(record, start_s, end_s)


def spectra_between(record: Record, start_s: FloatArray, end_s: FloatArray) -> Spectra:
    """Return the harmonics of periods of a record, from the samples strictly inside each, shape (R,)."""
    first = np.searchsorted(record.time_s, start_s, side="right")
    last = np.searchsorted(record.time_s, end_s, side="left")
    size = np.maximum(last - first, 0)
    found = np.zeros((3, start_s.size, HARMONICS + 1, 2))
    rows, most = np.flatnonzero(size > 0), MOST_POINTS
    while rows.size:
        uneven = _fit_rows(record, (start_s, end_s - start_s), (first, size), rows, most, found)
        rows, most = uneven, _MOST_UNEVEN
    return Spectra(found[0], found[1], found[2], size)


def _fit_rows(
    record: Record,
    period: tuple[FloatArray, FloatArray],
    samples: tuple[IndexArray, IndexArray],
    rows: IndexArray,
    most: int,
    found: FloatArray,
) -> IndexArray:
    """Write the harmonics of some periods (start and length [s], first sample and count) to ``found``.

    Returns those whose samples turn out to be too uneven for groups of them.
    """
    signals = (record.time_s, record.stroke_mm, record.force_kN)
    first, size = samples
    group = np.maximum(1, -(-size // most))
    points = -(-size // group)
    orders = np.minimum(HARMONICS, np.maximum(1, (points - 3) // 2))
    left: list[IndexArray] = []
    for order in np.unique(orders[rows]).tolist():
        alike = rows[orders[rows] == order]
        step = max(1, _CHUNK_POINTS // int(np.max(points[alike])))
        for at in range(0, alike.size, step):
            part = alike[at : at + step]
            count = points[part]
            bounds = _bounds(first[part], size[part], count)
            time, stroke, force = _means(signals, bounds)
            used = np.arange(time.shape[1]) < count[:, None]
            share = np.where(used, (time - period[0][part, None]) / period[1][part, None], 0.0)
            values = np.stack((stroke, force, share))
            other = np.ones(part.size, dtype=bool)
            if most == MOST_POINTS:
                uneven, grouped = _unevenness(share, bounds, count), group[part] > 1
                left.append(part[grouped & (uneven > _EVEN)])
                even = uneven <= np.where(grouped, _EVEN, _EVEN_SAMPLES)
                for own in _of_one_size(size[part], even):
                    done, fits = _by_basis(own, order, bounds, values)
                    found[:, part[done]] = fits
                    other[done] = False
            if other.any():
                own_points = share[other], values[:, other], used[other]
                found[:, part[other]] = fitted_harmonics(*own_points, order, (size[part] / count)[other])
    return np.concatenate([rows[:0], *left])


def _of_one_size(size: IndexArray, wanted: BoolArray) -> list[IndexArray]:
    """Return the wanted rows of each size that many of them have."""
    sizes, number = np.unique(size[wanted], return_counts=True)
    return [np.flatnonzero(wanted & (size == own)) for own in sizes[number >= _LEAST_ALIKE].tolist()]


def _by_basis(
    rows: IndexArray, order: int, bounds: IndexArray, values: FloatArray
) -> tuple[IndexArray, FloatArray]:
    """Return those of some even periods of one size that are of one step too, and their harmonics.

    ``values`` (3, R, P): stroke, force, and share of the period.
    """
    inner = bounds[rows[0]]
    points = int(np.count_nonzero(np.diff(inner)))
    between = 0.5 * float(inner[points] + inner[points - 1] - inner[1] - inner[0])
    share = values[2, rows, :points]
    step = (share[:, -1] - share[:, 0]) / between
    size = int(inner[-1] - inner[0])
    basis = basis_for(size, points, order, _median(step))
    suits = basis.suits(step)
    done, step = rows[suits], step[suits]
    found = np.zeros((values.shape[0], done.size, HARMONICS + 1, 2))
    found[:, :, : order + 1] = basis.fitted(values[:2, done, :points], share[suits, 0], step)
    group = np.full(done.size, size / points)
    found[:, :, 1 : order + 1] /= _kept(step * group, order, group)[..., None]
    return done, found


def _median(values: FloatArray) -> float:
    """Return the median; NumPy's own takes ten times as long for some hundred values."""
    order, half = np.sort(values), values.size // 2
    return float(order[half] if values.size % 2 else 0.5 * (order[half - 1] + order[half]))


def _bounds(first: IndexArray, size: IndexArray, count: IndexArray) -> IndexArray:
    """Return where each of ``count`` groups of nearly equally many samples begins, and the last one ends."""
    order = np.minimum(np.arange(int(np.max(count)) + 1), count[:, None])
    return np.asarray(first[:, None] + order * size[:, None] // count[:, None])


def _means(signals: Sequence[FloatArray], bounds: IndexArray) -> list[FloatArray]:
    """Return the means of signals between neighbouring bounds, shape (R, P); padding where they are equal."""
    size, last = np.diff(bounds, axis=1), signals[0].size - 1
    most = int(np.max(size))
    if most == 1:
        at = np.minimum(bounds[:, :-1], last)
        return [np.asarray(signal[at]) for signal in signals]
    if most == 2:  # the first sample and the last, which may be the same
        ends = np.minimum(bounds[:, :-1], last), np.clip(bounds[:, 1:] - 1, 0, last)
        return [np.asarray(0.5 * (signal[ends[0]] + signal[ends[1]])) for signal in signals]
    # Differences of a running sum, which is short enough to keep twelve digits of them.
    begin = int(bounds[0, 0])
    running = np.zeros(int(np.max(bounds)) - begin + 1)
    means = []
    for signal in signals:
        np.cumsum(signal[begin : begin + running.size - 1] - signal[begin], out=running[1:])
        total = np.diff(running[bounds - begin], axis=1)
        means.append(np.asarray(signal[begin] + total / np.maximum(size, 1)))
    return means


def _unevenness(share: FloatArray, bounds: IndexArray, count: IndexArray) -> FloatArray:
    """Return how far the points of each row lie from where even samples would, as a share of their step."""
    lines = np.arange(count.size)
    place = 0.5 * (bounds[:, 1:] + bounds[:, :-1])
    place -= place[:, :1]
    end = np.maximum(count - 1, 1)
    step = (share[lines, count - 1] - share[:, 0]) / np.maximum(
        place[lines, np.minimum(end, place.shape[1] - 1)], 1.0
    )
    off = np.abs(share - share[:, :1] - place * step[:, None])
    off[np.arange(share.shape[1]) >= count[:, None]] = 0.0
    return np.asarray(np.max(off, axis=1) / np.where(step > 0.0, step, np.inf))


def fitted_harmonics(
    share: FloatArray, values: FloatArray, used: BoolArray, order: int, group: FloatArray | None = None
) -> FloatArray:
    """Return cosine and sine amplitudes of signals over one period by least squares.

    Parameters
    ----------
    share : array, shape (R, P)
        Time since the start of each period, over its length.
    values : array, shape (S, R, P)
    used : array of bool, shape (R, P)
        Which are points (the first of each row) and which padding.
    order : int
        Harmonics that are fitted.
    group : array, shape (R,), optional
        Even samples that were averaged to a point.

    Returns
    -------
    array, shape (S, R, 11, 2)
        Amplitudes of cos and sin of each harmonic, 0 above ``order``.
    """
    count = np.count_nonzero(used, axis=1)
    rows = np.empty((share.shape[0], 2 * order + 1, share.shape[1]))
    angle = 2.0 * np.pi * share
    rows[:, 0] = 1.0
    rows[:, 1], rows[:, order + 1] = np.cos(angle), np.sin(angle)
    twice = 2.0 * rows[:, 1]
    for k in range(2, order + 1):  # cos k and sin k from those before, by Chebyshev's recurrence
        rows[:, k] = twice * rows[:, k - 1] - rows[:, k - 2]
        rows[:, order + k] = twice * rows[:, order + k - 1]
        if k > 2:
            rows[:, order + k] -= rows[:, order + k - 2]
    # Weights of the trapezoidal rule make the fit an integral over the period, however it was sampled.
    step = np.diff(share, axis=1)
    width = np.zeros_like(share)
    if share.shape[1] > 1:
        width[:, 1:-1] = 0.5 * (step[:, 1:] + step[:, :-1])
        width[:, 0] = step[:, 0]
        end = np.maximum(count - 1, 1)
        lines = np.arange(share.shape[0])
        width[lines, end] = step[lines, end - 1]
    weight = np.sqrt(np.where(used, np.maximum(width, 0.0), 0.0))
    rows *= weight[:, None, :]
    right = np.moveaxis(values * weight, 0, 2)
    normal = rows @ rows.transpose(0, 2, 1)
    solution = np.moveaxis(_solved(normal, rows @ right), 2, 0)
    result = np.zeros((*values.shape[:2], HARMONICS + 1, 2))
    result[..., : order + 1, 0] = solution[..., : order + 1]
    result[..., 1 : order + 1, 1] = solution[..., order + 1 :]
    if group is not None:
        lines = np.arange(count.size)
        spacing = (share[lines, count - 1] - share[:, 0]) / np.maximum(count - 1, 1)
        result[..., 1 : order + 1, :] /= _kept(spacing, order, group)[..., None]
    return result


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solutions of many systems; least squares where one is singular."""
    try:
        return np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(normal) @ right, dtype=np.float64)


def _kept(step: FloatArray, order: int, group: FloatArray) -> FloatArray:
    """Return how much of each harmonic is left of its samples' mean over a group, shape (R, order).

    ``step`` (R,): from point to point, over the period.
    """
    half = np.pi * step[:, None] * np.arange(1.0, order + 1.0)
    single = group[:, None]
    below = single * np.sin(half / single)
    return np.where(single > 1.0, np.sin(half) / np.where(below > 0.0, below, 1.0), 1.0)
