"""Loads a run file as the record and the facts that the evaluation works on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from bufferstand.evaluation.facts import EVENT, ForceCell, Occasion, RunFacts, identity_of
from bufferstand.evaluation.loading.guard_events import guard_doubts
from bufferstand.evaluation.loading.join import are_apart, joined
from bufferstand.evaluation.loading.long_runs import MemoryBounds, long_record, on_time, thinned
from bufferstand.evaluation.loading.resample import as_taken, same_instants
from bufferstand.evaluation.loading.table_rows import is_stamped
from bufferstand.evaluation.loading.two_clocks import align, with_figures
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import (
    Ends,
    Record,
    Temperature,
    make_record,
    peaks_of,
    said,
    signals_of,
    true_readings,
)
from bufferstand.foundation import BadInput, Kind, Purpose, to_inside
from bufferstand.foundation.channels import (
    STROKE_CHANNELS,
    Channel,
    ChannelUncertainty,
    recorded_thermometers,
    tilt_of_strokes,
)
from bufferstand.foundation.files import readable
from bufferstand.foundation.settings import demand_within
from bufferstand.recording import MAIN_STREAM
from bufferstand.recording.runfile import Run, Series, open_run, simulated_of

_EMPTY: FloatArray = np.zeros(0)
_LOOKED_AT = 4096
"""So many samples at a time are searched for a number."""


def load_run(path: Path, bounds: MemoryBounds | None = None) -> tuple[Record, RunFacts]:
    """Read a run file.

    Parameters
    ----------
    path : Path
    bounds : Bounds, optional
        How much of it is held at once: a longer run is read in pieces, and averaged.

    Returns
    -------
    (Record, RunFacts)
        A run that ended before it had samples gives an empty record, and says so in ``facts.problems``.

    Raises
    ------
    BadInput
        If it is no run file, is damaged, or lacks force or stroke.
    """
    return load_opened(open_run(path), bounds)


def load_opened(run: Run, bounds: MemoryBounds | None = None) -> tuple[Record, RunFacts]:
    """Read the samples of a run that is open, as :func:`load_run` does.

    Raises
    ------
    BadInput
        As :func:`load_run`.
    """
    bounds = bounds or MemoryBounds()
    run = with_figures(run)
    clocks = align(run)
    wires = _wires(run, bounds)
    facts = _facts(run, wires)
    try:
        record, problems = _record(run, wires, bounds)
    except BadInput as error:
        if any(stream.rows > 1 for stream in run.streams.values()):
            raise _explained(run, error, bounds) from None
        problem = f"nothing to evaluate: the run holds no samples (status {run.status}) {run.reason}".rstrip()
        record, problems = Record(_EMPTY, _EMPTY, _EMPTY), (problem,)
    record = replace(record, signals=signals_of(run, wires, bounds.whole_rows, bounds.piece_rows))
    faults = [text for sensor in record.temperatures for text in _faults_of(sensor)]
    return record, replace(facts, problems=(*facts.problems, *clocks, *problems, *faults))


def _faults_of(sensor: Temperature) -> list[str]:
    name = f"{sensor.name} ({sensor.place})" if sensor.place else sensor.name
    faulty = sum(len(fault.times_s) for fault in sensor.faults)
    return said(name, sensor.faults, int(np.count_nonzero(np.isfinite(sensor.temperature_C))) + faulty)


def _explained(run: Run, error: BadInput, bounds: MemoryBounds) -> BadInput:
    """Return what is wrong with a record that cannot be used: which of its columns hold no number."""
    for name in ("force", *STROKE_CHANNELS):
        if not run.has(name):
            continue
        rows = run.stream_of(name).rows
        there = sum(
            int(np.count_nonzero(np.isfinite(series.value))) for series in _series_of(run, name, bounds)
        )
        if there < 2:
            count = "none" if there == 0 else f"only {there}"
            return BadInput(
                f"{count} of its {rows} samples is a number",
                file=run.path,
                place=f"channel {name}",
                remedy="import the record again with the column that holds it "
                f"(--column {name}=HEADER), or record the test again",
            )
    stream = run.stream_of("stroke")
    late, latest = 0, -np.inf
    for time_s in run.time_blocks(stream.name, bounds.piece_rows):
        known = np.concatenate(([latest], np.nan_to_num(time_s, nan=-np.inf)))
        before = np.maximum.accumulate(known)
        late += int(np.count_nonzero(~(time_s > before[:-1])))
        latest = float(before[-1])
    if late > stream.rows - 2:
        return BadInput(
            f"{late} of its {stream.rows} time stamps do not advance",
            file=run.path,
            place="time",
            remedy="sort the record by time, or name its time (--column time=HEADER); import it again",
        )
    return error.of_file(run.path)


def _series_of(run: Run, channel: str, bounds: MemoryBounds) -> Iterator[Series]:
    """Return a channel as a whole, or in pieces where it is long."""
    if run.stream_of(channel).rows <= bounds.whole_rows:
        yield run.series(channel)
        return
    for block in run.blocks([channel], bounds.piece_rows):
        yield block[channel]


def _wires(run: Run, bounds: MemoryBounds) -> list[str]:
    """Return the stroke channels that hold a number: an empty column is a wire that was not there."""
    there = [name for name in STROKE_CHANNELS if run.has(name)]
    filled = [
        name for name in there if any(_holds_number(series.value) for series in _series_of(run, name, bounds))
    ]
    return filled or there


def _holds_number(values: FloatArray) -> bool:
    parts = range(0, values.size, _LOOKED_AT)  # one after the other: the first one nearly always tells
    return any(np.isfinite(values[first : first + _LOOKED_AT]).any() for first in parts)


def _record(run: Run, wires: Sequence[str], bounds: MemoryBounds) -> tuple[Record, tuple[str, ...]]:
    temperatures = _temperatures(run, bounds)
    if wires and run.stream_of(wires[0]).rows > bounds.whole_rows:
        record, problems = long_record(run, wires, bounds)
        return replace(record, temperatures=temperatures), problems
    if are_apart(run, wires):
        together = joined(run, wires)
        record = make_record(
            together.time_s,
            together.stroke_mm,
            together.force_kN,
            wire_difference_mm=together.wire_difference_mm,
            speed_mm_per_s=together.speed_mm_per_s,
            temperatures=temperatures,
            clock_s=together.clock_s,
        )
        found = replace(
            record, ends=together.ends, between=together.between, as_recorded=together.as_recorded
        )
        return found, together.problems
    stroke = run.series("stroke" if len(wires) > 1 else wires[0] if wires else "stroke")
    time_s = stroke.time_s
    stream = run.stream_of("stroke")
    gaps = [] if is_stamped(run.metadata, stream.name) else run.gaps(stream.name)
    breaks = [row + 1 for row, _ in gaps]
    force_kN = _on_time(run, "force", time_s, breaks)
    speed = _on_time(run, "speed", time_s, breaks) if run.has("speed") else None
    record = make_record(
        time_s,
        to_inside(stroke.value, "stroke", stroke.unit),
        to_inside(force_kN, "force", run.series("force").unit),
        wire_difference_mm=_wire_difference_mm(run, time_s, breaks) if len(wires) > 1 else None,
        speed_mm_per_s=None if speed is None else to_inside(speed, "speed", run.series("speed").unit),
        temperatures=temperatures,
        lost_before=[(row + 1, lost) for row, lost in gaps],
    )
    moved = [] if same_instants(run.series("force").time_s, time_s) else ["force"]
    return replace(record, as_recorded=_as_recorded(run, [*moved, *(wires if len(wires) > 1 else ())])), ()


def _as_recorded(run: Run, names: Sequence[str]) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return channels at their own instants, as they were read."""
    found = {}
    for name in names:
        series = run.series(name)
        value = to_inside(series.value, name.split("_", maxsplit=1)[0], series.unit)
        found[name] = as_taken(series.time_s, value)
    return found


