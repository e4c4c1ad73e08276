"""Stroke and force of an imported run at common instants, whatever rows and streams they were read in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bufferstand.evaluation.loading.reading_rates import ChannelReadings, IntervalCounts, Rates, within
from bufferstand.evaluation.loading.resample import as_taken, bring, same_instants, usable, usual_step_s
from bufferstand.evaluation.loading.table_rows import Rows, readings_of, without_blanks
from bufferstand.evaluation.numerics import FloatArray, noise_sigma
from bufferstand.evaluation.record import Ends, InterpolationLimits, peaks_of
from bufferstand.foundation import BadInput, to_inside
from bufferstand.foundation.channels import mean_of_strokes, tilt_of_strokes
from bufferstand.recording.runfile import Run, Series, is_record_only

_STEPS_LEFT = 2.0
"""No more steps of the slower channel are left out at the ends of a record without a word."""


@dataclass(frozen=True, eq=False)
class JoinedChannels:
    """Columns of a run at the instants of its stroke, and what a user must know.

    Attributes
    ----------
    time_s, stroke_mm, force_kN : arrays, shape (N,)
    wire_difference_mm, speed_mm_per_s : array, shape (N,), or None
    between : Between, or None
        Where the force was interpolated between readings that are not more frequent than the stroke's.
    problems : tuple of str
    clock_s : float
        Step of the clock, where readings share its stamps.
    ends : mapping of str to (Peak, Peak)
        Least and greatest reading of each channel among its own, also of those that are left out.
    as_recorded : mapping of str to (array, array)
        Readings that are brought to other instants, or are of two draw wires, as they were.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    wire_difference_mm: FloatArray | None
    speed_mm_per_s: FloatArray | None
    between: InterpolationLimits | None
    problems: tuple[str, ...] = ()
    clock_s: float = 0.0
    ends: Mapping[str, Ends] = field(default_factory=dict)
    as_recorded: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)


def channels_of(run: Run, wires: Sequence[str]) -> list[str]:
    """Return the channels that make up a record: the draw wires, force and, where there is one, speed."""
    return [*wires, "force", *(["speed"] if run.has("speed") else [])]


def _is_foreign(run: Run) -> bool:
    """Say whether force and stroke may come by different ways: imported, only recorded, or of two clocks."""
    if run.metadata.get("original") or is_record_only(run.metadata):
        return True
    return bool(run.other_clocks.lines) and run.stream_of("force").name != run.stream_of("stroke").name


def are_of_streams(run: Run, wires: Sequence[str]) -> bool:
    """Say whether the channels of an imported run are in different streams."""
    names = channels_of(run, wires)
    if not _is_foreign(run) or not all(run.has(name) for name in names):
        return False
    return len({run.stream_of(name).name for name in names}) > 1


def are_apart(run: Run, wires: Sequence[str]) -> bool:
    """Say whether channels of an imported run must be brought together: not one row of each for each instant.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        The draw wires that make up the stroke.
    """
    names = channels_of(run, wires)
    if not _is_foreign(run) or not all(run.has(name) for name in names):
        return False
    if are_of_streams(run, wires):
        return True
    series = [run.series(name) for name in names]
    if any(without_blanks(each.time_s, each.value)[0] is not each.time_s for each in series):
        return True
    return not readings_of(series[0].time_s, [each.value for each in series]).are_all


