"""Foreign records become run files: what they hold is kept as it is, what was decided is written down.

A reader of another format is one more :class:`bufferstand.recording.foreign.record.ForeignRecord`; all else
here serves it too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bufferstand.foundation import INSIDE_UNIT, BadInput
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.files import canonical_json, file_hash, make_folder, readable
from bufferstand.foundation.specimen import SpecimenFile, load_specimen
from bufferstand.recording.content import StreamContent
from bufferstand.recording.foreign.columns import MappedColumn, map_columns
from bufferstand.recording.foreign.import_options import ImportOptions, ImportRequest, wanted_of
from bufferstand.recording.foreign.mapping import mapping_facts
from bufferstand.recording.foreign.opening import open_record
from bufferstand.recording.foreign.record import ForeignRecord
from bufferstand.recording.foreign.times import TimeBase, rate_findings, time_bases, value_findings
from bufferstand.recording.runfile import FORMAT, FORMAT_VERSION, KINDS, read_metadata, write_run
from bufferstand.recording.sealing import RUN_SUFFIX

DEFAULT_KIND = "harmonic"
_ADDED = ("datasets", "content_sha256")


@dataclass(frozen=True)
class Imported:
    """The run file made, what was decided in reading, and what the user must know of the record.

    The last two are in the run file, too: as ``original`` and ``original.findings``.
    """

    path: Path
    warnings: tuple[str, ...]
    decisions: Mapping[str, Any]


def import_file(path: Path, out: Path, options: ImportOptions | None = None) -> Imported:
    """Import a foreign record (docs/import.md) as ``<name>.h5`` into the folder ``out``.

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
    bases = time_bases(record, columns, wanted)
    if not len(bases[0].numbers.row):
        raise BadInput("no samples of stroke and force in it", file=path, place=record.header_place)
    specimen, specimen_from = _specimen(path, options.specimen)
    document = _document(record, wanted, specimen, columns, bases)
    several = len(bases) > 1
    findings = [*record.findings()]
    for base in bases:
        findings += [f"{base.name}: {text}" if several else text for text in base.stamps.findings]
        findings += value_findings(base, record.row_word)
    findings += rate_findings(bases)
    document["original"] |= {
        "rows": max(len(base.numbers.row) for base in bases),
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


def _specimen(path: Path, given: Path | None) -> tuple[SpecimenFile | None, str | None]:
    used = given if given is not None else path.with_suffix(".toml")
    try:
        if given is None and not used.is_file():
            return None, None
    except OSError:  # a name so long that no other can be made of it
        return None, None
    return load_specimen(used), readable(used.name)


def _document(
    record: ForeignRecord,
    wanted: ImportRequest,
    specimen: SpecimenFile | None,
    columns: Sequence[MappedColumn],
    bases: Sequence[TimeBase],
) -> dict[str, Any]:
    facts = {} if specimen is None else specimen.specimen.model_dump(mode="json")
    test = {} if specimen is None else specimen.test.model_dump(mode="json")
    kind, kind_source = _kind(wanted, test.get("kind"))
    of_test = None if specimen is None else specimen.test.started
    started, started_source = _start(of_test, bases[0].numbers.started)
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
                "device": f"import of {readable(record.path.name)}",
                "channels": [_channel(column) for column in base.columns],
            }
            for base in bases
        },
        "original": {
            "file": readable(record.path.name),
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


def _start(of_test: datetime | None, of_record: datetime | None) -> tuple[str | None, str | None]:
    if of_test is not None:
        return of_test.astimezone(UTC).isoformat().replace("+00:00", "Z"), "specimen file"
    return (None, None) if of_record is None else (of_record.isoformat(), "record")


def _channel(column: MappedColumn) -> dict[str, Any]:
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


def _kind(wanted: ImportRequest, of_test: str | None) -> tuple[str, str]:
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
    try:
        if target.exists():
            there = {key: value for key, value in read_metadata(target).items() if key not in _ADDED}
            if canonical_json(there) != canonical_json(document):
                raise BadInput(
                    "a run file of this name is there already, of another record or other options",
                    file=target,
                    remedy="remove it, or choose another folder with --out",
                )
            return ["this record was imported before in the same way: the run file is left as it is"]
        make_folder(target.parent)
        write_run(target, document, contents, raw_units=raw_units)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror or error}", file=target) from None
    return []
