"""Foreign records become run files: what they hold is kept as it is, what was decided is written down.

A reader of another format (TDMS, MDF4 …) is one more :class:`ForeignRecord`; all else here serves it too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from foundation.canonical import canonical_json, file_hash
from foundation.channel import Calibration, Channel
from foundation.errors import BadInput
from foundation.specimen import SpecimenFile, load_specimen
from foundation.units import INSIDE_UNIT
from recording.columns import Column, ColumnOptions, map_columns
from recording.content import StreamContent
from recording.delimited import DelimitedRecord, Numbers
from recording.metadata import FORMAT, FORMAT_VERSION, KINDS
from recording.runfile import read_metadata, write_run
from recording.seal import RUN_SUFFIX
from recording.stamps import Stamps, examine

STREAM = "record"
DEFAULT_KIND = "harmonic"
_MOSTLY = 3.0
_ADDED = ("datasets", "content_sha256")


class ForeignRecord(Protocol):
    """A record of another make: a table with a header row."""

    path: Path
    headers: tuple[str, ...]
    header_place: str

    def facts(self) -> dict[str, Any]:
        """Return how the file is written."""
        ...

    def findings(self) -> list[str]:
        """Return what is odd about the file as a whole."""
        ...

    def read(self, positions: Sequence[int]) -> Numbers:
        """Return the numbers of some columns.

        Raises
        ------
        BadInput
            If one cannot be read, naming its place.
        """
        ...


@dataclass(frozen=True)
class ImportOptions:
    """What the user says about a record (contracts § 3).

    Parameters
    ----------
    kind : str, optional
        ``static``, ``harmonic``, ``impact`` or ``proof``; goes before the specimen file's ``[test] kind``.
    column, unit : mapping of str to str
        Header, and unit, by channel name.
    invert : sequence of str
        Channels whose sign is turned.
    specimen : Path, optional
        Specimen file; without it, one of the record's name with the suffix ``.toml`` beside it is taken.
    sample_rate_hz : float, optional
        For a record without time [Hz].
    """

    kind: str | None = None
    column: Mapping[str, str] = field(default_factory=dict)
    unit: Mapping[str, str] = field(default_factory=dict)
    invert: Sequence[str] = ()
    specimen: Path | None = None
    sample_rate_hz: float | None = None


@dataclass(frozen=True)
class Imported:
    """The run file made, and what the user must know of the record (in it as ``original.findings``, too)."""

    path: Path
    warnings: tuple[str, ...]


def import_csv(path: Path, out: Path, options: ImportOptions | None = None) -> Imported:
    """Import a text file of columns (contracts § 3) as ``<name>.h5`` into the folder ``out``.

    Raises
    ------
    BadInput
        If it cannot be read without guessing (file, line and column are named), or another record's run
        file is in its place.
    """
    return import_record(DelimitedRecord(path), out, options or ImportOptions())


def import_record(record: ForeignRecord, out: Path, options: ImportOptions) -> Imported:
    """Import an opened foreign record into the folder ``out``.

    Raises
    ------
    BadInput
        As :func:`import_csv`.
    """
    wanted = ColumnOptions(options.column, options.unit, options.invert)
    columns = map_columns(record.headers, wanted, record.path, record.header_place)
    time = next((column for column in columns if column.name == "time"), None)
    _check_rate(options.sample_rate_hz, time, record)
    numbers = record.read([column.position for column in columns])
    channels = [column for column in columns if column.name != "time"]
    if time is None:
        rate = options.sample_rate_hz or 0.0
        time_s = np.arange(len(numbers.line)) / rate
        stamps = Stamps(rate, examine(time_s, numbers.line).segments, ())
    else:
        time_s = numbers.columns[time.position] * time.factor
        stamps = examine(time_s, numbers.line)
    findings = [*record.findings(), *stamps.findings, *_value_findings(channels, numbers)]
    specimen, specimen_from = _specimen(record.path, options.specimen)
    document = _document(record, options, specimen, columns, stamps)
    document["original"] |= {
        "rows": len(numbers.line),
        "decimal": numbers.decimal,
        "specimen_file": specimen_from,
        "findings": findings + _kind_findings(document["run"]),
    }
    content = StreamContent(
        time_s, {column.name: numbers.columns[column.position] for column in channels}, stamps.segments
    )
    target = out / f"{document['run']['id']}{RUN_SUFFIX}"
    repeated = _write(target, document, content, {column.name: column.unit for column in channels})
    warnings = [*document["original"]["findings"], *repeated]
    return Imported(target, tuple(warnings))


def _check_rate(rate_hz: float | None, time: Column | None, record: ForeignRecord) -> None:
    if time is None and rate_hz is None:
        headers = ", ".join(f"“{header}”" for header in record.headers)
        raise BadInput(
            "no column is named “time”",
            file=record.path,
            place=record.header_place,
            remedy=f"say --sample-rate HZ, or which it is by --column time=HEADER; the headers are {headers}",
        )
    if time is not None and rate_hz is not None:
        raise BadInput(
            f"a sample rate is given and there is a time column “{time.header}”",
            file=record.path,
            place=record.header_place,
            remedy="leave out --sample-rate",
        )
    if rate_hz is not None and not (0.0 < rate_hz < np.inf):
        raise BadInput(f"--sample-rate {rate_hz}: must be positive")


def _specimen(path: Path, given: Path | None) -> tuple[SpecimenFile | None, str | None]:
    beside = path.with_suffix(".toml")
    if given is None and not beside.is_file():
        return None, None
    used = given if given is not None else beside
    return load_specimen(used), used.name


def _document(
    record: ForeignRecord,
    options: ImportOptions,
    specimen: SpecimenFile | None,
    columns: Sequence[Column],
    stamps: Stamps,
) -> dict[str, Any]:
    facts = {} if specimen is None else specimen.specimen.model_dump(mode="json")
    test = {} if specimen is None else specimen.test.model_dump(mode="json")
    kind, kind_source = _kind(options.kind, test.get("kind"))
    used = {column.position for column in columns}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "run": {
            "id": _run_id(record.path),
            "kind": kind,
            "kind_source": kind_source,
            "started_utc": test.get("started"),
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
            STREAM: {
                "clock": "device",
                "rate_Hz": stamps.rate_Hz,
                "device": f"import of {record.path.name}",
                "channels": [_channel(column) for column in columns if column.name != "time"],
            }
        },
        "original": {
            "file": record.path.name,
            "sha256": file_hash(record.path),
            **record.facts(),
            "columns": {column.name: column.facts() for column in columns},
            "ignored": [header for i, header in enumerate(record.headers) if i not in used],
            "sample_rate_Hz": options.sample_rate_hz,
        },
    }


def _channel(column: Column) -> dict[str, Any]:
    channel = Channel.model_validate(
        {
            "name": column.name,
            "quantity": column.quantity,
            "unit": INSIDE_UNIT[column.quantity],
            "place": column.header,
            "calibration": Calibration(id=f"unit {column.unit}", coefficients=column.coefficients),
        }
    )
    return channel.model_dump(mode="json")


def _kind(option: str | None, of_test: str | None) -> tuple[str, str]:
    if option is not None and option not in KINDS:
        raise BadInput(f"--kind {option}: no such kind", remedy=f"use one of {', '.join(KINDS)}")
    if option is not None:
        return option, "option"
    return (of_test, "specimen file") if of_test is not None else (DEFAULT_KIND, "default")


def _kind_findings(run: Mapping[str, Any]) -> list[str]:
    if run["kind_source"] != "default":
        return []
    known = "|".join(KINDS)
    return [
        f"kind of run not given: taken as {DEFAULT_KIND}, of which nothing is required (say --kind {known})"
    ]


def _value_findings(channels: Sequence[Column], numbers: Numbers) -> list[str]:
    findings = []
    for column in channels:
        raw = numbers.columns[column.position]
        missing = np.flatnonzero(np.isnan(raw))
        if len(missing) == len(raw):
            findings.append(f"{column.name}: the column is empty")
        elif len(missing):
            first = numbers.line[missing[0]]
            findings.append(f"{column.name}: {len(missing)} empty or NaN cell(s), the first in line {first}")
        if column.quantity in ("stroke", "force") and _mostly_negative(raw * column.coefficients[1]):
            findings.append(
                f"{column.name}: mostly negative, and compression is positive here; if the record counts the "
                f"other way, import it with --invert {column.name}"
            )
    return findings


def _mostly_negative(value: NDArray[np.float64]) -> bool:
    known = value[np.isfinite(value)]
    return bool(len(known)) and bool(known.min() < 0 and -known.min() / _MOSTLY > max(known.max(), 0.0))


def _run_id(path: Path) -> str:
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", path.stem).strip("._")
    return name or "record"


def _write(
    target: Path, document: dict[str, Any], content: StreamContent, raw_units: Mapping[str, str]
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
        write_run(target, document, {STREAM: content}, raw_units=raw_units)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror or error}", file=target) from None
    return []
