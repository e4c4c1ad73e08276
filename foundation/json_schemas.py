"""JSON Schemas of settings files and documents, for editors to complete and to check."""

from __future__ import annotations

import ast
import inspect
import textwrap
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from bufferstand.foundation.settings import SchemaPlace, Within, fields_by_key

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(described: type, title: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of what a file or document may hold.

    Parameters
    ----------
    described : type
        A model of pydantic or a ``TypedDict``.
    title : str
        What it is.

    Returns
    -------
    dict
        Descriptions are the attribute docstrings; the bounds of numbers in files are among it.
    """
    schema = TypeAdapter(described).json_schema(schema_generator=_WithDocstrings)
    return {"$schema": DIALECT, **schema, "title": title}


class _WithDocstrings(GenerateJsonSchema):
    """Adds the docstring below a field, and its bounds in files (:class:`Within`)."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        made = super().model_schema(schema)
        _describe(made, schema["cls"])
        for key in fields_by_key(schema["cls"]):
            spot = SchemaPlace(schema["cls"]).key(key)
            for bound in () if spot is None else spot.withins:
                _bound(made["properties"][key], bound)
        return made

    def typed_dict_schema(self, schema: core_schema.TypedDictSchema) -> JsonSchemaValue:
        made = super().typed_dict_schema(schema)
        if cls := schema.get("cls"):
            _describe(made, cls)
        return made


def _describe(made: JsonSchemaValue, cls: type[Any]) -> None:
    """Add the docstring of a class and those of its attributes."""
    if cls.__doc__:
        made["description"] = inspect.cleandoc(cls.__doc__)
    for name, text in _attribute_docstrings(cls).items():
        if name in made.get("properties", {}):
            made["properties"][name].setdefault("description", text)


def _attribute_docstrings(cls: type[Any]) -> dict[str, str]:
    """Return the string below each annotated attribute of a class and its bases."""
    found: dict[str, str] = {}
    for base in reversed(getattr(cls, "__mro__", ())):
        if not base.__module__.startswith("bufferstand."):
            continue
        try:
            source = inspect.getsource(base)
        except OSError:  # made while the program runs: its keys say of themselves what they mean
            continue
        body = ast.parse(textwrap.dedent(source)).body[0]
        assert isinstance(body, ast.ClassDef)
        for one, below in zip(body.body, body.body[1:], strict=False):
            if (
                isinstance(one, ast.AnnAssign)
                and isinstance(one.target, ast.Name)
                and isinstance(below, ast.Expr)
                and isinstance(below.value, ast.Constant)
            ):
                found[one.target.id] = inspect.cleandoc(str(below.value.value))
    return found


def _bound(made: JsonSchemaValue, bound: Within) -> None:
    """Write the bounds of a number, or of a list's entries, with their reason."""
    for place in [made, *made.get("anyOf", [])]:
        number = place.get("items", place)
        if number.get("type") in ("number", "integer"):
            number |= {"minimum": bound.low, "maximum": bound.high}
    said = f"From {bound.low:g} to {bound.high:g}: {bound.why}."
    before = made.get("description", "")
    if said not in before:  # a model that others name, too, is described more than once
        made["description"] = f"{before} {said}".lstrip()
