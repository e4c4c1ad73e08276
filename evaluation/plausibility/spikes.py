"""Spikes: single samples, or two in a row, that the samples on both sides deny."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evaluation.plausibility.finding import Finding
from evaluation.plausibility.look import Look, Samples

_MOST = 12
"""So many findings a channel; what is left makes one more."""
_TIPS = 0.5
"""A force that peaks at this share of the stroke's turns is that of a specimen that meets its stop."""


def spikes(look: Look) -> list[Finding]:
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
        rows = channel.lone
        if channel.quantity == "force" and rows.size:
            rows = _without_tips(look, channel, rows)
        if rows.size:
            found += _grouped(look, channel, rows)
    return found


def _without_tips(look: Look, force: Samples, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Leave out what is a peak of the force at the turn of the stroke, as in most other cycles."""
    at_s = force.time_s[rows]
    moments = [turn for r in look.results for turn in (r.cycle.top.time_s, r.cycle.end.time_s)]
    if not moments:
        return rows
    turns_s = np.unique(moments)
    place = np.clip(np.searchsorted(turns_s, at_s), 1, max(turns_s.size - 1, 1))
    nearest = np.minimum(
        np.abs(at_s - turns_s[np.minimum(place, turns_s.size - 1)]), np.abs(at_s - turns_s[place - 1])
    )
    step_s = np.minimum(force.time_s[rows + 1] - at_s, at_s - force.time_s[rows - 1])
    tip = nearest <= 1.5 * step_s
    return rows[~tip] if np.count_nonzero(tip) >= max(1.0, _TIPS * len(look.results)) else rows


def _grouped(look: Look, channel: Samples, rows: NDArray[np.intp]) -> list[Finding]:
    groups: dict[tuple[int, ...], list[int]] = {}
    for row in rows.tolist():
        at_s = float(channel.time_s[row])
        groups.setdefault(look.touched(at_s, at_s), []).append(row)
    parts = list(groups.items())
    if len(parts) > _MOST:
        rest = parts[_MOST:]
        cycles = tuple(sorted({number for own, _ in rest for number in own}))
        parts = [*parts[:_MOST], (cycles, [row for _, own in rest for row in own])]
    return [_finding(channel, cycles, own) for cycles, own in parts]


def _finding(channel: Samples, cycles: tuple[int, ...], rows: list[int]) -> Finding:
    sizes = [_apart(channel, row) for row in rows]
    largest = max(sizes, key=abs)
    where = ", ".join(f"{channel.time_s[row]:.6g} s" for row in rows[:3])
    more = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    what = "a spike" if len(rows) == 1 else f"spikes in {len(rows)} samples"
    text = (
        f"{channel.name}: {what} at {where}{more}, {largest:+.3g} {channel.unit} from the samples beside: "
        "no value of the specimen; look for a loose contact or a disturbance on the line"
    )
    start_s, end_s = float(channel.time_s[rows[0]]), float(channel.time_s[rows[-1]])
    return Finding(
        "spike", channel.name, start_s, end_s, cycles, abs(largest), channel.unit, text, effect="spoils"
    )


def _apart(channel: Samples, row: int) -> float:
    """Return how far a sample is from the middle of those two before and two behind it."""
    near = np.append(channel.value[row - 2 : row], channel.value[row + 1 : row + 3])
    return float(channel.value[row] - np.median(near))
