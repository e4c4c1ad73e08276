"""Lists of instruments in a stand file: entries of every kind there is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from bufferstand.drivers.instruments import TAGS, Table, kinds
from bufferstand.foundation.settings import Settings


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


if TYPE_CHECKING:
    AmplifierEntry = Settings
    TemperatureEntry = Settings
    OtherEntry = Settings
else:
    AmplifierEntry = _entries("amplifier")
    TemperatureEntry = _entries("temperature")
    OtherEntry = _entries("sensor")
