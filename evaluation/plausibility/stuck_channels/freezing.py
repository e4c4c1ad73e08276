"""Freezing: a channel keeps a value to the last digit over a stretch in which the other one moves.

Where the noise of the channel moves it by more than its resolution, that is enough. Where it does not, the
value must come back with a jump: stroke and force leave a dwell, a plateau of friction or the moment before
contact without one, or as the stroke turns. Or the force rises and falls while the stroke stands, which it
does in no dwell: there it relaxes.
"""

from __future__ import annotations

from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.run_view import RunView, Samples
from bufferstand.evaluation.plausibility.stuck_channels.clipping import NO_LOAD, clipped_again, pinned_rows
from bufferstand.evaluation.plausibility.stuck_channels.held_samples import hold_of
from bufferstand.foundation.numbers import quantile

LEAST_ROWS, LEAST_NOISY_ROWS = 10, 4
"""So many samples stay, and three times as many as the channel holds each of its values. Where noise moves
it, fewer do …"""
BY_CHANCE = 1e-6
"""… if as many alike are less likely than this, by how seldom two neighbours of the channel are alike."""
MOVED = 0.05
"""The other channel moves by this share of its span meanwhile …"""
MOVED_NOISY, MOVED_SIGMAS, MOVED_STEPS = 0.01, 8.0, 2.0
"""… where noise tells, by this one, and by so many standard deviations and steps of its own."""
JUMP_STEPS, JUMP_SHARE = 5.0, 0.005
"""Without noise, the value comes back by so many usual steps of its own (five of a converter's), and by this
share of its span."""
TO_AND_FRO, TO_AND_FRO_STEPS = 0.1, 5.0
"""A force that rises and falls by this share of its span, and by what so many steps of the stroke's converter
make of it, was moved."""
_HELD = 3
_MOST = 12
_FASTEST = 0.999
_AFTER = 3


def frozen(look: RunView) -> list[Finding]:
    """Return the stretches in which force or stroke are frozen.

    Parameters
    ----------
    look : Look

    Returns
    -------
    list of Finding
        ``size`` is by how much the other channel moves meanwhile, in this channel's place; its unit is that
        of the other one.
    """
    found: list[Finding] = []
    for channel in look.channels:
        if not np.any(channel.scan.same):
            continue
        if channel.quantity == "stroke" and _stands(channel, look.other(channel)):
            found.append(_standing(look, channel, look.other(channel)))
            continue
        hold = hold_of(channel)
        least = max(_least_rows(channel), 0 if hold is None else int(_HELD * hold.rows))
        other = look.other(channel)
        runs = _long_enough(channel, other, channel.flat(least))
        pinned = pinned_rows(look, channel) if runs.size else frozenset()
        own: list[tuple[float, Finding]] = []
        for first, last in runs.tolist():
            moved = other.moved(float(channel.time_s[first]), float(channel.time_s[last]))
            if first not in pinned and _is_frozen(channel, other, first, last, moved):
                value = float(channel.value[first])
                own.append((value, _finding(look, channel, other, first, last, moved)))
        values = sorted({value for value, _ in own})
        cut = {value: one for value in values if (one := clipped_again(look, channel, value))}
        found += [*cut.values(), *[one for value, one in own if value not in cut][:_MOST]]
    return found


def _least_rows(channel: Samples) -> int:
    """Return how many samples that are alike to the last digit are none by chance.

    Of N samples with independent noise, of which two neighbours are alike with the probability p, about
    N p^(n - 1) stretches have n alike, and N p (1 - p) begin: a frozen one is one of those that p is told by.
    """
    count = channel.value.size
    if not channel.is_noisy:
        return LEAST_ROWS
    begun = max(1, len(channel.flat(2)))
    rows = 1.0 + log(BY_CHANCE / count) / log(min(0.5, begun / count))
    return min(LEAST_ROWS, max(LEAST_NOISY_ROWS, ceil(rows)))


