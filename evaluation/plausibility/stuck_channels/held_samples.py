"""Held samples: a slower channel that is written at the rate of a faster one, each value several times.

Converter steps repeat values, too, but for the longer the slower the motion, and one step at a time. A held
channel changes in every k-th row, fast or slow, by whatever it has moved meanwhile. Its values are late by
(k - 1) / 2 rows on average, as a delay that nobody stated: W_a of a loop changes by the share ωτ / tan δ.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Effect, Finding
from bufferstand.evaluation.plausibility.run_view import RunView, Samples
from bufferstand.foundation.numbers import median, quantile

LEAST_CHANGES = 20
"""So many changes tell how far they are apart."""
REGULAR = 0.85
"""This share of them lies a whole number of rows apart that is the same, or one of two that follow."""
LEAST_SAME, _LEAST_SAME_EVENLY = 0.3, 0.15
"""A held channel repeats the value before in half of its rows; less where a logger is slow at rest, or where
it is written at nearly its own rate: of six rows one. Then it has to be all the more even."""
_LEAST_ROWS, _SURELY_LONG, _TOGETHER = 1.18, 1.5, 8
"""Five values in six rows are nearly the least that is told. Values that stay for fewer rows than the second
do so evenly only if nearly all neighbouring changes, so many of them, span within a row of what they span on
average: by chance 63 % of them do at most."""
_SLOWER = 1.5
"""There its rows are so many times further apart."""
_STEP = 1.5
_ON_GRID = 0.98
"""Nearly all changes, of which enough are more than one step, lie whole multiples of some rows apart."""
_LOOK = 0.02
"""Nearly the shortest step (this quantile) of a log by event is how often its logger looks."""
_SIZES, _UNLIKE = (0.25, 0.75), 1.5
"""The larger ones of its changes are so many times the smaller ones, or they are those of events."""
_RESTS = 3.0
"""Changes further apart than so many times the median are rests."""
SINGLE_STEPS = 0.5
"""Where the values are whole steps of a converter: less than this share of the changes is one step."""
BY_LATENESS = 0.005
"""Lateness that changes W_a by no more than this share is noted only: as much as a gap may."""


@dataclass(frozen=True)
class _Hold:
    rows: float
    """For how many rows each value stays."""
    step_s: float
    of: str = "rows"
    """What is counted: rows, or in a log by event looks of the logger."""

    @property
    def late_s(self) -> float:
        return 0.5 * (self.rows - 1.0) * self.step_s


def held(look: RunView) -> list[Finding]:
    """Return the channels whose values are held.

    Parameters
    ----------
    look : Look

    Returns
    -------
    list of Finding
        ``size`` is by how much the channel is late on average [s].
    """
    hold_in = hold_by_event if look.samples.by_event else hold_of
    holds = {channel.name: hold for channel in look.channels if (hold := hold_in(channel)) is not None}
    found = []
    for channel in look.channels:
        if channel.name not in holds:
            continue
        own = holds[channel.name]
        others = [holds.get(c.name) for c in look.channels if c.quantity != channel.quantity]
        together = all(other is not None and other.rows == own.rows for other in others)
        found.append(_finding(look, channel, own, together=together))
    return found


def hold_of(channel: Samples) -> _Hold | None:
    """Return for how long a channel holds its values, if it does so regularly.

    A logger that went on more slowly shows it in what it wrote fast.
    """
    hold = _hold_of_rows(channel)
    if hold is None and int(np.sum(channel.scan.same)) >= LEAST_CHANGES and channel.unevenness > _SLOWER:
        fast = _fast_part(channel)
        return None if fast is None else _hold_of_rows(fast)
    return hold


def _fast_part(channel: Samples) -> Samples | None:
    """Return the longest stretch at the highest rate of a record; None: it is all of it, or too short."""
    steps_s = np.diff(channel.time_s)
    slow = np.flatnonzero(steps_s > _SLOWER * quantile(steps_s, _LOOK))
    bounds = np.concatenate(([-1], slow, [steps_s.size]))
    longest = int(np.argmax(np.diff(bounds)))
    rows = slice(int(bounds[longest]) + 1, int(bounds[longest + 1]) + 1)
    if not slow.size or rows.stop - rows.start < LEAST_CHANGES:
        return None
    return Samples(channel.name, channel.time_s[rows], channel.value[rows])


def _hold_of_rows(channel: Samples) -> _Hold | None:
    if not _repeats(channel, _LEAST_SAME_EVENLY):
        return None
    changes = _changes(channel)
    step_s = median(np.diff(channel.time_s))
    apart, lasts_s = np.diff(changes), np.diff(channel.time_s[changes])
    apart = apart[lasts_s < _SLOWER * step_s * apart]  # a logger that is slower at rest repeats less there
    if apart.size < LEAST_CHANGES:
        return None
    sizes = np.abs(channel.value[changes] - channel.value[changes - 1])
    large = np.count_nonzero(sizes >= _STEP * channel.sampling.step)
    if large < sizes.size and (rows := _grid(apart)) and large >= LEAST_CHANGES:
        return _Hold(float(rows), step_s)
    if sizes.size - large > SINGLE_STEPS * sizes.size:
        return None
    return _even(apart[apart <= _RESTS * median(apart)], step_s)


def _even(apart: NDArray[np.intp], step_s: float) -> _Hold | None:
    """Return the hold of which the changes, so many rows apart, come evenly."""
    mean = float(np.mean(apart))
    if mean < _LEAST_ROWS or not _within_a_row(apart, mean):
        return None
    if mean < _SURELY_LONG and not _within_a_row(_sums(apart), _TOGETHER * mean):
        return None
    whole = round(mean)
    exact = whole > 1 and np.count_nonzero(apart == whole) >= REGULAR * apart.size
    return _Hold(float(whole) if exact else mean, step_s)


def _repeats(channel: Samples, least: float) -> bool:
    return int(np.sum(channel.scan.same)) >= least * channel.value.size


def _within_a_row(rows: NDArray[np.intp], mean: float) -> bool:
    return bool(np.count_nonzero(np.abs(rows - mean) < 1.0) >= REGULAR * rows.size)


def _sums(apart: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return how many rows so many changes that follow each other span together."""
    ends = np.cumsum(apart)
    return np.asarray(ends[_TOGETHER:] - ends[:-_TOGETHER], dtype=np.intp)


