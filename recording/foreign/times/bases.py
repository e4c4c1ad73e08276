"""The channels of a foreign record grouped by their time bases, and the irregularities of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording.content import StreamContent
from bufferstand.recording.foreign.columns import DATE_TIME, MappedColumn, quoted
from bufferstand.recording.foreign.import_options import ImportRequest
from bufferstand.recording.foreign.record import Floats, ForeignRecord, Numbers, TimeColumn
from bufferstand.recording.foreign.times.instants import has_own_instants
from bufferstand.recording.foreign.times.stamps import Stamps, examine

STREAM = "record"
"""The stream of the stroke; further time bases are ``record_2`` …"""
_MOSTLY = 3.0


@dataclass(frozen=True)
class TimeBase:
    """Channels on one time base.

    Parameters
    ----------
    name : str
        Of its stream in the run file; empty while that is not settled.
    time_s : NDArray[float64]
        Time stamps [s], NaN where there is none; shape (n,).
    time_from : str
        Where they come from.
    stamps : Stamps
        What is odd about them.
    numbers : Numbers
        As they were read.
    columns : sequence of Column
        Those of ``numbers`` that are channels.
    """

    name: str
    time_s: Floats
    time_from: str
    stamps: Stamps
    numbers: Numbers
    columns: Sequence[MappedColumn]

    def content(self) -> StreamContent:
        """Return the samples as a stream of a run file."""
        values = {column.name: self.numbers.columns[column.position] for column in self.columns}
        return StreamContent(self.time_s, values, self.stamps.segments)


def time_bases(
    record: ForeignRecord, columns: Sequence[MappedColumn], wanted: ImportRequest
) -> list[TimeBase]:
    """Return the channels by their time bases, that of the stroke first, that of the force next.

    Raises
    ------
    BadInput
        If a channel cannot be read, stroke and force have no time in common, or one has none, or two.
    """
    time = next((column for column in columns if column.name == "time"), None)
    clock = None
    if time is not None and time.unit == DATE_TIME:
        clock = TimeColumn(time.position, wanted.time_format, wanted.zone)
    _check_rate(wanted.sample_rate_Hz, time, record)
    numbers = record.read([column.position for column in columns], clock)
    by_name = {column.name: column.position for column in columns}
    main = next(item for item in numbers if by_name["stroke_1"] in item.columns)
    if time is not None:
        numbers, main = _with_time(numbers, main, time, record)
    of_channels = [item for item in numbers if set(item.columns) - {time.position if time else None}]
    bases = [_base(item, columns, time, wanted, record) for item in of_channels]
    _check_common_clock(bases, by_name, record)
    parts = [part for base in bases for part in by_instants(base, record.row_word)]
    parts.sort(key=_order)
    names = [STREAM, *(f"{STREAM}_{number}" for number in range(2, len(parts) + 1))]
    return [replace(part, name=name) for part, name in zip(parts, names, strict=True)]


def _order(base: TimeBase) -> tuple[bool, bool]:
    names = {column.name for column in base.columns}
    return "stroke_1" not in names, "force" not in names


def _check_common_clock(bases: Sequence[TimeBase], by_name: Mapping[str, int], record: ForeignRecord) -> None:
    """Refuse stroke and force that are stamped by different clocks, or counted each by itself."""
    of_stroke = _base_of(bases, "stroke_1")
    for name in ("force", *STROKE_CHANNELS[1:]):
        if name not in by_name:
            continue
        own = _base_of(bases, name)
        if own is of_stroke or (own.time_from == of_stroke.time_from and own.numbers.time_s is not None):
            continue
        raise BadInput(
            f"stroke_1 and {name} have no clock in common "
            f"(time from {of_stroke.time_from}, and from {own.time_from})",
            file=record.path,
            place=f"{record.where(by_name['stroke_1'])} and {record.where(by_name[name])}",
            remedy="export them with the time of each, or on one time base",
        )


def _base_of(bases: Sequence[TimeBase], channel: str) -> TimeBase:
    return next(base for base in bases if any(column.name == channel for column in base.columns))


def by_instants(base: TimeBase, word: str) -> list[TimeBase]:
    """Return a time base apart by the rows in which its channels were read, where these differ.

    A channel that is read in some of the rows only
    (:func:`bufferstand.recording.foreign.times.instants.has_own_instants`) keeps these rows and their stamps;
    the others stay with all rows.

    Parameters
    ----------
    base : TimeBase
    word : str
        What a row is called in messages.
    """
    groups: list[tuple[NDArray[np.bool_] | None, list[MappedColumn]]] = [(None, [])]
    for column in base.columns:
        filled = ~np.isnan(base.numbers.columns[column.position])
        if filled.all() or not has_own_instants(base.time_s, filled):
            groups[0][1].append(column)
            continue
        for rows, members in groups[1:]:
            if rows is not None and np.array_equal(rows, filled):
                members.append(column)
                break
        else:
            groups.append((filled, [column]))
    return [
        replace(base, columns=members) if rows is None else _of_rows(base, rows, members, word)
        for rows, members in groups
        if members
    ]


def _of_rows(
    base: TimeBase, filled: NDArray[np.bool_], members: Sequence[MappedColumn], word: str
) -> TimeBase:
    """Return some channels of a base in the rows in which they were read."""
    rows = np.flatnonzero(filled)
    numbers = replace(
        base.numbers,
        columns={c.position: base.numbers.columns[c.position][rows] for c in members},
        row=base.numbers.row[rows],
        time_s=None if base.numbers.time_s is None else base.numbers.time_s[rows],
        breaks=sorted({int(at) for at in np.searchsorted(rows, base.numbers.breaks)} - {0, rows.size}),
    )
    time_s = base.time_s[rows]
    # Counted on at a sample rate, the time hides what interruptions there were.
    stamps = examine(time_s, numbers.row, word, numbers.breaks, list(numbers.columns.values()))
    names = " and ".join(column.name for column in members)
    rate = "" if stamps.rate_Hz is None else f", {stamps.rate_Hz:.4g} Hz"
    read = f"{names}: read in {rows.size} of {filled.size} {word}s{rate}"
    said = f"{read}; the blanks between are no missing readings"
    return replace(
        base,
        time_s=time_s,
        numbers=numbers,
        columns=members,
        stamps=replace(stamps, findings=(said, *stamps.findings)),
    )


def _with_time(
    numbers: list[Numbers], main: Numbers, time: MappedColumn, record: ForeignRecord
) -> tuple[list[Numbers], Numbers]:
    """Return the bases with a time channel moved to stroke and force where it is one of their group.

    Raises
    ------
    BadInput
        If it belongs to no channel that is used.
    """
    own = next(item for item in numbers if time.position in item.columns)
    if own is main:
        return numbers, main
    force = next(iter(main.columns))
    group, of_force = record.headers[time.position].group, record.headers[force].group
    if group == of_force and len(own.row) == len(main.row):
        joined = replace(main, columns={**main.columns, time.position: own.columns[time.position]})
        others = {p: v for p, v in own.columns.items() if p != time.position}
        rest = [replace(own, columns=others)] if others else []
        return [joined, *(item for item in numbers if item is not main and item is not own), *rest], joined
    if set(own.columns) == {time.position}:
        raise BadInput(
            f"the time “{time.header.full}” is not of the group of stroke and force, or not as long",
            file=record.path,
            place=record.where(time.position),
            remedy="name their own time with --column time=GROUP/HEADER, or read one group with --group NAME",
        )
    return numbers, main


def _base(
    numbers: Numbers,
    columns: Sequence[MappedColumn],
    time: MappedColumn | None,
    wanted: ImportRequest,
    record: ForeignRecord,
) -> TimeBase:
    members = [c for c in columns if c.position in numbers.columns and c.name != "time"]
    in_base = time is not None and time.position in numbers.columns
    if in_base and time is not None:
        numbers = _one_block(numbers, time, wanted.reading.block, record)
        time_s = _stamps_s(numbers.columns[time.position], time)
        stamps = examine(time_s, numbers.row, record.row_word, values=_values(numbers, members))
        return TimeBase("", time_s, "column", stamps, numbers, members)
    numbers = _one_block(numbers, None, wanted.reading.block, record)
    if numbers.time_s is not None:
        if wanted.sample_rate_Hz is not None:
            raise BadInput(
                f"a sample rate is given, and the record has its own time ({numbers.time_from})",
                file=record.path,
                place=record.where(members[0].position),
                remedy="leave out the sample rate",
            )
        stamps = examine(
            numbers.time_s, numbers.row, record.row_word, numbers.breaks, _values(numbers, members)
        )
        return TimeBase("", numbers.time_s, numbers.time_from, stamps, numbers, members)
    if wanted.sample_rate_Hz is None:
        raise _no_time(record, members[0] if record.row_word == "sample" else None)
    rate = wanted.sample_rate_Hz
    time_s = np.arange(len(numbers.row)) / rate
    segments = examine(time_s, numbers.row, record.row_word, numbers.breaks).segments
    findings = _interruptions(numbers, record.row_word)
    return TimeBase("", time_s, "sample rate", Stamps(rate, segments, findings), numbers, members)


def _values(numbers: Numbers, members: Sequence[MappedColumn]) -> list[Floats]:
    return [numbers.columns[column.position] for column in members]


def _stamps_s(numbers: Floats, time: MappedColumn) -> Floats:
    """Return time stamps [s], NaN (none) in place of infinite ones."""
    with np.errstate(over="ignore"):
        time_s = numbers * time.factor + time.offset
    return np.where(np.isfinite(time_s), time_s, np.nan)


def _interruptions(numbers: Numbers, word: str) -> tuple[str, ...]:
    if not numbers.breaks:
        return ()
    first = numbers.row[numbers.breaks[0]]
    what = f"{len(numbers.breaks)} interruption(s) of unknown length (header rows, blank or left-out rows)"
    return (f"{what}, the first before {word} {first}: the time is counted on at the sample rate",)


def _one_block(
    numbers: Numbers, time: MappedColumn | None, wanted: int | None, record: ForeignRecord
) -> Numbers:
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


def _check_rate(rate_Hz: float | None, time: MappedColumn | None, record: ForeignRecord) -> None:
    if rate_Hz is not None and not (0.0 < rate_Hz < np.inf):
        raise BadInput(f"--sample-rate {rate_Hz}: must be positive")
    if time is not None and rate_Hz is not None:
        raise BadInput(
            f"a sample rate is given and there is a time column “{time.header.text}”",
            file=record.path,
            place=record.header_place,
            remedy="leave out the sample rate (--sample-rate, or sample_rate_Hz of the mapping file)",
        )
    if time is None and rate_Hz is None and record.row_word != "sample":
        raise _no_time(record, None)


def _no_time(record: ForeignRecord, channel: MappedColumn | None) -> BadInput:
    what = "no column is named “time”" if channel is None else "the channel has no time (no wf_increment)"
    return BadInput(
        what,
        file=record.path,
        place=record.header_place if channel is None else record.where(channel.position),
        remedy="say --sample-rate HZ, or which it is by --column time=HEADER; the headers are "
        f"{quoted(record.headers)}",
    )


def rate_findings(bases: Sequence[TimeBase]) -> list[str]:
    """Return at which rates stroke and force were read, where each was read at instants of its own."""
    said = [
        f"{column.name} at {base.stamps.rate_Hz:.4g} Hz"
        for base in bases
        for column in base.columns
        if column.quantity in ("stroke", "force") and base.stamps.rate_Hz is not None
    ]
    streams = {base.name for base in bases for c in base.columns if c.quantity in ("stroke", "force")}
    return [f"each at its own instants: {', '.join(said)}"] if len(streams) > 1 else []


def value_findings(base: TimeBase, word: str) -> list[str]:
    """Return what a user must know of the values: those that are missing or infinite, and their sign."""
    findings = []
    for column in base.columns:
        raw = base.numbers.columns[column.position]
        with np.errstate(over="ignore"):
            value = column.coefficients[0] + column.coefficients[1] * raw
        missing = np.flatnonzero(np.isnan(raw))
        if len(missing) == len(raw):
            findings.append(f"{column.name}: the column is empty")
        elif len(missing):
            first = base.numbers.row[missing[0]]
            findings.append(
                f"{column.name}: {len(missing)} empty or NaN cell(s), the first in {word} {first}"
            )
        infinite = np.flatnonzero(np.isinf(value))
        if len(infinite):
            first = base.numbers.row[infinite[0]]
            findings.append(
                f"{column.name}: {len(infinite)} infinite value(s), which count as none, the first in {word} "
                f"{first}"
            )
        if column.quantity in ("stroke", "force") and _mostly_negative(value):
            remedy = "without its sign turned" if column.inverted else f"with --invert {column.name}"
            findings.append(
                f"{column.name}: mostly negative, and compression is positive here; if the record counts the "
                f"other way, import it {remedy}"
            )
    return findings


def _mostly_negative(value: NDArray[np.float64]) -> bool:
    known = value[np.isfinite(value)]
    return bool(len(known)) and bool(known.min() < 0 and -known.min() / _MOSTLY > max(known.max(), 0.0))
