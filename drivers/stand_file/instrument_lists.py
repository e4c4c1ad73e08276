"""Lists of instruments in a stand file: entries of every kind there is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from bufferstand.drivers.acquisition import AcquisitionSettings, acquisition_kinds
from bufferstand.drivers.instruments import TAGS, Instrument, Table, Thermometers, kinds, stream_name
from bufferstand.foundation.settings import Settings

ACQUISITION = "acquisition"
"""What the first acquisition device's samples are called."""


class OneOrMore:
    """Lets a list of tables be written as a single table, too: ``[amplifier]`` for one ``[[amplifier]]``."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the list, before which a table becomes a list of it."""
        return core_schema.no_info_before_validator_function(_as_entries, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Return that both forms are allowed."""
        made = handler(schema)
        return {"anyOf": [made["items"], made]}


def _as_entries(value: object) -> object:
    if isinstance(value, dict):
        return (value,)
    return tuple(value) if isinstance(value, list) else value


def _entries(table: Table) -> Any:
    """Return the type of an entry: any of the kinds of this list, which its tag tells apart."""
    schemas = tuple(kind.settings for kind in kinds() if kind.table == table)
    if len(schemas) == 1:
        return schemas[0]
    return Annotated[Union[schemas], Field(discriminator=TAGS[table])]  # noqa: UP007 - made of a tuple


def _acquisition_entry() -> Any:
    schemas = tuple(kind.settings for kind in acquisition_kinds())
    if len(schemas) == 1:
        return schemas[0]
    return Annotated[Union[schemas], Field(discriminator="kind")]  # noqa: UP007 - made of a tuple


if TYPE_CHECKING:
    AcquisitionEntry = AcquisitionSettings
    AmplifierEntry = Settings
    TemperatureEntry = Settings
    OtherEntry = Settings
else:
    AcquisitionEntry = _acquisition_entry()
    AmplifierEntry = _entries("amplifier")
    TemperatureEntry = _entries("temperature")
    OtherEntry = _entries("sensor")


def acquisition_stream(number: int) -> str:
    """Return what an acquisition device's samples are called."""
    return ACQUISITION if number == 0 else f"{ACQUISITION}_{number + 1}"


def instruments_in(
    amplifiers: Sequence[Settings], sensors: Sequence[Settings], folder: Path
) -> tuple[Instrument, ...]:
    """Return the instruments of a stand file's lists, without thermometers: amplifiers, then sensors.

    Parameters
    ----------
    amplifiers, sensors : sequence of Settings
        Entries, in the order of the file.
    folder : Path
        That relative paths in it start from.
    """
    lists: tuple[tuple[Table, Sequence[Settings]], ...] = (("amplifier", amplifiers), ("sensor", sensors))
    return tuple(
        Instrument(stream_name(table, number), (table, number), entry, folder)
        for table, entries in lists
        for number, entry in enumerate(entries)
    )


def thermometers_in(entries: Sequence[Settings], folder: Path) -> tuple[Thermometers, ...]:
    """Return the devices of thermometers of a stand file's list ``[[temperature]]``."""
    return tuple(
        Thermometers(stream_name("temperature", number), ("temperature", number), entry, folder)
        for number, entry in enumerate(entries)
    )
