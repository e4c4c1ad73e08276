"""The options of an import: the command line has priority over the mapping file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from zoneinfo import ZoneInfo

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.columns import ChannelRequest, channel_name
from bufferstand.recording.foreign.mapping import FileForm, MappingFile, load_mapping
from bufferstand.recording.foreign.record import ReadingOptions


@dataclass(frozen=True)
class ImportOptions:
    """What the user says about a record (docs/import.md); it goes before the mapping file.

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
    mapping : Path, optional
        Mapping file (docs/import.md).
    sheet : str, optional
        Sheet of a workbook.
    groups : sequence of str
        Groups of channels to read (TDMS, MDF4).
    block : int, optional
        Which one (from 1), where a file holds several records one below the other.
    salvage : bool
        Keep what is sound of a file that cannot be read whole.
    """

    kind: str | None = None
    column: Mapping[str, str] = field(default_factory=dict)
    unit: Mapping[str, str] = field(default_factory=dict)
    invert: Sequence[str] = ()
    specimen: Path | None = None
    sample_rate_hz: float | None = None
    mapping: Path | None = None
    sheet: str | None = None
    groups: Sequence[str] = ()
    block: int | None = None
    salvage: bool = False


@dataclass(frozen=True)
class ImportRequest:
    """Options and mapping file as one."""

    wishes: Mapping[str, ChannelRequest]
    reading: ReadingOptions
    kind: str | None
    sample_rate_Hz: float | None
    mapping: MappingFile | None
    time_format: str | None
    zone: ZoneInfo | None


def wanted_of(options: ImportOptions) -> ImportRequest:
    """Return options and mapping file as one.

    Raises
    ------
    BadInput
        If the mapping file cannot be read, or an option names no channel or one channel twice.
    """
    if options.block is not None and options.block < 1:
        raise BadInput(f"--block {options.block}: blocks are counted from 1")
    mapping = None if options.mapping is None else load_mapping(options.mapping)
    wishes = {} if mapping is None or options.mapping is None else mapping.wishes(options.mapping)
    for option, change in (("--column", _column), ("--unit", _unit)):
        given = options.column if option == "--column" else options.unit
        seen: set[str] = set()
        for name, value in given.items():
            full = channel_name(name, option)
            if full in seen:
                raise BadInput(f"{option}: “{name}” is given twice")
            seen.add(full)
            wishes[full] = change(wishes.get(full, ChannelRequest()), value, f"{option} {name}")
    for name in options.invert:
        full = channel_name(name, "--invert")
        wishes[full] = replace(
            wishes.get(full, ChannelRequest()), inverted=True, invert_said=f"--invert {name}", optional=False
        )
    form = FileForm() if mapping is None else mapping.file
    time = (
        None
        if mapping is None
        else next((c for n, c in mapping.columns.items() if n.lower() == "time"), None)
    )
    return ImportRequest(
        wishes=wishes,
        reading=_reading(options, form, wishes),
        kind=options.kind,
        sample_rate_Hz=_rate(options, mapping, wishes),
        mapping=mapping,
        time_format=None if time is None else time.format,
        zone=None if mapping is None else mapping.zone,
    )


def _column(wish: ChannelRequest, header: str, said: str) -> ChannelRequest:
    return replace(wish, header=header, number=None, header_said=said, optional=False)


def _unit(wish: ChannelRequest, unit: str, said: str) -> ChannelRequest:
    return replace(wish, unit=unit, unit_said=said, optional=False)


def _rate(
    options: ImportOptions, mapping: MappingFile | None, wishes: Mapping[str, ChannelRequest]
) -> float | None:
    if options.sample_rate_hz is not None or mapping is None:
        return options.sample_rate_hz
    if mapping.sample_rate_Hz is not None and "time" in wishes:
        raise BadInput(
            "it states a sample rate and a time column",
            file=options.mapping,
            place="sample_rate_Hz, columns.time",
            remedy="keep one of them",
        )
    return mapping.sample_rate_Hz


def _reading(options: ImportOptions, form: FileForm, wishes: Mapping[str, ChannelRequest]) -> ReadingOptions:
    return ReadingOptions(
        expected=[w.header for w in wishes.values() if w.header is not None and not w.optional],
        encoding=form.codec,
        separator=form.separator_character,
        decimal=form.decimal,
        header_line=form.header_line,
        units_line=form.units_line,
        first_line=form.first_line,
        missing=form.missing,
        sheet=options.sheet if options.sheet is not None else form.sheet,
        groups=options.groups or form.groups,
        block=options.block,
        salvage=options.salvage,
    )
