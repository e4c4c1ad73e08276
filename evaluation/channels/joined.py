"""Stroke and force of an imported run at common instants, whatever rows and streams they were read in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.channels.bring import bring, too_coarse, usable, usual_step_s
from evaluation.channels.rows import Rows, readings_of, without_blanks
from evaluation.long_runs import same_instants
from evaluation.reversals import noise_sigma
from foundation.errors import BadInput
from foundation.units import to_inside
from recording.run import Run, Series

FloatArray = NDArray[np.float64]

STROKE_OFF, FORCE_OFF = 0.05, 0.25
"""Between readings of the other channel, stroke and force may leave the straight line by this share of their
range: 7 readings a cycle of a sine, and 3. (A force may jump where a stroke turns, a stroke cannot.)"""
_NOISES = 8.0
_SLOWER = 1.2
_STEPS_LEFT = 2.0
"""No more steps of the slower channel are left out at the ends of a record without a word."""


@dataclass(frozen=True, eq=False)
class Joined:
    """Columns of a run at the instants of its stroke, and what a user must know.

    Attributes
    ----------
    time_s, stroke_mm, force_kN : arrays, shape (N,)
    wire_difference_mm, speed_mm_per_s : array, shape (N,), or None
    problems : tuple of str
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    wire_difference_mm: FloatArray | None
    speed_mm_per_s: FloatArray | None
    problems: tuple[str, ...] = ()


class _Readings(NamedTuple):
    time_s: FloatArray
    value: FloatArray


def are_apart(run: Run, wires: Sequence[str]) -> bool:
    """Say whether channels of an imported run must be brought together: not one row of each for each instant.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        The draw wires that make up the stroke.
    """
    names = [*wires, "force"]
    if not run.metadata.get("original") or not all(run.has(name) for name in names):
        return False
    if len({run.stream_of(name).name for name in names}) > 1:
        return True
    series = [run.series(name) for name in names]
    if any(without_blanks(each.time_s, each.value)[0] is not each.time_s for each in series):
        return True
    return not readings_of(series[0].time_s, [each.value for each in series]).are_all


def joined(run: Run, wires: Sequence[str]) -> Joined:
    """Return the columns of an imported run at the instants at which its stroke was read.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        The draw wires that make up the stroke; of two, the first one's instants count.

    Raises
    ------
    BadInput
        If there is no force, or it and the stroke are nowhere read often enough to show what the other does.
    """
    others = [name for name in ("force", "speed") if name == "force" or run.has(name)]
    readings = _readings(run, [*wires, *others])
    base = readings[wires[0]]
    stroke, difference = base.value, None
    if len(wires) > 1:
        two = _at(readings[wires[1]], base.time_s)
        stroke, difference = 0.5 * (base.value + two), base.value - two
    force, problems = _force_at(run, readings["force"], _Readings(base.time_s, stroke))
    speed = _at(readings["speed"], base.time_s) if "speed" in readings else None
    apart = not same_instants(readings["force"].time_s, base.time_s)
    common = _common(base.time_s, force) if apart else slice(0, base.time_s.size)
    begin, end = float(base.time_s[common.start]), float(base.time_s[common.stop - 1])
    left_s = max(begin - float(base.time_s[0]), float(base.time_s[-1]) - end)
    if left_s > _STEPS_LEFT * max(usual_step_s(base.time_s), usual_step_s(readings["force"].time_s)):
        problems.append(
            f"stroke and force are both on record from {begin:.6g} to {end:.6g} s only: the rest is left out"
        )
    return Joined(
        base.time_s[common],
        stroke[common],
        force[common],
        None if difference is None else difference[common],
        None if speed is None else speed[common],
        tuple(problems),
    )


def _readings(run: Run, names: Sequence[str]) -> dict[str, _Readings]:
    """Return the readings of each channel, in its inside unit: without blanks, each row once."""
    series: dict[str, Series] = {name: run.series(name) for name in names}
    streams = {name: run.stream_of(name).name for name in names}
    rows: dict[str, Rows] = {}
    for stream in dict.fromkeys(streams.values()):
        own = [series[name] for name in names if streams[name] == stream]
        rows[stream] = readings_of(own[0].time_s, [each.value for each in own])
    found = {}
    for name, each in series.items():
        own_rows = rows[streams[name]]
        quantity = name.split("_", maxsplit=1)[0]
        value = to_inside(own_rows.of(each.value), quantity, each.unit)
        found[name] = _Readings(*without_blanks(own_rows.time_s(each.time_s), value))
    return found


def _at(own: _Readings, time_s: FloatArray) -> FloatArray:
    if same_instants(own.time_s, time_s):
        return own.value
    return bring(*usable(*own), time_s).value


def _force_at(run: Run, force: _Readings, stroke: _Readings) -> tuple[FloatArray, list[str]]:
    """Return the force at the instants of the stroke, NaN where one of them is read too seldom."""
    if same_instants(force.time_s, stroke.time_s):
        return force.value, []
    force, known = _Readings(*usable(*force)), _Readings(*usable(*stroke))
    value = bring(*force, stroke.time_s).value
    force_step_s, stroke_step_s = usual_step_s(force.time_s), usual_step_s(known.time_s)
    if force_step_s > _SLOWER * stroke_step_s:
        name, slow, fast, share = "force", force, known, STROKE_OFF
    elif stroke_step_s > _SLOWER * force_step_s:
        name, slow, fast, share = "stroke", known, force, FORCE_OFF
    else:
        return value, []
    limit = max(share * float(np.ptp(fast.value)), _NOISES * noise_sigma(fast.value))
    coarse = too_coarse(slow.time_s, fast.time_s, fast.value, limit)
    if not coarse.any():
        return value, []
    text = _too_seldom(name, slow.time_s, coarse)
    remedy = f"record or export the {name} at a higher rate"
    if coarse.all():
        raise BadInput(text, file=run.path, place=f"channel {name}", remedy=remedy)
    place = np.searchsorted(slow.time_s, stroke.time_s, side="right") - 1
    inside = (place >= 0) & (place < coarse.size)
    value[inside] = np.where(coarse[place[inside]], np.nan, value[inside])
    return value, [f"{text}: nothing is evaluated there; {remedy}"]


def _too_seldom(name: str, slow_s: FloatArray, coarse: NDArray[np.bool_]) -> str:
    other = "stroke" if name == "force" else "force"
    where = f"in {np.count_nonzero(coarse)} of {coarse.size} intervals"
    return (
        f"{name} is read every {usual_step_s(slow_s):.3g} s only, and {where}, the first at "
        f"{float(slow_s[np.argmax(coarse)]):.6g} s, the {other} moves more than that can show"
    )


def _common(time_s: FloatArray, force_kN: FloatArray) -> slice:
    """Return the samples from the first to the last one that has a force."""
    there = np.flatnonzero(np.isfinite(force_kN))
    return slice(int(there[0]), int(there[-1]) + 1) if there.size else slice(0, time_s.size)
