"""A position that jumps where neither the draw wires nor its command do: the encoder slipped.

Whatever is then found between position, command and wires comes from the leap, and from no delay, no scale of
before and no wire. No piston goes from one speed to another and back within some hundredths of a second.
"""

from __future__ import annotations

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.sample_points import POINT_S, Floats, SamplePoints

LEAPS_MM = 0.8
"""A leap of less is none [mm]: what the judges doubt is more, and an encoder's noise is a tenth of it."""
WIDE = 2
"""A leap lies within so many points, wherever it falls between their ends."""
SIGMAS = 8.0
"""… nor one within so many times the noise: a channel that scatters leaps all the time."""
OTHERS = 0.3
"""Command and wires go with it by less than this share of it."""
LATELY_S = 6.0
"""So far back a leap is looked for [s]."""
SHOWS_MM = 4.0
"""Behind the leap so much of a way tells a new scale from a slip [mm]."""
NEARER = 0.5
"""… and it is a new scale if the way shows that by more than this share of it."""


def leapt(points: SamplePoints) -> SignalDoubt | None:
    """Return the doubt of a position that has leapt lately, None where it has not, or nothing else tells.

    Parameters
    ----------
    points : Points
        Of the controller.
    """
    position, command = points.column("position"), points.column("command")
    wires = [column for name in points.wires if (column := points.column(name)) is not None]
    if position is None or command is None or not wires:
        return None
    table = points.table
    rows = table[table[:, 0] >= table[-1, 0] - LATELY_S] if len(table) else table
    if len(rows) < 3 * WIDE + 2:
        return None
    steady = _without_gap(rows[:, 0])
    own = np.where(steady, _kinks(rows[:, position]), 0.0)
    at = int(np.argmax(np.abs(own)))
    leap_mm = float(own[at])
    others = [float(_kinks(rows[:, column])[at]) for column in (command, *wires)]
    noise_mm = 1.4826 * float(np.median(np.abs(own)))
    if abs(leap_mm) < LEAPS_MM + SIGMAS * noise_mm or max(abs(one) for one in others) > OTHERS * abs(leap_mm):
        return None
    before, behind = rows[at + WIDE], rows[at + 2 * WIDE :]
    return _doubt(leap_mm, float(before[position]), _scale(behind, position, wires))


def _kinks(values: Floats) -> Floats:
    """Return by how much each change over ``WIDE`` points differs from those before and behind it."""
    changes = values[WIDE:] - values[:-WIDE]
    return np.asarray(changes[WIDE:-WIDE] - 0.5 * (changes[: -2 * WIDE] + changes[2 * WIDE :]))


def _without_gap(time_s: Floats) -> np.ndarray:
    """Return for each of the kinks whether its points follow each other."""
    spans_s = time_s[3 * WIDE :] - time_s[: -3 * WIDE]
    return np.asarray(spans_s < (3 * WIDE + 1) * POINT_S)


def _scale(behind: Floats, position: int, wires: list[int]) -> float | None:
    """Return the position's way per way of the wires behind the leap; None if that is too little."""
    way = behind[:, wires].mean(axis=1)
    if len(behind) < 3 or float(np.ptp(way)) < SHOWS_MM:
        return None
    return float(np.polyfit(way, behind[:, position], 1)[0])


def _doubt(leap_mm: float, from_mm: float, scale: float | None) -> SignalDoubt:
    seen = (
        f"the piston's position leapt by {leap_mm:+.1f} mm at {from_mm:.1f} mm, and neither its command nor "
        "a draw wire did"
    )
    times = 1.0 + leap_mm / from_mm if from_mm > abs(leap_mm) else None
    kind: Kind = "slipped"
    how = "it has slipped"
    if times is not None and scale is None:
        how = f"it has slipped, or its scale has changed to {times:.2f} times what it was"
    elif times is not None and scale is not None and abs(scale - times) < NEARER * abs(times - 1.0):
        kind, how = "scale", f"its scale has changed to {times:.2f} times what it was"
    setting = channel_setting("position", "calibration")
    return SignalDoubt(kind, "position", "controller", setting, f"{seen}: {how}", leap_mm, LEAPS_MM, "mm")