def _grid(apart: NDArray[np.intp]) -> int:
    """Return the number of rows of which nearly all changes are whole multiples apart; 0: of none.

    So are those of a held channel of coarse steps, which at rest changes now and then.
    """
    rows = int(quantile(apart, 1.0 - _ON_GRID))
    return rows if rows > 1 and np.count_nonzero(apart % rows == 0) >= _ON_GRID * apart.size else 0


def hold_by_event(channel: Samples) -> _Hold | None:
    """Return for how long a channel of a log by event holds its values, if it does so regularly.

    In such a log a value stays until it has changed enough: by about as much every time, and the sooner the
    faster it changes. A held one changes at even times, by whatever it has moved meanwhile. Of changes that
    are all k looks apart, those of events differ by less than k / (k - 1) in size: what changed enough only
    in the last look of a slow motion had not done so in the last but one of a faster one.
    """
    changes = _changes(channel) if _repeats(channel, LEAST_SAME) else np.zeros(0, dtype=np.intp)
    if changes.size < LEAST_CHANGES:
        return None
    looks_s = quantile(np.diff(channel.time_s), _LOOK)
    sizes = np.abs(channel.value[changes] - channel.value[changes - 1])
    wide = np.diff(changes) > 1
    apart, own_sizes = np.diff(channel.time_s[changes])[wide] / looks_s, sizes[1:][wide]
    if apart.size < LEAST_CHANGES:
        return None
    usual = apart <= _RESTS * median(apart)
    apart, own_sizes = apart[usual], own_sizes[usual]
    mean, looks = float(np.mean(apart)), round(median(apart))
    exact = np.rint(apart) == looks
    if mean < 2.5:
        return None
    if np.count_nonzero(exact) >= REGULAR * apart.size and _differ(own_sizes[exact], looks / (looks - 1.0)):
        return _Hold(float(looks), looks_s, "looks of the logger")
    even = np.count_nonzero(np.abs(apart - mean) < 1.5) >= REGULAR * apart.size
    return _Hold(mean, looks_s, "looks of the logger") if even and _differ(sizes, _UNLIKE) else None


def _differ(sizes: NDArray[np.float64], times: float) -> bool:
    small, large = (quantile(sizes, share) for share in _SIZES)
    return large >= times * small


def _changes(channel: Samples) -> NDArray[np.intp]:
    """Return the rows at which a channel changes."""
    return np.flatnonzero(np.diff(channel.value) != 0.0) + 1


def _finding(look: RunView, channel: Samples, hold: _Hold, *, together: bool) -> Finding:
    share = _share_of_area(look, hold.late_s)
    effect: Effect = "spoils"
    if together:
        what = "force and stroke are held alike: they are late together, and W_a stays"
        effect = "noted"
    elif share is None:
        what = "what it changes is not known"
    else:
        what = f"W_a changes by up to {share:.2g} of itself"
        if share <= BY_LATENESS or hold.late_s <= _stated_s(look):
            effect = "noted"
    text = (
        f"{channel.name} held: each value is repeated in {hold.rows:.3g} {hold.of} (true rate "
        f"{1.0 / (hold.rows * hold.step_s):.4g} Hz), so that it is late by {1e3 * hold.late_s:.3g} ms on "
        f"average; {what}; record it at its own rate, each value once"
    )
    start_s, end_s = float(channel.time_s[0]), float(channel.time_s[-1])
    return Finding(
        "held",
        channel.name,
        start_s,
        end_s,
        look.all_cycles,
        hold.late_s,
        "s",
        text,
        effect,
        whole_record=True,
    )


def _stated_s(look: RunView) -> float:
    """Return the uncertainty that is stated of the delays of both channels [s]."""
    stated = (look.facts.force_uncertainty, *look.facts.stroke_uncertainty)
    return hypot(*(one.u_delay_s or 0.0 for one in stated if one is not None))


def _share_of_area(look: RunView, late_s: float) -> float | None:
    """Return by which share of itself lateness changes the loop area most, ωτ / tan δ."""
    shares = []
    for result in look.results:
        rate_Hz, loss = result.quantities.frequency_Hz, result.quantities.loss_factor
        if rate_Hz is not None and loss is not None and loss != 0.0:
            shares.append(2.0 * pi * rate_Hz * late_s / abs(loss))
    return max(shares, default=None)