def _stands(channel: Samples, other: Samples) -> bool:
    """Say whether a stroke shows one value all along, and the force moves.

    Of a force :mod:`bufferstand.evaluation.plausibility.signal_comparison` says so.
    """
    if channel.value.size < LEAST_ROWS or channel.span > 0.0:
        return False
    largest = max(abs(end) for end in other.ends)
    return other.usual_span > max(
        MOVED * largest, MOVED_SIGMAS * other.sigma, MOVED_STEPS * other.sampling.step
    )


def _standing(look: RunView, channel: Samples, other: Samples) -> Finding:
    start_s, end_s = float(channel.time_s[0]), float(channel.time_s[-1])
    text = (
        f"{channel.name} stands still at {channel.value[0]:.6g} {channel.unit} to the last digit all along, "
        f"frozen or clipped at the end of its range, while the {other.name} moves by {other.usual_span:.3g} "
        f"{other.unit}; look for a stuck wire, a device that does not answer, or a range that is too small"
    )
    cycles, moved = look.all_cycles, other.usual_span
    return Finding(
        "frozen", channel.name, start_s, end_s, cycles, moved, other.unit, text, "spoils", whole_record=True
    )


def _long_enough(channel: Samples, other: Samples, runs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Leave stretches in which the other channel may have moved far enough: it is not faster than it is."""
    if not runs.size:
        return runs
    every = max(1, other.value.size // 100_000)
    time_s, value = other.time_s[::every], other.value[::every]
    speed = np.abs(np.diff(value)) / np.diff(time_s)
    fastest = quantile(speed, _FASTEST)
    if fastest <= 0.0:
        return runs[:0]
    lasts_s = channel.time_s[runs[:, 1]] - channel.time_s[runs[:, 0]]
    return np.asarray(runs[lasts_s * fastest >= MOVED_NOISY * other.span])


def _is_frozen(channel: Samples, other: Samples, first: int, last: int, moved: float) -> bool:
    own, value = channel.sampling, channel.value
    if channel.is_noisy:
        least = max(MOVED_NOISY * other.span, MOVED_SIGMAS * other.sigma, MOVED_STEPS * other.sampling.step)
        return moved > least
    if moved <= MOVED * other.span or last + 1 >= value.size:
        return False
    if channel.quantity == "force" and abs(float(value[last])) < NO_LOAD * channel.span:
        return False
    if channel.quantity == "stroke" and _rises_and_falls(channel, other, first, last):
        return True
    jump = abs(float(value[last + 1] - value[last]))
    least = max(JUMP_SHARE * channel.span, JUMP_STEPS * own.step, JUMP_STEPS * channel.usual_step)
    return jump > least and not _turns(channel, other, last)


def _rises_and_falls(stroke: Samples, force: Samples, first: int, last: int) -> bool:
    """Say whether the force rises and then falls over a stretch by more than a stroke that stands lets it."""
    value = force.value[force.rows(float(stroke.time_s[first]), float(stroke.time_s[last]))]
    if value.size < LEAST_ROWS:
        return False
    top = float(np.max(value))
    rise = min(top - float(value[0]), top - float(value[-1]))
    by_steps = TO_AND_FRO_STEPS * stroke.sampling.step / stroke.span * force.span
    return rise > max(TO_AND_FRO * force.span, by_steps)


def _turns(channel: Samples, other: Samples, last: int) -> bool:
    """Say whether the other channel turns about the end of a stretch."""
    rows = np.clip(np.array([last - _AFTER, last, last + _AFTER]), 0, channel.value.size - 1)
    before, at, after = other.at(channel.time_s[rows]).tolist()
    return bool((at - before) * (after - at) < 0.0)


def _finding(look: RunView, channel: Samples, other: Samples, first: int, last: int, moved: float) -> Finding:
    start_s, end_s = float(channel.time_s[first]), float(channel.time_s[last])
    text = (
        f"{channel.name} frozen: {last - first + 1} samples from {start_s:.6g} to {end_s:.6g} s stay at "
        f"{channel.value[first]:.6g} {channel.unit} to the last digit while the {other.name} moves by "
        f"{moved:.3g} {other.unit}; look for a stuck wire or a device that stopped answering"
    )
    return Finding(
        "frozen",
        channel.name,
        start_s,
        end_s,
        look.touched(start_s, end_s),
        moved,
        other.unit,
        text,
        effect="spoils",
    )
