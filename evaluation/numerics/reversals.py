"""A first search for the reversals of the stroke, before any fit: motion is told from noise."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics.arrays import FloatArray, IndexArray
from bufferstand.foundation.numbers import quantile

_NOISE_FACTOR = 12.0
"""White noise of 10^6 samples spans about 10 standard deviations; a reversal must be larger."""
_STEPS_FACTOR = 3.0
"""… and larger than three steps of the converter."""
_LEAST_SHARE = 1e-3
"""… and than this share of the whole stroke range of the record."""
_LEAST_CYCLE_SHARE = 0.05
"""Reversals below this share of the largest cycle are ringing or ramp, not cycles."""
_NEXT, _SMALL_SHARE, _ONE_WAY = 1.4, 1.0 / 3.0, 16.0
"""Swings of coloured noise have all sizes: if more than the second of those left lie within the first
of the least, and most of these are less than the third of what they go back on their way, they are noise."""
_LOOKED_AT = 32
_REPEATED_SHARE = 0.02
_SEVERAL_SHARE = 0.005
_COARSEST_STEP = 0.02
"""A larger share of the range is no converter's step: so the few, even steps of an ideal flank look."""
_NOISE_SAMPLES = 8192
"""Differences are taken at about so many places, spread evenly over the record: 2 % of their deviation."""
_LEAST_DIFFERENT = 16
_STRETCHES, _STRETCH = 16, 1024
"""Converter steps and held samples of a longer record are looked for in so many stretches of it."""
_LONG = 65_536
"""Of a longer record not every sample is a candidate for a reversal."""
_BLOCKS = (512, 64, 16)
"""Sizes of the blocks of which, from coarse to fine, only the extremes are candidates for a reversal."""
_CHUNK_SAMPLES = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""
_SPARE = 0.9
"""Candidates are looked for with so much less than what they are thought to be larger than."""
_DIFFERENCES = ((-1.0, 3.0, -3.0, 1.0), (-1.0, 5.0, -10.0, 10.0, -5.0, 1.0))
_STANDS_STILL = 0.05
"""Of a channel that stands still to the last digit for this share of its samples and more, their differences,
which are 0, would pass for a lack of noise: those of the others are looked at."""
WHITE = 0.4
"""Noise makes third and fifth differences of one size: of a motion these are smaller by more than this."""
_FAST_HUM = 0.7
"""Of white noise means of two have so little (its root half) in none of a thousand records."""
_LOWER_FIFTH, _NORMAL_LOWER_FIFTH = 0.2, 0.2533471
"""A fifth of all normal deviates lie within 0.2533 standard deviations."""


@dataclass(frozen=True)
class Sampling:
    """How the values of a record came about.

    Attributes
    ----------
    held : int
        For how many samples a value usually stays the same: 1, or more where samples are held.
    step : float
        The converter's step in the unit of the values, where the record repeats values while it moves, else
        0. Rest alone is no sign of it: there, equal values come in few long rows. All steps are whole
        multiples of the converter's, and there are steps of several sizes or rests between most of them.
    sigma : float
        Standard deviation of white noise, from third and fifth differences. They vanish for what is smooth
        over four or six samples. The lower of the two counts, read at its lower fifth: so corners, turning
        points, gaps and jumps do not count as noise, even with 20 samples a cycle. Of samples that are held,
        one each counts. Quantisation adds a twelfth of its step squared.
    """

    held: int
    step: float
    sigma: float


def sampling_of(values: FloatArray) -> Sampling:
    """Return how the values of a record, shape (N,), came about."""
    stretches = _stretches(values)
    changes = np.diff(stretches, axis=1)
    moves = changes != 0.0
    held, step = _held(moves), _quantum(stretches, changes, moves)
    distinct = values
    if held > 1:
        near = stretches.ravel()
        distinct = near[np.concatenate(([0], np.flatnonzero(np.diff(near) != 0.0) + 1))]
    if distinct.size < _LEAST_DIFFERENT:
        return Sampling(held, step, 0.0)
    sigma = max(difference_sigma(distinct), step / float(np.sqrt(12.0)))
    still = moves.size - np.count_nonzero(moves)
    if held == 1 and step == 0.0 and still > _STANDS_STILL * moves.size:
        sigma = max(sigma, _white_sigma(stretches[:, 1:][moves]))
    return Sampling(held, step, sigma)


