"""Codes in the place of a reading: overflow, no sensor, not measured (9.91E37, ±9999, ±1E9 …).

No stand reaches them. They leave before anything is looked at or is called an extreme, as if they were lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evaluation.channels.signals import MOST, Signals
from evaluation.plausibility.channels import Channels
from evaluation.plausibility.coded import Coded
from evaluation.plausibility.finding import Finding
from evaluation.plausibility.leave_out import left_out
from evaluation.plausibility.look import Look
from evaluation.plausibility.samples import Samples
from evaluation.record import FloatArray, Record
from foundation.ranks import median

_NEAREST = 0.75


def codes(look: Look) -> list[Finding]:
    """Return the codes that were left out before cycles were looked for.

    Parameters
    ----------
    look : Look
    """
    return [one.finding(look.touched_by(one.time_s, one.time_s)) for one in look.coded]


def without_codes(seen: Channels) -> tuple[Channels, tuple[Coded, ...]]:
    """Return the channels without codes, and what there were.

    Parameters
    ----------
    seen : Channels

    Returns
    -------
    (Channels, tuple of Coded)
        The same channels where there are none.
    """
    coded = {channel.name: channel.codes for channel in seen.all}
    found = tuple(
        Coded(channel.name, channel.unit, channel.time_s[rows], channel.value[rows])
        for channel in seen.all
        if (rows := coded[channel.name]).size
    )
    if not found:
        return seen, ()
    record = seen.record
    gone: dict[int, str] = {}
    for channel in seen.all:
        rows = coded[channel.name]
        if rows.size:
            text = f"code in the {channel.name} at"
            gone |= {
                row: f"{text} {record.time_s[row]:.6g} s left out" for row in _near(record, channel, rows)
            }
    wrong = {one.channel for one in found} | {"stroke" for one in found if one.channel.startswith("stroke")}
    left = replace(
        left_out(record, gone),
        as_recorded=_cleaned(record, seen, coded),
        ends={name: ends for name, ends in record.ends.items() if name not in wrong},
        signals=None if record.signals is None else _without(record.signals, seen, coded),
    )
    return Channels(left), found


def _without(signals: Signals, seen: Channels, coded: Mapping[str, NDArray[np.intp]]) -> Signals:
    """Return signals that go straight on where one has a code, and where a code is interpolated to."""
    by_name = dict(signals.by_name)
    for channel in seen.all:
        rows, value = coded[channel.name], by_name.get(channel.name)
        if value is None or not rows.size:
            continue
        every, last = -(-channel.time_s.size // MOST), channel.time_s.size - 1
        from_s = channel.time_s[np.maximum(rows - every, 0)]
        to_s = channel.time_s[np.minimum(rows + every, last)]
        begun = np.searchsorted(from_s, signals.time_s, side="right")
        over = np.searchsorted(to_s, signals.time_s, side="right")
        read = begun == over
        if read.any():
            by_name[channel.name] = np.interp(signals.time_s, signals.time_s[read], value[read])
    return replace(signals, by_name=by_name)


def _near(record: Record, channel: Samples, rows: NDArray[np.intp]) -> list[int]:
    """Return the rows of the record that are not true because of some of a channel's."""
    if channel.time_s.size == record.time_s.size and channel.name not in record.as_recorded:
        return [int(row) for row in rows]
    step_s = median(np.diff(channel.time_s))
    reach_s = 4.5 * step_s if channel.quantity == "force" else _NEAREST * step_s
    at_s = channel.time_s[rows]
    after = np.clip(np.searchsorted(at_s, record.time_s), 0, at_s.size - 1)
    before = np.maximum(after - 1, 0)
    apart = np.minimum(np.abs(record.time_s - at_s[after]), np.abs(record.time_s - at_s[before]))
    return [int(row) for row in np.flatnonzero(apart <= reach_s)]


def _cleaned(
    record: Record, seen: Channels, coded: Mapping[str, NDArray[np.intp]]
) -> dict[str, tuple[FloatArray, FloatArray]]:
    channels = {channel.name: channel for channel in seen.all if channel.name in record.as_recorded}
    return {
        name: (np.delete(one.time_s, coded[name]), np.delete(one.value, coded[name]))
        for name, one in channels.items()
    }
