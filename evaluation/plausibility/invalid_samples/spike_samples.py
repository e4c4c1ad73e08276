"""Spikes: single samples, or two in a row, that the samples on both sides deny.

A spike is a sample that was not taken of the specimen. It is left out before cycles are looked for, as if it
had been lost (docs/evaluation-document.md): what could have happened there is bounded, and part of U. Where
that cannot be done (a record that came averaged, too many of them) the cycles are spoiled.
"""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Effect, Finding
from bufferstand.evaluation.numerics import IndexArray
from bufferstand.evaluation.plausibility.invalid_samples.remove import left_out
from bufferstand.evaluation.plausibility.run_view import Channels, RunView, Samples
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

MOST_LEFT_OUT = 0.01
"""Of a channel, at most this share of the samples is left out."""
COARSE = 0.04
"""Samples are few where every fiftieth step is larger than this share of a channel's span; there …"""
GOES_WITH = 0.02
"""… the other channel goes with a lone sample if it leaves its neighbours by this share of its span."""
NOISE_AT_TURN, SHARE_AT_TURN = 4.0, 0.002
"""The stroke turns there by so many standard deviations of its noise, and this share of its span."""
RINGING = 4.5
"""A channel brought to other instants by splines rings about a spike: 0.3 % are left after so many steps."""
TOO_COARSE = 0.25
"""Where every fiftieth step is larger than this share, nothing tells a spike from a stroke."""
_MOST = 12
"""So many findings a channel; what is left makes one more."""


def spikes(look: RunView) -> list[Finding]:
    """Return the spikes of force and stroke, those of one cycle together.

    Parameters
    ----------
    look : Look

    Returns
    -------
    list of Finding
        ``size`` is how far the largest is from its neighbours.
    """
    found = []
    for channel in look.channels:
        rows = spike_rows(look.seen, channel)
        if rows.size:
            found += _grouped(look, channel, rows)
    return found


def spike_rows(seen: Channels, channel: Samples) -> IndexArray:
    """Return the rows of a channel's spikes: its lone samples, but for those that are the motion itself.

    A force that peaks as the stroke turns may be that of a specimen that meets its stop. Where samples are
    so few that a cycle has a handful, a lone one may be all that is on record of a stroke: the other channel
    goes with it then.
    """
    rows = channel.lone
    if not rows.size:
        return rows
    other = seen.other(channel)
    if other.fast_step > TOO_COARSE * other.span:
        return rows[:0]
    coarse = other.fast_step > COARSE * other.span
    moves = [
        (channel.quantity == "force" and _at_turn(channel, other, row))
        or (coarse and _goes_with(channel, other, row))
        for row in rows.tolist()
    ]
    return np.asarray(rows[~np.array(moves)])


def _step_s(channel: Samples, row: int) -> float:
    at_s = float(channel.time_s[row])
    return float(min(channel.time_s[row + 1] - at_s, at_s - channel.time_s[row - 1]))


def _side(channel: Samples, row: int) -> float:
    return 1.0 if channel.value[row] > channel.value[row - 1] else -1.0


def _at_turn(force: Samples, stroke: Samples, row: int) -> bool:
    """Say whether the stroke turns the way that the force does, within a sample and a half."""
    at_s, step_s, side = float(force.time_s[row]), 1.5 * _step_s(force, row), _side(force, row)
    if stroke.lone.size and np.min(np.abs(stroke.time_s[stroke.lone] - at_s)) < 3.0 * step_s:
        return False
    before, near, after = (
        float(np.max(side * stroke.at(at_s + step_s * np.linspace(low, high, 7))))
        for low, high in ((-3.0, -1.5), (-1.0, 1.0), (1.5, 3.0))
    )
    return near - max(before, after) > max(NOISE_AT_TURN * stroke.sigma, SHARE_AT_TURN * stroke.span)


def _goes_with(channel: Samples, other: Samples, row: int) -> bool:
    """Say whether the other channel leaves its neighbours the same way."""
    at_s, step_s = float(channel.time_s[row]), _step_s(channel, row)
    before, at, after = other.at(at_s + step_s * np.array([-1.0, 0.0, 1.0])).tolist()
    return bool(_side(channel, row) * (at - 0.5 * (before + after)) > GOES_WITH * other.span)


def without_spikes(seen: Channels) -> Record:
    """Return the record without the samples in which a channel has a spike; each leaves a break behind.

    Parameters
    ----------
    seen : Channels

    Returns
    -------
    Record
        The same where there is none, or none can be left out.
    """
    record = seen.record
    gone: dict[int, str] = {}
    for channel in seen.all:
        if not is_left_out(seen, channel):
            continue
        brought = channel.name == "force" and channel.name in record.as_recorded
        for row in spike_rows(seen, channel).tolist():
            at_s = float(channel.time_s[row])
            reach = RINGING if brought else 0.75
            step_s = float(channel.time_s[row + 1] - channel.time_s[row - 1]) / 2.0
            rows = np.flatnonzero(np.abs(record.time_s - at_s) <= reach * step_s)
            gone |= {int(one): f"spike of the {channel.name} at {at_s:.6g} s left out" for one in rows}
    return left_out(record, gone)


def is_left_out(seen: Channels, channel: Samples) -> bool:
    """Say whether a channel's spikes are left out, as samples that were lost."""
    count = spike_rows(seen, channel).size
    return seen.record.averaged == 1 and 0 < count <= max(2, MOST_LEFT_OUT * channel.value.size)


def _grouped(look: RunView, channel: Samples, rows: IndexArray) -> list[Finding]:
    groups: dict[tuple[int, ...], list[int]] = {}
    for row in rows.tolist():
        at_s = float(channel.time_s[row])
        groups.setdefault(look.touched(at_s, at_s), []).append(row)
    parts = list(groups.items())
    if len(parts) > _MOST:
        rest = parts[_MOST:]
        cycles = tuple(sorted({number for own, _ in rest for number in own}))
        parts = [*parts[:_MOST], (cycles, [row for _, own in rest for row in own])]
    left_out = is_left_out(look.seen, channel)
    return [_finding(channel, cycles, own, left_out=left_out) for cycles, own in parts]


def _finding(channel: Samples, cycles: tuple[int, ...], rows: list[int], *, left_out: bool) -> Finding:
    sizes = [_apart(channel, row) for row in rows]
    largest = max(sizes, key=abs)
    where = ", ".join(f"{channel.time_s[row]:.6g} s" for row in rows[:3])
    more = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    what = "a spike" if len(rows) == 1 else f"spikes in {len(rows)} samples"
    effect: Effect = "noted" if left_out else "spoils"
    fate = "left out as no reading" if left_out else "no value of the specimen"
    text = (
        f"{channel.name}: {what} at {where}{more}, {largest:+.3g} {channel.unit} from the samples beside: "
        f"{fate}; look for a loose contact or a disturbance on the line"
    )
    start_s, end_s = float(channel.time_s[rows[0]]), float(channel.time_s[rows[-1]])
    return Finding("spike", channel.name, start_s, end_s, cycles, abs(largest), channel.unit, text, effect)


def _apart(channel: Samples, row: int) -> float:
    """Return how far a sample is from the middle of those two before and two behind it."""
    near = np.append(channel.value[row - 2 : row], channel.value[row + 1 : row + 3])
    return float(channel.value[row]) - median(near)