def _wire_difference_mm(run: Run, time_s: FloatArray, breaks: Sequence[int]) -> FloatArray | None:
    """Return by how much draw wires differ at the instants of their mean; None where there is one only."""
    names = [name for name in STROKE_CHANNELS if run.has(name)]
    if len(names) < 2:
        return None
    return tilt_of_strokes(
        [to_inside(_on_time(run, name, time_s, breaks), "stroke", run.series(name).unit) for name in names]
    )


def _on_time(run: Run, channel: str, time_s: FloatArray, breaks: Sequence[int]) -> FloatArray:
    """Return a channel at the instants of the stroke."""
    series = run.series(channel)
    name = run.stream_of(channel).name
    same_size = series.time_s.size == time_s.size
    if name != run.stream_of("stroke").name and not (same_size and same_instants(series.time_s, time_s)):
        raise BadInput(
            f"{channel} is of stream {name}, stroke of {run.stream_of('stroke').name}: no common instants",
            remedy="force and stroke must be sampled by one device",
        )
    return on_time(series.time_s, series.value, time_s, [0, *breaks, time_s.size])


def _temperatures(run: Run, bounds: MemoryBounds) -> tuple[Temperature, ...]:
    roles = _roles(run.metadata)
    found = []
    for stream in run.streams.values():
        if stream.name == MAIN_STREAM:  # a controller's thermometers are in the machine: oil, valve
            continue
        for channel in stream.channels.values():
            if channel.quantity != "temperature" or stream.rows == 0:
                continue
            ends = None
            if stream.rows > bounds.whole_rows:
                series, ends = thinned(run, channel.name, bounds, _true_ends(channel.unit))
            else:
                series = run.series(channel.name)
            shown_C = to_inside(series.value, "temperature", series.unit)
            true, faults = true_readings(series.time_s, shown_C)
            found.append(
                Temperature(
                    name=channel.name,
                    time_s=series.time_s[true] if faults else series.time_s,
                    temperature_C=shown_C[true] if faults else shown_C,
                    role="ambient" if roles.get(channel.name) == "ambient" else "specimen",
                    place=channel.place,
                    accuracy_C=channel.uncertainty.zero,
                    faults=faults,
                    ends=ends,
                )
            )
    return tuple(found)


