"""Curves out of the runs' samples: the loop of a cycle, and the channels on the campaign's clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bufferstand.evaluation.figures import Floats, LoopCurve, TimelineStep, Trace, kept_samples, with_breaks
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.report.content import usable
from bufferstand.evaluation.report.source.source import ReportRun
from bufferstand.evaluation.wording import said, status_words

_RUN_POINTS = 1500
_LONGEST_SENSOR_STEPS = 5.0


def loop_of(run: ReportRun, cycle: Mapping[str, Any]) -> LoopCurve | None:
    """Return the samples of one cycle, or None if the run has none there."""
    start, end = usable(cycle.get("start_s")), usable(cycle.get("end_s"))
    if run.record is None or start is None or end is None:
        return None
    inside = np.flatnonzero((run.record.time_s >= start) & (run.record.time_s <= end))
    if inside.size < 3:
        return None
    stroke, force = _broken(run.record, int(inside[0]), int(inside[-1]) + 1)
    return LoopCurve(
        run=str(run.number),
        cycle=int(cycle["index"]),
        stroke_mm=stroke,
        force_kN=force,
        prestress_mm=usable(cycle.get("prestress_mm")),
        amplitude_mm=usable(cycle.get("amplitude_mm")),
        frequency_Hz=usable(cycle.get("frequency_Hz")),
    )


def _broken(record: Record, first: int, end: int) -> tuple[Floats, Floats]:
    """Return stroke and force with a NaN at every break, so that no line is drawn across it."""
    at = [index - first for index in record.breaks if first < index < end]
    stroke = np.insert(record.stroke_mm[first:end], at, np.nan)
    return stroke, np.insert(record.force_kN[first:end], at, np.nan)


def at_strokes(loop: LoopCurve, strokes_mm: Sequence[float]) -> list[tuple[float | None, float | None]]:
    """Return the force of a loop on its loading and unloading branch at given strokes, by interpolation.

    Parameters
    ----------
    loop : Loop
        A cycle that begins with loading.
    strokes_mm : sequence of float
        Where to read [mm].

    Returns
    -------
    list of (float or None, float or None)
        Loading and unloading force [kN]; None where the branch does not reach or samples are missing.
    """
    top = int(np.nanargmax(loop.stroke_mm))
    branches = [
        (loop.stroke_mm[: top + 1], loop.force_kN[: top + 1]),
        (loop.stroke_mm[top:], loop.force_kN[top:]),
    ]
    read = [[_interpolated(stroke, force, at) for at in strokes_mm] for stroke, force in branches]
    return list(zip(*read, strict=True))


def _interpolated(stroke: Floats, force: Floats, at: float) -> float | None:
    whole = ~np.isnan(stroke)
    if np.count_nonzero(whole) < 2:
        return None
    x, y = stroke[whole], force[whole]
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    right = int(np.searchsorted(x, at))
    if right == x.size or (right == 0 and x[0] > at):
        return None
    # Neighbours far apart lie on either side of a gap in the record.
    left = max(0, right - 1)
    if x[right] - x[left] > 2.0:
        return None
    return float(np.interp(at, x, y))


@dataclass(frozen=True, eq=False)
class CampaignClock:
    """When each run began on the campaign's clock [s]; ``note`` says how that was found."""

    starts_s: tuple[float, ...]
    note: str


def campaign_clock(runs: Sequence[ReportRun]) -> CampaignClock:
    """Place the runs on one time axis.

    By their recorded start where every run has one and none overlaps the next; else one behind the other,
    which the note says.
    """
    lengths = [run.duration_s for run in runs]
    end_to_end = tuple(float(s) for s in np.concatenate([[0.0], np.cumsum(lengths)[:-1]])) if runs else ()
    starts = [run.started for run in runs]
    known = [start for start in starts if start is not None]
    if len(known) < len(runs):
        return CampaignClock(
            end_to_end, said("Start times are not on record: the runs are drawn one after the other.")
        )
    offsets = tuple((start - known[0]).total_seconds() for start in known)
    pairs = zip(offsets, lengths, offsets[1:], strict=False)
    if any(start + length > following + 1.0 for start, length, following in pairs):
        return CampaignClock(
            end_to_end,
            said("The stand ran faster than the clock on the wall: the runs are drawn one after the other."),
        )
    return CampaignClock(offsets, "")


def steps_of(runs: Sequence[ReportRun], clock: CampaignClock) -> list[TimelineStep]:
    """Return the runs as steps on the campaign's clock."""
    return [
        TimelineStep(
            str(run.number),
            start,
            start + run.duration_s,
            status_words(run.status) if run.status in {"stopped", "failed"} else "",
        )
        for run, start in zip(runs, clock.starts_s, strict=True)
    ]


def stroke_trace(runs: Sequence[ReportRun], clock: CampaignClock) -> Trace:
    """Return the stroke of all runs on the campaign's clock, thinned for drawing."""
    times: list[Floats] = []
    values: list[Floats] = []
    for run, start in zip(runs, clock.starts_s, strict=True):
        if run.record is None:
            continue
        at = list(run.record.breaks)
        time = np.insert(run.record.time_s, at, np.nan)
        stroke = np.insert(run.record.stroke_mm, at, np.nan)
        kept = kept_samples(time, stroke, _RUN_POINTS)
        times += [time[kept] + start, np.array([np.nan])]
        values += [stroke[kept], np.array([np.nan])]
    return _trace(said("stroke"), times, values)


def energy_trace(runs: Sequence[ReportRun], clock: CampaignClock) -> Trace | None:
    """Return the energy [J] that the complete cycles absorbed since the start of the first run.

    It rises at the end of each cycle by what the evaluation found for it, and stays between runs.

    Returns
    -------
    Trace or None
        None where no cycle has an absorbed energy.
    """
    times, values, total = [0.0], [0.0], 0.0
    for run, start in zip(runs, clock.starts_s, strict=True):
        for cycle in run.cycles:
            end, absorbed = usable(cycle.get("end_s")), usable(cycle.get("absorbed_energy_J"))
            if end is None or absorbed is None:
                continue
            times += [start + end, start + end]
            values += [total, total + absorbed]
            total += absorbed
    if len(times) == 1:
        return None
    last = max(start + run.duration_s for run, start in zip(runs, clock.starts_s, strict=True))
    times.append(max(last, times[-1]))
    values.append(total)
    return Trace(said("energy absorbed by complete cycles"), np.array(times), np.array(values))


def temperature_traces(runs: Sequence[ReportRun], clock: CampaignClock) -> list[Trace]:
    """Return each temperature sensor of all runs on the campaign's clock; no line joins two runs."""
    times: dict[str, list[Floats]] = {}
    values: dict[str, list[Floats]] = {}
    for run, start in zip(runs, clock.starts_s, strict=True):
        for sensor in run.record.temperatures if run.record is not None else ():
            if sensor.time_s.size == 0:
                continue
            usual = float(np.median(np.diff(sensor.time_s))) if sensor.time_s.size > 1 else 1.0
            time, value = with_breaks(sensor.time_s, sensor.temperature_C, _LONGEST_SENSOR_STEPS * usual)
            label = sensor.place or sensor.name
            times.setdefault(label, []).extend([time + start, np.array([np.nan])])
            values.setdefault(label, []).extend([value, np.array([np.nan])])
    return [_trace(label, times[label], values[label]) for label in times]


def _trace(label: str, times: Sequence[Floats], values: Sequence[Floats]) -> Trace:
    if not times:
        return Trace(label, np.empty(0), np.empty(0))
    return Trace(label, np.concatenate(times), np.concatenate(values))