def joined(run: Run, wires: Sequence[str]) -> JoinedChannels:
    """Return the columns of an imported run at the instants at which its stroke was read.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        The draw wires that make up the stroke; of several, the first one's instants count.

    Raises
    ------
    BadInput
        If there is no force, or it and the stroke are nowhere read often enough to show what the other does.
    """
    readings, clock_s = _readings(run, channels_of(run, wires))
    base = readings[wires[0]]
    stroke, difference = base.value, None
    if len(wires) > 1:
        values = [base.value, *(_at(readings[name], base.time_s) for name in wires[1:])]
        stroke, difference = mean_of_strokes(values), tilt_of_strokes(values)
    force, between, problems = _force_at(run, readings["force"], ChannelReadings(base.time_s, stroke))
    speed = _at(readings["speed"], base.time_s) if "speed" in readings else None
    apart = not same_instants(readings["force"].time_s, base.time_s)
    common = _common(base.time_s, force) if apart else slice(0, base.time_s.size)
    begin, end = float(base.time_s[common.start]), float(base.time_s[common.stop - 1])
    left_s = max(begin - float(base.time_s[0]), float(base.time_s[-1]) - end)
    if left_s > _STEPS_LEFT * max(usual_step_s(base.time_s), usual_step_s(readings["force"].time_s)):
        problems.append(
            f"stroke and force are both on record from {begin:.6g} to {end:.6g} s only: the rest is left out"
        )
    return JoinedChannels(
        base.time_s[common],
        stroke[common],
        force[common],
        None if difference is None else difference[common],
        None if speed is None else speed[common],
        between,
        tuple(problems),
        clock_s,
        _ends(readings, ChannelReadings(base.time_s, stroke), wires),
        {
            name: as_taken(*readings[name])
            for name in (*wires, "force")
            if (apart if name == "force" else len(wires) > 1)
        },
    )


def _ends(
    readings: Mapping[str, ChannelReadings], stroke: ChannelReadings, wires: Sequence[str]
) -> dict[str, Ends]:
    columns = {name: each for name, each in readings.items() if len(wires) > 1 or name not in wires}
    columns["stroke"] = stroke
    found = {name: peaks_of(each.time_s, each.value) for name, each in columns.items()}
    return {name: ends for name, ends in found.items() if ends is not None}


def _readings(run: Run, names: Sequence[str]) -> tuple[dict[str, ChannelReadings], float]:
    """Return the readings of each channel, in its inside unit, without blanks, each row once; and the step of
    the clock whose stamps they share, if they do.
    """
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
        found[name] = ChannelReadings(*without_blanks(own_rows.time_s(each.time_s), value))
    return found, max((own.clock_s for own in rows.values()), default=0.0)


def _at(own: ChannelReadings, time_s: FloatArray) -> FloatArray:
    if same_instants(own.time_s, time_s):
        return own.value
    return bring(*usable(*own), time_s).value


def _force_at(
    run: Run, force: ChannelReadings, stroke: ChannelReadings
) -> tuple[FloatArray, InterpolationLimits | None, list[str]]:
    """Return the force at the instants of the stroke, NaN where one of them is read too seldom."""
    if same_instants(force.time_s, stroke.time_s):
        return force.value, None, []
    force, known = ChannelReadings(*usable(*force)), ChannelReadings(*usable(*stroke))
    brought = bring(*force, stroke.time_s)
    value = brought.value
    rates = Rates.of(usual_step_s(known.time_s), usual_step_s(force.time_s), known.value, force.value)
    there = np.isfinite(stroke.time_s)
    between = None
    if rates.slow != "stroke":
        step_s = usual_step_s(force.time_s)
        between = InterpolationLimits(
            step_s, stroke.time_s[there], brought.halved[:, there], noise_sigma(force.value)
        )
    coarse = rates.too_coarse(known, force)
    if coarse is None or not coarse.any():
        return value, between, []
    slow = force if rates.slow == "force" else known
    seen = IntervalCounts()
    seen.look(slow.time_s, coarse)
    if coarse.all():
        raise BadInput(seen.text(rates), file=run.path, place=f"channel {rates.slow}", remedy=rates.remedy)
    value[within(slow.time_s, coarse, stroke.time_s)] = np.nan
    return value, between, [f"{seen.text(rates)}: nothing is evaluated there; {rates.remedy}"]


def _common(time_s: FloatArray, force_kN: FloatArray) -> slice:
    """Return the samples from the first to the last one that has a force."""
    there = np.flatnonzero(np.isfinite(force_kN))
    return slice(int(there[0]), int(there[-1]) + 1) if there.size else slice(0, time_s.size)