def _true_ends(unit: str) -> Callable[[Series], Ends | None]:
    """Return what gives the least and greatest true reading of a stretch of a thermometer [°C]."""

    def ends(series: Series) -> Ends | None:
        shown_C = to_inside(series.value, "temperature", unit)
        true, faults = true_readings(series.time_s, shown_C)
        return peaks_of(series.time_s[true], shown_C[true]) if faults else peaks_of(series.time_s, shown_C)

    return ends


def _roles(metadata: Mapping[str, Any]) -> dict[str, str]:
    sensors = recorded_thermometers(metadata.get("stand") or {})
    return {str(sensor.get("name")): str(sensor.get("role", "specimen")) for sensor in sensors}


def _facts(run: Run, used: Sequence[str]) -> RunFacts:
    kind = run.kind
    if kind not in get_args(Kind):
        raise BadInput(
            f"the run is of kind “{kind}”",
            file=run.path,
            place="metadata: run.kind",
            remedy="import it again",
        )
    channels = {name: c for stream in run.streams.values() for name, c in stream.channels.items()}
    there = [channels[name] for name in used if name in channels]
    wires = [_stated(wire, run) for wire in there]
    occasion = _occasion(run)
    return RunFacts(
        id=run.id,
        kind=cast("Kind", kind),
        path=readable(run.path),
        sha256=run.sha256,
        samples_sha256=run.samples_sha256,
        specimen=run.specimen,
        started=_moment(run.metadata["run"].get("started_utc")),
        status=run.status,
        step=run.step,
        problems=(*_import_findings(run), *_empty_wires(run, used)),
        force_uncertainty=_with_clocks(run, _stated(channels["force"], run)) if "force" in channels else None,
        stroke_uncertainty=tuple(w for w in wires if w is not None) if None not in wires else (),
        force_identity=identity_of(channels["force"], occasion) if "force" in channels else None,
        stroke_identities=tuple(identity_of(wire, occasion) for wire in there),
        stand=occasion.stand,
        simulated=simulated_of(run.metadata),
        speed_uncertainty=_stated(channels["speed"], run) if "speed" in channels else None,
        force_delay_s=channels["force"].delay_s if "force" in channels else 0.0,
        force_limit_kN=_stand_limit(run, "force_max_kN"),
        stroke_limit_mm=_stand_limit(run, "stroke_max_mm"),
        machine_stiffness_kN_per_mm=_machine_stiffness(run),
        guard_doubts=guard_doubts(run.events),
        moving_mass_kg=moving_mass_kg(run.metadata),
        moving_mass_accuracy_percent=_stand_number(run.metadata, "moving_mass_accuracy_percent"),
        force_cell=_force_cell(run),
        proof_load=_proof_load(run),
        stroke_events=tuple(event for event in run.events if event.kind == EVENT)
        if kind == "harmonic"
        else (),
        zero=run.metadata.get("zero"),
        campaign=_campaign(run),
        purpose=_purpose(run),
        impact_speed_km_h=_stated_number(run, "impact_speed_km_h"),
        impact_mass_t=_stated_number(run, "impact_mass_t"),
    )


