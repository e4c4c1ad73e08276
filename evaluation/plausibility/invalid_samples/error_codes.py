"""Codes in the place of a reading: overflow, no sensor, not measured (9.91E37, ±9999, ±1E9 …).

No stand reaches them. They leave before anything is looked at or is called an extreme, as if they were lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.invalid_samples.remove import left_out
from bufferstand.evaluation.plausibility.run_view import Channels, ErrorCodes, RunView, Samples
from bufferstand.evaluation.record import MOST, Record, Signals
from bufferstand.foundation import BadInput
from bufferstand.foundation.numbers import median

_NEAREST = 0.75
_TAIL = 0.268
"""What a spline makes of a sample that is off falls by this factor from sample to sample (2 - √3): a code of
1e38 reaches over 66 of them."""
_LEFT = 1e-6
"""So much of it, as a share of what the channel spans, is nothing."""


def codes(look: RunView) -> list[Finding]:
    """Return the codes that were left out before cycles were looked for.

    Parameters
    ----------
    look : Look
    """
    return [one.finding(look.touched_by(one.time_s, one.time_s)) for one in look.coded]


def without_codes(seen: Channels) -> tuple[Channels, tuple[ErrorCodes, ...]]:
    """Return the channels without codes, and what there were.

    Parameters
    ----------
    seen : Channels

    Returns
    -------
    (Channels, tuple of Coded)
        The same channels where there are none.

    Raises
    ------
    BadInput
        If a channel has nothing but codes.
    """
    coded = {channel.name: channel.codes for channel in seen.all}
    for channel in seen.all:
        if 0 < channel.time_s.size == coded[channel.name].size:
            raise BadInput(
                f"each of its {channel.time_s.size} samples is a code in the place of a reading",
                place=f"channel {channel.name}",
                remedy="look at the sensor and its cable, and record the test again",
            )
    found = tuple(
        ErrorCodes(channel.name, channel.unit, channel.time_s[rows], channel.value[rows])
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
    cleaned = _cleaned(record, seen, coded)
    left = replace(
        left_out(_without_tails(record, seen, coded, cleaned), gone),
        as_recorded=cleaned,
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
    return [int(row) for row in _within(record.time_s, channel.time_s[rows], reach_s)]


def _without_tails(
    record: Record,
    seen: Channels,
    coded: Mapping[str, NDArray[np.intp]],
    cleaned: Mapping[str, tuple[FloatArray, FloatArray]],
) -> Record:
    """Return a record whose force, interpolated by a spline, goes straight between readings about a code."""
    force, rows = seen.force, coded["force"]
    if not rows.size or "force" not in cleaned:
        return record
    time_s, value = cleaned["force"]
    span = float(np.ptp(value)) or 1.0
    samples = np.log(_LEFT * span / float(np.max(np.abs(force.value[rows])))) / np.log(_TAIL)
    about = _within(record.time_s, force.time_s[rows], float(samples) * median(np.diff(force.time_s)))
    force_kN = record.force_kN.copy()
    force_kN[about] = np.interp(record.time_s[about], time_s, value)
    return replace(record, force_kN=force_kN)


def _within(time_s: FloatArray, at_s: FloatArray, reach_s: float) -> NDArray[np.intp]:
    """Return the rows that are within reach of some moments."""
    after = np.clip(np.searchsorted(at_s, time_s), 0, at_s.size - 1)
    before = np.maximum(after - 1, 0)
    apart = np.minimum(np.abs(time_s - at_s[after]), np.abs(time_s - at_s[before]))
    return np.asarray(np.flatnonzero(apart <= reach_s), dtype=np.intp)


def _cleaned(
    record: Record, seen: Channels, coded: Mapping[str, NDArray[np.intp]]
) -> dict[str, tuple[FloatArray, FloatArray]]:
    channels = {channel.name: channel for channel in seen.all if channel.name in record.as_recorded}
    return {
        name: (np.delete(one.time_s, coded[name]), np.delete(one.value, coded[name]))
        for name, one in channels.items()
    }
