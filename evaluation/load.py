"""From a run file to what evaluation works on: one time base, and the facts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
from scipy.interpolate import CubicSpline

from evaluation.inertia import ForceCell
from evaluation.record import FloatArray, Record, Temperature, make_record
from evaluation.results import RunFacts
from foundation.channel import Channel, ChannelUncertainty
from foundation.errors import BadInput
from foundation.specimen import Kind
from foundation.units import to_inside
from recording.run import STROKES, Run
from recording.runfile import open_run

_SAME_INSTANT_S = 1e-9
_EMPTY: FloatArray = np.zeros(0)


def load_run(path: Path) -> tuple[Record, RunFacts]:
    """Read a run file.

    Returns
    -------
    (Record, RunFacts)
        A run that ended before it had samples gives an empty record, and says so in ``facts.problems``.

    Raises
    ------
    BadInput
        If it is no run file, is damaged, or lacks force or stroke.
    """
    run = open_run(path)
    facts = _facts(run)
    try:
        return _record(run), facts
    except BadInput as error:
        if any(stream.rows > 1 for stream in run.streams.values()):
            raise _explained(run, error) from None
        problem = f"nothing to evaluate: the run holds no samples (status {run.status}) {run.reason}".rstrip()
        return Record(_EMPTY, _EMPTY, _EMPTY), replace(facts, problems=(*facts.problems, problem))


def _explained(run: Run, error: BadInput) -> BadInput:
    """Return what is wrong with a record that cannot be used: which of its columns hold no number."""
    for name in ("force", *STROKES):
        if not run.has(name):
            continue
        value = run.series(name).value
        missing = int(np.count_nonzero(~np.isfinite(value)))
        if missing > value.size - 2:
            count = "none" if missing == value.size else f"only {value.size - missing}"
            return BadInput(
                f"{count} of its {value.size} samples is a number",
                file=run.path,
                place=f"channel {name}",
                remedy="import the record again with the column that holds it "
                f"(--column {name}=HEADER), or record the test again",
            )
    time_s = run.series("stroke").time_s
    latest = np.maximum.accumulate(np.concatenate(([-np.inf], np.nan_to_num(time_s[:-1], nan=-np.inf))))
    late = int(np.count_nonzero(~(time_s > latest)))
    if late > time_s.size - 2:
        return BadInput(
            f"{late} of its {time_s.size} time stamps do not advance",
            file=run.path,
            place="time",
            remedy="sort the record by time, or name its time (--column time=HEADER); import it again",
        )
    return BadInput(error.problem, file=run.path, place=error.place, remedy=error.remedy)


def _wires(run: Run) -> list[str]:
    """Return the stroke channels that hold a number: an empty column is a wire that was not there."""
    there = [name for name in STROKES if run.has(name)]
    filled = [name for name in there if np.any(np.isfinite(run.series(name).value))]
    return filled or there


def _record(run: Run) -> Record:
    wires = _wires(run)
    stroke = run.series("stroke" if len(wires) > 1 else wires[0] if wires else "stroke")
    time_s = stroke.time_s
    stream = run.stream_of("stroke")
    breaks = [row + 1 for row, _ in run.gaps(stream.name)]
    force_kN = _on_time(run, "force", time_s, breaks)
    speed = _on_time(run, "speed", time_s, breaks) if run.has("speed") else None
    return make_record(
        time_s,
        to_inside(stroke.value, "stroke", stroke.unit),
        to_inside(force_kN, "force", run.series("force").unit),
        wire_difference_mm=_wire_difference_mm(run, time_s, breaks) if len(wires) > 1 else None,
        speed_mm_per_s=None if speed is None else to_inside(speed, "speed", run.series("speed").unit),
        temperatures=_temperatures(run),
        lost_before=[(row + 1, lost) for row, lost in run.gaps(stream.name)],
    )


def _wire_difference_mm(run: Run, time_s: FloatArray, breaks: Sequence[int]) -> FloatArray | None:
    """Return stroke_1 - stroke_2 at the instants of their mean; None where there is one wire only."""
    if not all(run.has(name) for name in STROKES):
        return None
    one, two = (
        to_inside(_on_time(run, name, time_s, breaks), "stroke", run.series(name).unit) for name in STROKES
    )
    return np.asarray(one - two, dtype=np.float64)


def _on_time(run: Run, channel: str, time_s: FloatArray, breaks: Sequence[int]) -> FloatArray:
    """Return a channel at the instants of the stroke.

    Channels of one stream are sampled together, but their delays differ, and with them the times at which
    their values were true: a cubic spline over each uninterrupted stretch brings them together. It reaches
    at most two samples beyond its stretch.
    """
    series = run.series(channel)
    if series.time_s.size == time_s.size and np.allclose(
        series.time_s, time_s, rtol=0.0, atol=_SAME_INSTANT_S, equal_nan=True
    ):
        return series.value
    name = run.stream_of(channel).name
    if name != run.stream_of("stroke").name:
        raise BadInput(
            f"{channel} is of stream {name}, stroke of {run.stream_of('stroke').name}: no common instants",
            remedy="force and stroke must be sampled by one device",
        )
    value = np.full(time_s.size, np.nan)
    edges = [0, *breaks, time_s.size]
    for first, last in pairwise(edges):
        good = np.isfinite(series.time_s[first:last]) & np.isfinite(series.value[first:last])
        at, known = series.time_s[first:last][good], series.value[first:last][good]
        if at.size < 4 or np.any(np.diff(at) <= 0.0):
            continue
        wanted = time_s[first:last]
        step = float(np.median(np.diff(at)))
        near = (wanted >= at[0] - 2.0 * step) & (wanted <= at[-1] + 2.0 * step)
        value[first:last][near] = CubicSpline(at, known)(wanted[near])
    return value


def _temperatures(run: Run) -> list[Temperature]:
    roles = _roles(run.metadata)
    found = []
    for stream in run.streams.values():
        for channel in stream.channels.values():
            if channel.quantity != "temperature" or stream.rows == 0:
                continue
            series = run.series(channel.name)
            found.append(
                Temperature(
                    name=channel.name,
                    time_s=series.time_s,
                    temperature_C=to_inside(series.value, "temperature", series.unit),
                    role="ambient" if roles.get(channel.name) == "ambient" else "specimen",
                    place=channel.place,
                    accuracy_C=channel.uncertainty.zero,
                )
            )
    return found


def _roles(metadata: Mapping[str, Any]) -> dict[str, str]:
    sensors = ((metadata.get("stand") or {}).get("temperature") or {}).get("sensor") or ()
    return {str(sensor.get("name")): str(sensor.get("role", "specimen")) for sensor in sensors}


def _facts(run: Run) -> RunFacts:
    kind = run.kind
    if kind not in get_args(Kind):
        raise BadInput(
            f"the run is of kind “{kind}”",
            file=run.path,
            place="metadata: run.kind",
            remedy="import it again",
        )
    channels = {name: c for stream in run.streams.values() for name, c in stream.channels.items()}
    used = _wires(run)
    wires = [_stated(channels[name]) for name in used if name in channels]
    return RunFacts(
        id=run.id,
        kind=cast("Kind", kind),
        path=str(run.path),
        sha256=run.sha256,
        specimen=run.specimen,
        started=_moment(run.metadata["run"].get("started_utc")),
        status=run.status,
        step=run.step,
        problems=(*_import_findings(run), *_empty_wires(run, used)),
        force_uncertainty=_stated(channels["force"]) if "force" in channels else None,
        stroke_uncertainty=tuple(w for w in wires if w is not None) if None not in wires else (),
        force_delay_s=channels["force"].delay_s if "force" in channels else 0.0,
        moving_mass_kg=moving_mass_kg(run.metadata),
        moving_mass_accuracy_percent=_stand_number(run.metadata, "moving_mass_accuracy_percent"),
        force_cell=_force_cell(run),
        proof_load=_proof_load(run),
        impact_speed_km_h=_stated_number(run, "impact_speed_km_h"),
        impact_mass_t=_stated_number(run, "impact_mass_t"),
    )


def _import_findings(run: Run) -> tuple[str, ...]:
    return tuple(str(text) for text in (run.metadata.get("original") or {}).get("findings") or ())


def _empty_wires(run: Run, used: Sequence[str]) -> tuple[str, ...]:
    """Return a warning for each draw wire of which no sample is a number, while the other one has some."""
    empty = [name for name in STROKES if run.has(name) and name not in used]
    return tuple(
        f"{name}: none of its {run.stream_of(name).rows} samples is a number; {used[0]} alone is the stroke"
        for name in empty
    )


def _stated_number(run: Run, key: str) -> float | None:
    value = (run.metadata.get("test") or {}).get(key)
    return float(value) if isinstance(value, int | float) else None


def _proof_load(run: Run) -> str | None:
    for facts in (run.step, run.metadata.get("test") or {}):
        if name := facts.get("proof_load"):
            return str(name)
    return None


def moving_mass_kg(metadata: Mapping[str, Any]) -> float | None:
    """Return ``moving_mass_kg`` of the stand file in a run's metadata [kg]; None where it states none."""
    return _stand_number(metadata, "moving_mass_kg")


def _stand_number(metadata: Mapping[str, Any], key: str) -> float | None:
    stand = (metadata.get("stand") or {}).get("stand") or {}
    number = stand.get(key)
    return float(number) if isinstance(number, int | float) else None


def _force_cell(run: Run) -> ForceCell | None:
    stand = (run.metadata.get("stand") or {}).get("stand") or {}
    place = stand.get("force_cell")
    if place is not None and place not in get_args(ForceCell):
        raise BadInput(
            f"the force cell's place “{place}” is none of {', '.join(get_args(ForceCell))}",
            file=run.path,
            place="metadata: stand.stand.force_cell",
        )
    return cast("ForceCell | None", place)


def _stated(channel: Channel) -> ChannelUncertainty | None:
    """Return a channel's uncertainty, or None where it states nothing at all."""
    stated = channel.uncertainty
    return stated if any(value is not None for value in stated.model_dump().values()) else None


def _moment(text: object) -> datetime | None:
    try:
        return datetime.fromisoformat(str(text))
    except ValueError:
        return None