def _with_clocks(run: Run, stated: ChannelUncertainty | None) -> ChannelUncertainty | None:
    """Return the force's uncertainty with that of its clock against the stroke's, where they are two."""
    if stated is None or not (run.has("force") and run.has("stroke")):
        return stated
    beside = bool(run.other_clocks.lines)  # there its own delay counts as none where none is stated
    if stated.u_delay_s is None and not beside:
        return stated
    u_clocks_s = run.u_clocks_s("force", "stroke")
    if u_clocks_s == 0.0:
        return stated
    return stated.model_copy(update={"u_delay_s": float(np.hypot(stated.u_delay_s or 0.0, u_clocks_s))})


def _occasion(run: Run) -> Occasion:
    """Return stand, and what the zeros were set for: the specimen in its campaign, or on its day."""
    stand = ((run.metadata.get("stand") or {}).get("stand") or {}).get("id")
    campaign = (run.metadata.get("campaign") or {}).get("id")
    day = str(run.metadata["run"].get("started_utc") or "")[:10]
    setting = f"{run.specimen.get('id') or 'specimen'} in {campaign or day}"
    return Occasion(str(stand or ""), setting)


def _import_findings(run: Run) -> tuple[str, ...]:
    return tuple(str(text) for text in (run.metadata.get("original") or {}).get("findings") or ())


def _empty_wires(run: Run, used: Sequence[str]) -> tuple[str, ...]:
    """Return a warning for each draw wire of which no sample is a number, while the other one has some."""
    empty = [name for name in STROKE_CHANNELS if run.has(name) and name not in used]
    return tuple(
        f"{name}: none of its {run.stream_of(name).rows} samples is a number; {used[0]} alone is the stroke"
        for name in empty
    )


def _stated_number(run: Run, key: str) -> float | None:
    value = (run.metadata.get("test") or {}).get(key)
    return float(value) if isinstance(value, int | float) else None


def _stand_limit(run: Run, key: str) -> float | None:
    value = ((run.metadata.get("limits") or {}).get("stand") or {}).get(key)
    return float(value) if isinstance(value, int | float) else None


def _machine_stiffness(run: Run) -> float | None:
    value = ((run.metadata.get("stand") or {}).get("limits") or {}).get("machine_stiffness_kN_per_mm")
    return float(value) if isinstance(value, int | float) else None


def _proof_load(run: Run) -> str | None:
    for facts in (run.step, run.metadata.get("test") or {}):
        if name := facts.get("proof_load"):
            return str(name)
    return None


def _campaign(run: Run) -> str | None:
    name = (run.metadata.get("campaign") or {}).get("id")
    return None if name is None else str(name)


def _purpose(run: Run) -> Purpose | None:
    """Return what the planned step says; of an import, which has none, what ``[test]`` says."""
    stated = run.step.get("purpose") if run.step else (run.metadata.get("test") or {}).get("purpose")
    return stated if stated in get_args(Purpose) else None


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


def _stated(channel: Channel, run: Run) -> ChannelUncertainty | None:
    """Return a channel's uncertainty, None where it states nothing; refuse one that cannot be."""
    stated = channel.uncertainty
    demand_within(stated, run.path, "", (channel.name, "uncertainty"))
    values = (getattr(stated, name) for name in type(stated).model_fields)
    return stated if any(value is not None for value in values) else None


def _moment(text: object) -> datetime | None:
    try:
        return datetime.fromisoformat(str(text))
    except ValueError:
        return None