def difference_sigma(values: FloatArray) -> float:
    """Return the standard deviation of white noise on values, by their third and fifth differences."""
    return min(_difference_sigma(values, weights) for weights in _DIFFERENCES)


def _white_sigma(values: FloatArray) -> float:
    """Return the standard deviation of white noise on values; 0 where they differ as a motion makes them."""
    if values.size < _LEAST_DIFFERENT:
        return 0.0
    third, fifth = (_difference_sigma(values, weights) for weights in _DIFFERENCES)
    return min(third, fifth) if fifth > WHITE * third else 0.0


def without_fast_hum(values: FloatArray, sigma: float) -> float:
    """Return the noise by which fits are judged: without what is nearly as fast as the samples show.

    Differences of neighbours see a wave of two to three samples with twice its amplitude, and a fit that
    misses a turn by as much would pass for a good one. Means of two do not see it.
    """
    if values.size < 2 * _LEAST_DIFFERENT:
        return sigma
    by_means = float(np.sqrt(2.0)) * difference_sigma(0.5 * (values[:-1:2] + values[1::2]))
    return by_means if 0.0 < by_means < _FAST_HUM * sigma else sigma


def noise_sigma(values: FloatArray) -> float:
    """Return the standard deviation of white noise on a record (:class:`Sampling`)."""
    return sampling_of(values).sigma


def _stretches(values: FloatArray) -> FloatArray:
    """Return the record as one row, or stretches of a long one, evenly spread, a row each."""
    if values.size <= 2 * _STRETCHES * _STRETCH:
        return values[None, :]
    starts = np.linspace(0, values.size - _STRETCH, _STRETCHES).astype(np.intp)
    return np.stack([values[start : start + _STRETCH] for start in starts])


