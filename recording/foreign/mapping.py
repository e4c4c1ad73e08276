"""A mapping file: the description that a laboratory writes once for its own export (docs/import.md)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal
from zoneinfo import ZoneInfo

from pydantic import BeforeValidator, Field, field_validator, model_validator

from bufferstand.foundation import LOGGER_HZ, BadInput, Kind
from bufferstand.foundation.channels import ChannelUncertainty
from bufferstand.foundation.files import file_hash
from bufferstand.foundation.settings import FIGURE, LINE, Day, Settings, Within, WrongKeyError, load_settings
from bufferstand.recording.foreign.columns import DATE_TIME, NAMES_SHOWN, ChannelRequest, full_name


def _as_texts(value: object) -> object:
    if isinstance(value, str):
        raise ValueError(f'write a list: ["{value}"]')
    return tuple(value) if isinstance(value, list) else value


_Texts = Annotated[tuple[str, ...], BeforeValidator(_as_texts)]
_CODECS = {
    "UTF-8": "utf-8-sig",  # reads files with and without a mark
    "UTF-16": "utf-16",
    "Latin-1": "latin-1",
    "Windows-1252": "cp1252",
}
_SEPARATORS = {"tab": "\t", ";": ";", ",": ","}


class FileForm(Settings):
    """``[file]``: how the export is written; what is left out is found out."""

    encoding: Literal["UTF-8", "UTF-16", "Latin-1", "Windows-1252"] | None = None
    separator: Literal["tab", ";", ","] | None = None
    decimal: Literal[".", ","] | None = None
    header_line: Annotated[int, Field(ge=0), LINE] | None = None
    """Line (row of a sheet) of the headers, from 1; 0: there is none."""
    units_line: Annotated[int, Field(ge=1), LINE] | None = None
    """Line of the units, where they stand apart from the headers."""
    first_line: Annotated[int, Field(ge=1), LINE] | None = None
    """Line of the first numbers."""
    missing: _Texts = ()
    """Cells that mean: no value."""
    sheet: str | None = None
    groups: _Texts = ()
    """Groups of channels to read (TDMS, MDF4)."""

    @property
    def codec(self) -> str | None:
        """Get the codec that ``encoding`` names."""
        return None if self.encoding is None else _CODECS[self.encoding]

    @property
    def separator_character(self) -> str | None:
        """Get the character that ``separator`` names."""
        return None if self.separator is None else _SEPARATORS[self.separator]


class ChannelForm(Settings):
    """``[columns.NAME]``: where a channel is, and what its numbers mean."""

    header: str | None = Field(default=None, min_length=1)
    number: Annotated[int, Field(ge=1), LINE] | None = None
    """Its column, counted from 1; instead of ``header``."""
    unit: str | None = Field(default=None, min_length=1)
    invert: bool = False
    scale: Annotated[float, FIGURE] = 1.0
    offset: Annotated[float, FIGURE] = 0.0
    """``value = offset + scale · number``, in ``unit``; for exports in volts."""
    raw_unit: str | None = None
    """Unit of the numbers as they stand, where ``scale`` is given."""
    optional: bool = False
    """Whether a record may lack it."""
    format: str | None = None
    """Of a time whose unit is ``date-time``: as in strptime; ISO 8601 if left out."""
    delay_s: Annotated[float, FIGURE] | None = None
    certificate: str | None = None
    calibrated: Day | None = None
    valid_until: Day | None = None
    uncertainty: ChannelUncertainty | None = None

    @model_validator(mode="after")
    def _one_column(self) -> ChannelForm:
        if self.header is not None and self.number is not None:
            raise WrongKeyError("give either header or number, not both", "header", "number")
        if self.scale == 0.0:
            raise WrongKeyError("scale must not be 0", "scale")
        if self.format is not None and self.unit != DATE_TIME:
            raise WrongKeyError(f"a format is for a time whose unit is “{DATE_TIME}”", "format", "unit")
        if (self.scale, self.offset) != (1.0, 0.0) and self.unit in (None, DATE_TIME):
            raise WrongKeyError(
                "with scale or offset, say the unit of the value (dates and times have none)",
                "scale",
                "offset",
                "unit",
            )
        return self

    def channel_facts(self) -> dict[str, Any]:
        """Return what it states of the measuring chain, as a channel keeps it."""
        calibration = {
            "certificate": self.certificate,
            "date": self.calibrated,
            "valid_until": self.valid_until,
        }
        facts: dict[str, Any] = {}
        if stated := {key: value for key, value in calibration.items() if value is not None}:
            facts["calibration"] = stated
        if self.delay_s is not None:
            facts["delay_s"] = self.delay_s
        if self.uncertainty is not None:
            facts["uncertainty"] = self.uncertainty
        return facts


class MappingFile(Settings):
    """A mapping file."""

    name: str = ""
    """What export it describes; kept in the run file."""
    kind: Kind | None = None
    sample_rate_Hz: (
        Annotated[float, Field(gt=0), Within(*LOGGER_HZ, "no logger is slower or faster")] | None
    ) = None
    time_zone: str | None = None
    """Of dates and times that state none, e.g. ``Europe/Vienna``."""
    file: FileForm = FileForm()
    columns: Mapping[str, ChannelForm] = Field(default_factory=dict)

    @field_validator("time_zone")
    @classmethod
    def _known_zone(cls, name: str | None) -> str | None:
        if name is not None:
            try:
                ZoneInfo(name)
            except (ValueError, OSError, LookupError):
                raise ValueError("no such time zone; write it as Europe/Vienna or UTC") from None
        return name

    @field_validator("columns")
    @classmethod
    def _known_channels(cls, columns: Mapping[str, ChannelForm]) -> Mapping[str, ChannelForm]:
        names = [full_name(name) for name in columns]
        if None in names:
            unknown = list(columns)[names.index(None)]
            raise ValueError(f"“{unknown}” is no name of a channel; use {NAMES_SHOWN}")
        if len(set(names)) < len(names):
            raise ValueError("one channel is named twice")
        return columns

    @property
    def zone(self) -> ZoneInfo | None:
        """Get the time zone."""
        return None if self.time_zone is None else ZoneInfo(self.time_zone)

    def wishes(self, path: Path) -> dict[str, ChannelRequest]:
        """Return what it says, by channel; ``path`` is named in messages."""
        found = {}
        for name, form in self.columns.items():
            said = f"columns.{name} of {path.name}"
            found[str(full_name(name))] = ChannelRequest(
                header=form.header,
                number=form.number,
                header_said=said,
                unit=form.unit,
                unit_said=said if form.unit is not None else "",
                inverted=form.invert,
                invert_said=said if form.invert else "",
                scale=form.scale,
                offset=form.offset,
                raw_unit=form.raw_unit,
                optional=form.optional,
                facts=form.channel_facts(),
            )
        return found


def load_mapping(path: Path) -> MappingFile:
    """Read a mapping file.

    Raises
    ------
    BadInput
        If it cannot be read or breaks the schema.
    """
    return load_settings(path, MappingFile)


def mapping_facts(path: Path, mapping: MappingFile) -> dict[str, str]:
    """Return what identifies a mapping file, for the run file.

    Raises
    ------
    BadInput
        If it can no longer be read.
    """
    try:
        return {"file": path.name, "name": mapping.name, "sha256": file_hash(path)}
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
