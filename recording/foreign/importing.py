"""Foreign records become run files: what they hold is kept as it is, what was decided is written down.

A reader of another format is one more :class:`recording.foreign.record.ForeignRecord`; all else here serves
it too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foundation.canonical import canonical_json, file_hash
from foundation.channel import Channel
from foundation.errors import BadInput
from foundation.specimen import SpecimenFile, load_specimen
from foundation.units import INSIDE_UNIT
from recording.content import StreamContent
from recording.foreign.columns import DATE_TIME, Column, map_columns, quoted
from recording.foreign.mapping import mapping_facts
from recording.foreign.opening import open_record
from recording.foreign.record import Clock, Floats, ForeignRecord, Numbers
from recording.foreign.stamps import Stamps, examine
from recording.foreign.wanted import ImportOptions, Wanted, wanted_of
from recording.metadata import FORMAT, FORMAT_VERSION, KINDS
from recording.runfile import read_metadata, write_run
from recording.seal import RUN_SUFFIX

STREAM = "record"
"""The stream of stroke and force; further time bases are ``record_2`` …"""
DEFAULT_KIND = "harmonic"
_MOSTLY = 3.0
_ADDED = ("datasets", "content_sha256")


@dataclass(frozen=True)
class Imported:
    """The run file made, what was decided in reading, and what the user must know of the record.

    The last two are in the run file, too: as ``original`` and ``original.findings``.
    """

    path: Path
    warnings: tuple[str, ...]
    decisions: Mapping[str, Any]


@dataclass(frozen=True)
class _Base:
    """Channels on one time base."""

    name: str
    time_s: Floats
    time_from: str
    stamps: Stamps
    numbers: Numbers
    columns: Sequence[Column]

    def content(self) -> StreamContent:
        values = {column.name: self.numbers.columns[column.position] for column in self.columns}
        return StreamContent(self.time_s, values, self.stamps.segments)


def import_file(path: Path, out: Path, options: ImportOptions | None = None) -> Imported:
    """Import a foreign record (contracts § 3; TDMS, MDF, Excel) as ``<name>.h5`` into the folder ``out``.

    Raises
    ------
    BadInput
        If it cannot be read without guessing (file, line and column are named), or another record's run
        file is in its place.
    """
    options = options or ImportOptions()
    wanted = wanted_of(options)
    record = open_record(path, wanted.reading)
    columns = map_columns(record, wanted.wishes)
    bases = _bases(record, columns, wanted)
    if not len(bases[0].numbers.row):
        raise BadInput("no samples of stroke and force in it", file=path, place=record.header_place)
    specimen, specimen_from = _specimen(path, options.specimen)
    document = _document(record, wanted, specimen, columns, bases)
    several = len(bases) > 1
    findings = [*record.findings()]
    for base in bases:
        findings += [f"{base.name}: {text}" if several else text for text in base.stamps.findings]
        findings += _value_findings(base, record.row_word)
    document["original"] |= {
        "rows": len(bases[0].numbers.row),
        "specimen_file": specimen_from,
        "findings": findings + _kind_findings(document["run"]),
    }
    if options.mapping is not None and wanted.mapping is not None:
        document["original"]["mapping"] = mapping_facts(options.mapping, wanted.mapping)
    target = out / f"{document['run']['id']}{RUN_SUFFIX}"
    raw_units = {column.name: column.raw_unit for column in columns}
    repeated = _write(target, document, {base.name: base.content() for base in bases}, raw_units)
    warnings = [*document["original"]["findings"], *repeated]
    return Imported(target, tuple(warnings), document["original"])


def _bases(record: ForeignRecord, columns: Sequence[Column], wanted: Wanted) -> list[_Base]:
    """Return the channels by their time bases, that of stroke and force first."""
    time = next((column for column in columns if column.name == "time"), None)
    clock = None
    if time is not None and time.unit == DATE_TIME:
        clock = Clock(time.position, wanted.time_format, wanted.zone)
    _check_rate(wanted.sample_rate_Hz, time, record)
    numbers = record.read([column.position for column in columns], clock)
    by_name = {column.name: column.position for column in columns}
    main = _common_base(numbers, by_name, record)
    bases = [_base(STREAM, main, columns, time, wanted, record)]
    for item in numbers:
        if item is not main and (set(item.columns) - {time.position if time else None}):
            name = f"{STREAM}_{len(bases) + 1}"
            bases.append(_base(name, item, columns, time, wanted, record))
    return bases


def _common_base(numbers: Sequence[Numbers], by_name: Mapping[str, int], record: ForeignRecord) -> Numbers:
    """Return the base that holds force and all strokes."""
    of_force = next(item for item in numbers if by_name["force"] in item.columns)
    for name in ("stroke_1", "stroke_2"):
        if name in by_name and by_name[name] not in of_force.columns:
            raise BadInput(
                f"{name} and force were not sampled at the same instants",
                file=record.path,
                place=f"{record.where(by_name[name])} and {record.where(by_name['force'])}",
                remedy="export them on one time base from the program that recorded them",
            )
    return of_force


def _base(
    name: str,
    numbers: Numbers,
    columns: Sequence[Column],
    time: Column | None,
    wanted: Wanted,
    record: ForeignRecord,
) -> _Base:
    members = [c for c in columns if c.position in numbers.columns and c.name != "time"]
    in_base = time is not None and time.position in numbers.columns
    if in_base and time is not None:
        numbers = _one_block(numbers, time, wanted.reading.block, record)
        time_s = numbers.columns[time.position] * time.factor + time.offset
        stamps = examine(time_s, numbers.row, record.row_word)
        return _Base(name, time_s, "column", stamps, numbers, members)
    numbers = _one_block(numbers, None, wanted.reading.block, record)
    if numbers.time_s is not None:
        if wanted.sample_rate_Hz is not None:
            raise BadInput(
                f"a sample rate is given, and the record has its own time ({numbers.time_from})",
                file=record.path,
                place=record.where(members[0].position),
                remedy="leave out the sample rate",
            )
        stamps = examine(numbers.time_s, numbers.row, record.row_word, numbers.breaks)
        return _Base(name, numbers.time_s, numbers.time_from, stamps, numbers, members)
    if wanted.sample_rate_Hz is None:
        raise _no_time(record, members[0] if record.row_word == "sample" else None)
    rate = wanted.sample_rate_Hz
    time_s = np.arange(len(numbers.row)) / rate
    segments = examine(time_s, numbers.row, record.row_word, numbers.breaks).segments
    return _Base(name, time_s, "sample rate", Stamps(rate, segments, ()), numbers, members)


def _one_block(numbers: Numbers, time: Column | None, wanted: int | None, record: ForeignRecord) -> Numbers:
    """Return the block that is asked for, or all where the time goes on from block to block."""
    starts = [0, *numbers.blocks]
    ends = [*numbers.blocks, len(numbers.row)]
    if wanted is not None:
        if wanted > len(starts):
            raise BadInput(f"--block {wanted}: the file holds {len(starts)}", file=record.path)
        return _rows(numbers, starts[wanted - 1], ends[wanted - 1])
    if time is not None:
        stamps = numbers.columns[time.position]
        for start in numbers.blocks:
            if stamps[start] <= stamps[start - 1]:
                raise BadInput(
                    f"its time starts anew here: the file holds {len(starts)} records, one below the other",
                    file=record.path,
                    place=f"{record.row_word} {numbers.row[start]}",
                    remedy="import them one by one with --block 1, --block 2 …",
                )
    return numbers


def _rows(numbers: Numbers, first: int, last: int) -> Numbers:
    """Return some rows; what was between blocks is no break of one of them."""
    return replace(
        numbers,
        columns={position: values[first:last] for position, values in numbers.columns.items()},
        row=numbers.row[first:last],
        time_s=None if numbers.time_s is None else numbers.time_s[first:last],
        breaks=[row - first for row in numbers.breaks if first < row < last],
        blocks=(),
    )


def _check_rate(rate_Hz: float | None, time: Column | None, record: ForeignRecord) -> None:
    if rate_Hz is not None and not (0.0 < rate_Hz < np.inf):
        raise BadInput(f"--sample-rate {rate_Hz}: must be positive")
    if time is not None and rate_Hz is not None:
        raise BadInput(
            f"a sample rate is given and there is a time column “{time.header.text}”",
            file=record.path,
            place=record.header_place,
            remedy="leave out --sample-rate",
        )
    if time is None and rate_Hz is None and record.row_word != "sample":
        raise _no_time(record, None)


def _no_time(record: ForeignRecord, channel: Column | None) -> BadInput:
    what = "no column is named “time”" if channel is None else "the channel has no time (no wf_increment)"
    return BadInput(
        what,
        file=record.path,
        place=record.header_place if channel is None else record.where(channel.position),
        remedy="say --sample-rate HZ, or which it is by --column time=HEADER; the headers are "
        f"{quoted(record.headers)}",
    )


def _specimen(path: Path, given: Path | None) -> tuple[SpecimenFile | None, str | None]:
    beside = path.with_suffix(".toml")
    if given is None and not beside.is_file():
        return None, None
    used = given if given is not None else beside
    return load_specimen(used), used.name


def _document(
    record: ForeignRecord,
    wanted: Wanted,
    specimen: SpecimenFile | None,
    columns: Sequence[Column],
    bases: Sequence[_Base],
) -> dict[str, Any]:
    facts = {} if specimen is None else specimen.specimen.model_dump(mode="json")
    test = {} if specimen is None else specimen.test.model_dump(mode="json")
    kind, kind_source = _kind(wanted, test.get("kind"))
    started, started_source = _start(test.get("started"), bases[0].numbers.started)
    used = {column.position for column in columns}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "run": {
            "id": _run_id(record.path, wanted.reading.block),
            "kind": kind,
            "kind_source": kind_source,
            "started_utc": started,
            "ended_utc": None,
            "status": "imported",
            "reason": "",
            "operator": test.get("operator", ""),
            "campaign": None,
            "step_index": None,
        },
        "software": {"name": "bufferstand", "version": version("bufferstand")},
        "stand": {"laboratory": test.get("laboratory", "")},
        "specimen": facts,
        "test": test,
        "step": {},
        "limits": {},
        "streams": {
            base.name: {
                "clock": "device",
                "rate_Hz": base.stamps.rate_Hz,
                "device": f"import of {record.path.name}",
                "channels": [_channel(column) for column in base.columns],
            }
            for base in bases
        },
        "original": {
            "file": record.path.name,
            "sha256": file_hash(record.path),
            **record.facts(),
            "columns": {column.name: column.facts() for column in columns},
            "ignored": [header.full for i, header in enumerate(record.headers) if i not in used],
            "sample_rate_Hz": wanted.sample_rate_Hz,
            "time_from": {base.name: base.time_from for base in bases},
            "started_from": started_source,
            **({"block": wanted.reading.block} if wanted.reading.block else {}),
            **({"salvaged": True} if wanted.reading.salvage else {}),
        },
    }


def _start(of_test: str | None, of_record: datetime | None) -> tuple[str | None, str | None]:
    if of_test is not None:
        return of_test, "specimen file"
    return (None, None) if of_record is None else (of_record.isoformat(), "record")


def _channel(column: Column) -> dict[str, Any]:
    channel = Channel.model_validate(
        {
            "name": column.name,
            "quantity": column.quantity,
            "unit": INSIDE_UNIT[column.quantity],
            "place": column.header.full,
            **{key: value for key, value in column.channel_facts.items() if key != "calibration"},
            "calibration": {
                "id": f"unit {column.unit}",
                "coefficients": column.coefficients,
                **column.channel_facts.get("calibration", {}),
            },
        }
    )
    return channel.model_dump(mode="json")


def _kind(wanted: Wanted, of_test: str | None) -> tuple[str, str]:
    if wanted.kind is not None and wanted.kind not in KINDS:
        raise BadInput(f"--kind {wanted.kind}: no such kind", remedy=f"use one of {', '.join(KINDS)}")
    if wanted.kind is not None:
        return wanted.kind, "option"
    if of_test is not None:
        return of_test, "specimen file"
    if wanted.mapping is not None and wanted.mapping.kind is not None:
        return wanted.mapping.kind, "mapping"
    return DEFAULT_KIND, "default"


def _kind_findings(run: Mapping[str, Any]) -> list[str]:
    if run["kind_source"] != "default":
        return []
    known = "|".join(KINDS)
    return [
        f"kind of run not given: taken as {DEFAULT_KIND}, of which nothing is required (say --kind {known})"
    ]


def _value_findings(base: _Base, word: str) -> list[str]:
    findings = []
    for column in base.columns:
        raw = base.numbers.columns[column.position]
        missing = np.flatnonzero(np.isnan(raw))
        if len(missing) == len(raw):
            findings.append(f"{column.name}: the column is empty")
        elif len(missing):
            first = base.numbers.row[missing[0]]
            findings.append(
                f"{column.name}: {len(missing)} empty or NaN cell(s), the first in {word} {first}"
            )
        if column.quantity in ("stroke", "force") and _mostly_negative(raw * column.coefficients[1]):
            findings.append(
                f"{column.name}: mostly negative, and compression is positive here; if the record counts the "
                f"other way, import it with --invert {column.name}"
            )
    return findings


def _mostly_negative(value: NDArray[np.float64]) -> bool:
    known = value[np.isfinite(value)]
    return bool(len(known)) and bool(known.min() < 0 and -known.min() / _MOSTLY > max(known.max(), 0.0))


def _run_id(path: Path, block: int | None) -> str:
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", path.stem).strip("._") or "record"
    return name if block is None else f"{name}-block-{block}"


def _write(
    target: Path,
    document: dict[str, Any],
    contents: Mapping[str, StreamContent],
    raw_units: Mapping[str, str],
) -> list[str]:
    """Write the run file, unless the same import was done before; return what to say about that."""
    if target.exists():
        there = {key: value for key, value in read_metadata(target).items() if key not in _ADDED}
        if canonical_json(there) != canonical_json(document):
            raise BadInput(
                "a run file of this name is there already, of another record or other options",
                file=target,
                remedy="remove it, or choose another folder with --out",
            )
        return ["this record was imported before in the same way: the run file is left as it is"]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_run(target, document, contents, raw_units=raw_units)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror or error}", file=target) from None
    return []