def _difference_sigma(values: FloatArray, weights: tuple[float, ...]) -> float:
    stride = max(1, values.size // _NOISE_SAMPLES)
    last = values.size - len(weights) + 1
    places = range(0, last, stride)
    difference = np.zeros(len(places))
    for k, weight in enumerate(weights):
        difference += weight * values[k : last + k : stride]
    gain = float(np.sqrt(sum(weight**2 for weight in weights)))
    fifth = int(_LOWER_FIFTH * (difference.size - 1))
    return float(np.partition(np.abs(difference), fifth)[fifth]) / _NORMAL_LOWER_FIFTH / gain


def _quantum(stretches: FloatArray, changes: FloatArray, moves: NDArray[np.bool_]) -> float:
    """Return the converter's step (:class:`Sampling`)."""
    rows = np.count_nonzero(moves[:, 1:] & ~moves[:, :-1])
    if rows < max(8, _REPEATED_SHARE * np.count_nonzero(moves)):
        return 0.0
    moving = np.abs(changes[moves])
    # A low quantile, not the least: rounding of the input's decimals makes steps near zero.
    least = quantile(moving, 0.02)
    multiples = moving / least
    off = quantile(np.abs(multiples - np.round(multiples)), 0.9)
    several = np.count_nonzero(multiples > 1.5) > _SEVERAL_SHARE * moving.size
    if (
        off > 0.1
        or least > _COARSEST_STEP * float(np.ptp(stretches))
        or not (rows > 0.25 * moving.size or several)
    ):
        return 0.0
    return least


def held_samples(values: FloatArray) -> int:
    """Return for how many samples a value usually stays the same (:class:`Sampling`)."""
    return _held(np.diff(_stretches(values), axis=1) != 0.0)


def _held(moves: NDArray[np.bool_]) -> int:
    # Most records change from sample to sample: told without a list of all changes.
    if 2 * np.count_nonzero(moves[:, 1:] & moves[:, :-1]) > np.count_nonzero(moves):
        return 1
    row, change = np.nonzero(moves)
    lasted = np.diff(change)[np.diff(row) == 0]
    return _median(lasted) if lasted.size else 1


def _median(counts: IndexArray) -> int:
    """Return the whole part of the median of small whole numbers; most are alike: sorting is slow on them."""
    below = np.cumsum(np.bincount(counts))
    middle = np.searchsorted(below, [(counts.size - 1) // 2, counts.size // 2], side="right")
    return int(middle.sum()) // 2


def _remove_small(values: FloatArray, index: IndexArray, threshold: float) -> IndexArray:
    """Drop pairs of neighbouring extremes that are closer than ``threshold``, smallest first.

    What is left is the same as by a hysteresis of that width, found without a loop over samples.
    """
    tie_break: np.random.Generator | None = None
    while index.size > 2:
        height = np.abs(np.diff(values[index]))
        small = height < threshold
        if not small.any():
            break
        tie_break = tie_break or np.random.default_rng(0)
        # Equal heights (quantised noise) are ordered at random, or one pass would remove only one of them.
        key = height * (1.0 + 1e-9 * tie_break.random(height.size)) + 1e-12 * threshold * tie_break.random(
            height.size
        )
        padded = np.concatenate(([np.inf], key, [np.inf]))
        local = small & (padded[1:-1] < padded[:-2]) & (padded[1:-1] < padded[2:])
        keep = np.ones(index.size, dtype=bool)
        at = np.flatnonzero(local)
        inner = at[(at > 0) & (at < height.size - 1)]
        keep[inner] = False
        keep[inner + 1] = False
        if 0 in at:
            keep[0] = False  # the record's edge belongs to the turn beside it
        if height.size - 1 in at:
            keep[index.size - 1] = False
        index = index[keep]
    return index


def _alternating(values: FloatArray, index: IndexArray) -> IndexArray:
    """Keep those of ``index`` at which the direction of ``values[index]`` changes, and both ends."""
    direction = np.sign(np.diff(values[index]))
    keep = np.concatenate(([True], direction[1:] != direction[:-1], [True]))
    return index[keep]


def _extremes_among(values: FloatArray, index: IndexArray) -> IndexArray:
    """Return those of ``index`` (rising) that are extremes among them, and both ends."""
    changes = np.flatnonzero(np.diff(values[index]) != 0.0)
    if changes.size == 0:
        return index[:1]
    return _alternating(values, index[np.concatenate(([0], changes + 1))])


def _block_extremes(values: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Return the lowest and the highest sample of each of the coarsest blocks."""
    grid = values[: values.size // _BLOCKS[0] * _BLOCKS[0]].reshape(-1, _BLOCKS[0])
    first = _BLOCKS[0] * np.arange(grid.shape[0])
    return first + np.argmin(grid, axis=1), first + np.argmax(grid, axis=1)


def _outermost(values: FloatArray, low: IndexArray, high: IndexArray) -> IndexArray:
    """Return the extremes of the coarsest blocks, the first sample, and those behind all blocks, in order."""
    both = np.stack((np.minimum(low, high), np.maximum(low, high)), axis=1).ravel()
    index = np.concatenate(([0], both, np.arange(low.size * _BLOCKS[0], values.size)))
    return index[np.concatenate(([True], np.diff(index) > 0))]


def _candidates(
    values: FloatArray, low: IndexArray, high: IndexArray, least: float, threshold: float
) -> IndexArray:
    """Return samples among which are all reversals larger than ``threshold``, in order.

    Of a block whose range is smaller no two reversals are, so that its extremes ``low`` and ``high`` stand
    for it. They do, too, for one that the stroke goes through one way, back by less than ``least``. Of the
    other blocks those of their parts do, down to single samples.
    """
    whole = low.size * _BLOCKS[0]
    chosen = np.zeros(values.size, dtype=bool)
    chosen[:1] = chosen[whole:] = True
    rows = np.arange(low.size)
    for size, finer in pairwise((*_BLOCKS, 1)):
        steep = values[high] - values[low] >= threshold
        if size < _BLOCKS[0]:  # where many of the coarsest are steep, most of them hold a turn
            steep[steep] = ~_goes_one_way(values[:whole].reshape(-1, size), rows[steep], least)
        chosen[low[~steep]] = chosen[high[~steep]] = True
        parts = size // finer
        rows = (parts * rows[steep][:, None] + np.arange(parts)).ravel()
        if finer == 1:
            break
        grid = values[:whole].reshape(-1, finer)
        part = grid if rows.size == grid.shape[0] else grid[rows]
        low, high = rows * finer + np.argmin(part, axis=1), rows * finer + np.argmax(part, axis=1)
    chosen[rows] = True
    return np.flatnonzero(chosen)


def _goes_one_way(grid: FloatArray, rows: IndexArray, least: float) -> NDArray[np.bool_]:
    """Say in which rows of a grid the values rise, or fall, and go back by less than ``least`` in all."""
    found = np.zeros(rows.size, dtype=bool)
    step = _CHUNK_SAMPLES // grid.shape[1]
    for start in range(0, rows.size, step):
        part = grid[rows[start : start + step]]
        change = np.diff(part, axis=1)
        there_and_back = np.sum(np.abs(change, out=change), axis=1) - np.abs(part[:, -1] - part[:, 0])
        found[start : start + step] = 0.5 * there_and_back < least
    return found


def _largest_cycle(values: FloatArray, index: IndexArray) -> float:
    """Return the largest smaller side of a reversal, 0 where there is none."""
    height = np.abs(np.diff(values[index]))
    return float(np.max(np.minimum(height[:-1], height[1:]), initial=0.0))


def find_reversals(stroke_mm: FloatArray, sampling: Sampling | None = None) -> IndexArray:
    """Return indices of alternating lower and upper extremes that are motion, both record ends included.

    Parameters
    ----------
    stroke_mm : array, shape (N,)
    sampling : Sampling, optional
        That of the stroke, if it is known already.

    Returns
    -------
    array of int
        At least two entries when the stroke moves at all; neighbours differ by more than noise, the
        converter's resolution and 5 % of the largest cycle.
    """
    if stroke_mm.size <= _LONG:
        span = float(np.ptp(stroke_mm)) if stroke_mm.size else 0.0
        least = _least(span, sampling or sampling_of(stroke_mm))
        index = _extremes_among(stroke_mm, np.arange(stroke_mm.size))
        return _without_coloured(stroke_mm, *_without_small(stroke_mm, index, least))
    low, high = _block_extremes(stroke_mm)
    outer = _outermost(stroke_mm, low, high)
    least = _least(float(np.ptp(stroke_mm[outer])), sampling or sampling_of(stroke_mm))
    _, wanted = _without_small(stroke_mm, _extremes_among(stroke_mm, outer), least)
    while True:
        # On the way of the largest cycle may lie reversals that the outermost extremes do not show.
        smallest = _SPARE * wanted
        index = _extremes_among(stroke_mm, _candidates(stroke_mm, low, high, least, smallest))
        index, wanted = _without_small(stroke_mm, index, least)
        if wanted >= smallest:
            return _without_coloured(stroke_mm, index, wanted)


def _least(span_mm: float, sampling: Sampling) -> float:
    """Return what a reversal is larger than, of noise and steps and a stroke of so large a range."""
    return max(_NOISE_FACTOR * sampling.sigma, _STEPS_FACTOR * sampling.step, _LEAST_SHARE * span_mm)


def _without_small(values: FloatArray, index: IndexArray, least: float) -> tuple[IndexArray, float]:
    """Return those of alternating extremes that are motion, and what they are larger than."""
    if index.size < 2:
        return index, least
    index = _remove_small(values, index, least)
    if index.size < 3:
        return index, least
    smallest = max(least, _LEAST_CYCLE_SHARE * _largest_cycle(values, index))
    return _remove_small(values, index, smallest), smallest


def _without_coloured(values: FloatArray, index: IndexArray, least: float) -> IndexArray:
    """Return those of alternating extremes that are motion where noise is no white one.

    Filters, guides that stick and a stand's own control leave noise whose neighbours are alike: their
    differences are smaller than what it swings by over many samples. A motion goes one way from turn to turn
    but for white noise, and its cycles have one size or a few; noise goes back on its way by all that is
    smaller than what is looked for, and has swings of every size. What it swings by is raised until none
    are left that are just above it.
    """
    most = _COARSEST_STEP * float(np.ptp(values[index])) if index.size else 0.0
    while index.size > 2 and least < most:
        height = np.abs(np.diff(values[index]))
        small = np.flatnonzero(height < _NEXT * least)
        if small.size <= _SMALL_SHARE * height.size:
            break
        looked_at = small[:: -(-small.size // _LOOKED_AT)].tolist()
        ratios = [_one_way(values[index[row] : index[row + 1] + 1]) for row in looked_at]
        if quantile(np.array(ratios), 0.5) > _ONE_WAY:
            break
        least *= _NEXT
        index = _remove_small(values, index, least)
    return index


def _one_way(swing: FloatArray) -> float:
    """Return by how many times what a swing leaves of the nearest motion one way [rms] it moves."""
    from scipy.optimize import isotonic_regression  # noqa: PLC0415 - slow to import, and seldom needed

    rises = bool(swing[-1] > swing[0])
    left = swing - isotonic_regression(swing, increasing=rises).x
    rms = float(np.sqrt(np.mean(left * left)))
    return abs(float(swing[-1] - swing[0])) / rms if rms > 0.0 else float("inf")
