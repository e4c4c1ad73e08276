"""The form of a campaign file: groups of fields, made from the JSON Schema and what the file says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal

from bufferstand.foundation import BadInput, json_schema
from bufferstand.protocols.campaign_file import CampaignFile

Kind = Literal["number", "integer", "text", "choice", "boolean", "numbers", "list", "other"]
"""How a value is typed: ``numbers`` are one or more, a ``list`` is one even of a single number."""
UNITS = {
    "mm_per_s": "mm/s",
    "K_per_min": "K/min",
    "per_min": "1/min",
    "kN": "kN",
    "mm": "mm",
    "Hz": "Hz",
    "percent": "%",
    "C": "°C",
    "K": "K",
    "s": "s",
    "h": "h",
}
"""Ends of names → unit, longest first."""
GROUP_TITLES = {
    "campaign": "Campaign",
    "limits": "Limits of the test",
    "guards": "Guards",
    "zero": "Zero",
    "conditions": "Conditions",
    "motion": "Motion between the steps",
    "stroke": "Strokes",
    "plan": "Order",
}
FIRST = ("campaign", "conditions", "limits", "step")
"""What is asked first, in this order; the rest follows."""
SELDOM = ("guards", "zero", "motion", "stroke", "plan")
"""Groups that are shut until they are wanted."""
COMMON = {
    "campaign": ("id", "title", "stand", "specimen", "operator", "customer", "note"),
    "limits": ("force_max_kN", "stroke_max_mm", "temperature_stop_C", "temperature_resume_C"),
}
"""Fields that are always shown; the others of the group, where the file does not state them, on demand."""
SELDOM_OF_STEPS = (
    "compensate",
    "start_temperature_C",
    "start_timeout_s",
    "too_cold",
    "temperature_stop_C",
    "temperature_resume_C",
    "keep_order",
    "until_steady",
    "proof_load",
    "purpose",
)


_BOUND_AND_REASON = re.compile(r"(From \S+ to \S+): [^.]*(?:\.(?!\s|$)[^.]*)*\.")
_BOUND = re.compile(r"^From (\S+) to (\S+)$")


@dataclass(frozen=True)
class Field:
    """A value that can be stated.

    Parameters
    ----------
    path : tuple
        Where it stands in the file.
    label, unit, help : str
        What it is.
    kind : Kind
        How it is written; ``other`` is shown and changed in the text alone.
    value : str
        What the file states, as it is typed; empty where it states nothing.
    default : str
        What holds then.
    choices : tuple of str
        Of a ``choice``.
    required, stated, seldom : bool
        It must be stated; the file states it; it is seldom wanted.
    """

    path: tuple[str | int, ...]
    label: str
    unit: str
    help: str
    kind: Kind
    value: str
    default: str = ""
    choices: tuple[str, ...] = ()
    required: bool = False
    stated: bool = False
    seldom: bool = False

    @property
    def id(self) -> str:
        """Name of its element in the page."""
        return "f-" + "-".join(map(str, self.path))


@dataclass(frozen=True)
class Group:
    """A table of the file, or one of its steps.

    Parameters
    ----------
    path : tuple
        Where it stands.
    title : str
        What it is called.
    fields : tuple of Field
    unknown : tuple of str
        Keys of it that the schema does not know; they stay as they are.
    step : str
        Kind of the step; empty for a table.
    shut : bool
        Seldom wanted, and the file states nothing of it.
    """

    path: tuple[str | int, ...]
    title: str
    fields: tuple[Field, ...]
    unknown: tuple[str, ...] = ()
    step: str = ""
    shut: bool = False

    usual: tuple[Field, ...] = field(init=False)
    seldom: tuple[Field, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Sort the fields."""
        object.__setattr__(self, "usual", tuple(one for one in self.fields if not one.seldom))
        object.__setattr__(self, "seldom", tuple(one for one in self.fields if one.seldom))

    @property
    def id(self) -> str:
        """Name of its element in the page."""
        return "g-" + "-".join(map(str, self.path))


@cache
def campaign_schema() -> dict[str, Any]:
    """Return the JSON Schema that ``bufferstand schema campaign`` prints."""
    return json_schema(CampaignFile, "Campaign file of bufferstand")


def groups_of(content: Mapping[str, Any]) -> list[Group]:
    """Return the groups of the form for what a file says.

    Parameters
    ----------
    content : mapping
        The file as data, right or wrong.
    """
    schema = campaign_schema()
    names = [*FIRST, *(name for name in schema["properties"] if name not in FIRST)]
    groups: list[Group] = []
    for name in names:
        if name == "step":
            groups += _steps(schema, content.get("step"))
        else:
            stated = content.get(name)
            facts = _resolved(schema, schema["properties"][name])
            groups.append(_group(schema, facts, (name,), GROUP_TITLES.get(name, name), stated))
    return groups


def step_kinds() -> list[str]:
    """Return the kinds that a step can have."""
    return list(campaign_schema()["properties"]["step"]["items"]["discriminator"]["mapping"])


def value_of(field_kind: Kind, text: str) -> Any:
    """Return the value that was typed into a field; None for nothing.

    Raises
    ------
    BadInput
        If it is none of its kind.
    """
    said = text.strip()
    if not said:
        return None
    match field_kind:
        case "number":
            return float(_number(said, whole=False))
        case "integer":
            return _number(said, whole=True)
        case "numbers" | "list":
            parts = said.strip("[]").replace(";", " ").replace(", ", " ").split()
            numbers = [_number(part.strip(","), whole=False) for part in parts]
            alone = field_kind == "numbers" and len(numbers) == 1 and not said.startswith("[")
            return numbers[0] if alone else numbers
        case "boolean":
            if said not in ("true", "false"):
                raise BadInput(f"“{said}” is neither true nor false")
            return said == "true"
        case "other":
            raise BadInput("this is changed in the text")
        case _:
            return said


def _number(text: str, *, whole: bool) -> int | float:
    """Return a number as it was meant: a comma is a decimal one; what was typed without one stays whole."""
    plain = text.replace(",", ".") if text.count(",") == 1 and "." not in text else text
    try:
        if whole or plain.lstrip("+-").isdigit():
            return int(plain)
        number = float(plain)
    except ValueError:
        kind = "whole number" if whole else "number"
        raise BadInput(f"“{text}” is no {kind}", remedy="write e.g. " + ("5" if whole else "12.5")) from None
    if number - number != 0.0:
        raise BadInput(f"“{text}” is no finite number")
    return number


def _steps(schema: dict[str, Any], steps: Any) -> list[Group]:
    mapping = schema["properties"]["step"]["items"]["discriminator"]["mapping"]
    groups = []
    for index, step in enumerate(steps if isinstance(steps, Sequence) and not isinstance(steps, str) else ()):
        facts = step if isinstance(step, Mapping) else {}
        kind = str(facts.get("kind", ""))
        reference = mapping.get(kind)
        found = _resolved(schema, {"$ref": reference}) if reference else {"properties": {}}
        title = f"Step {index + 1}: {kind or 'of no kind'}"
        groups.append(_group(schema, found, ("step", index), title, facts, step=kind or "?"))
    return groups


def _group(
    schema: dict[str, Any],
    facts: Mapping[str, Any],
    path: tuple[str | int, ...],
    title: str,
    stated: Any,
    step: str = "",
) -> Group:
    values = stated if isinstance(stated, Mapping) else {}
    required = facts.get("required", ())
    usual = COMMON.get(str(path[0]))
    fields = []
    for key, about in facts["properties"].items():
        if step and key == "kind":
            continue
        seldom = key in SELDOM_OF_STEPS if step else usual is not None and key not in usual
        fields.append(_field(schema, about, (*path, key), values, required=key in required, seldom=seldom))
    unknown = tuple(str(key) for key in values if key not in facts["properties"])
    return Group(path, title, tuple(fields), unknown, step, shut=path[0] in SELDOM and not values)


def _field(
    schema: dict[str, Any],
    about: Mapping[str, Any],
    path: tuple[str | int, ...],
    values: Mapping[str, Any],
    *,
    required: bool,
    seldom: bool,
) -> Field:
    key = str(path[-1])
    label, unit = words_of(key)
    facts = _resolved(schema, about)
    kind, choices = _kind(schema, facts)
    stated = key in values
    return Field(
        path,
        label,
        unit,
        _help(str(about.get("description") or facts.get("description") or "")),
        kind,
        _typed(values[key]) if stated else "",
        _typed(about.get("default")),
        choices,
        required,
        stated,
        seldom and not stated and not required,
    )


def words_of(key: str) -> tuple[str, str]:
    """Return the name of a key in words, and its unit: ``force_max_kN`` is “force max” in kN."""
    for end, unit in UNITS.items():
        if key.endswith(f"_{end}"):
            return key.removesuffix(f"_{end}").replace("_", " "), unit
    return key.replace("_", " "), ""


def _help(description: str) -> str:
    """Return a description in short: of a bound its numbers, not its reason, which a refusal states."""
    parts = [_BOUND.sub(r"\1 to \2", part) for part in _BOUND_AND_REASON.split(description)]
    return " ".join(dict.fromkeys(part.strip().replace("``", "") for part in parts if part.strip()))


def _kind(schema: dict[str, Any], facts: Mapping[str, Any]) -> tuple[Kind, tuple[str, ...]]:
    """Return how a value is typed in."""
    parts = [_resolved(schema, one) for one in facts.get("anyOf", [facts])]
    said = [one for one in parts if one.get("type") != "null"]
    choices = [value for one in said for value in one.get("enum", [one["const"]] if "const" in one else [])]
    if choices and all("enum" in one or "const" in one for one in said):
        return "choice", tuple(str(one) for one in choices)
    types = {str(one.get("type", "")) for one in said}
    if types <= {"number", "integer"}:
        return ("number" if "number" in types else "integer"), ()
    if types == {"boolean"}:
        return "boolean", ()
    if types == {"string"}:
        return "text", ()
    if "array" in types and types <= {"array", "number", "integer"} and all(map(_of_numbers, said)):
        return ("list" if types == {"array"} else "numbers"), ()
    return "other", ()


def _of_numbers(facts: Mapping[str, Any]) -> bool:
    if facts.get("type") != "array":
        return True
    inner = [
        *facts.get("prefixItems", ()),
        *([facts["items"]] if isinstance(facts.get("items"), dict) else []),
    ]
    return bool(inner) and all(one.get("type") in ("number", "integer") for one in inner)


def _resolved(schema: dict[str, Any], facts: Mapping[str, Any]) -> Mapping[str, Any]:
    reference = facts.get("$ref")
    if not isinstance(reference, str):
        return facts
    found: Mapping[str, Any] = schema["$defs"][reference.rpartition("/")[2]]
    return found


def _typed(value: Any) -> str:
    """Return a value as one types it."""
    match value:
        case None:
            return ""
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:.15g}"
        case list() | tuple():
            return (
                ", ".join(_typed(one) for one in value)
                if all(not isinstance(one, dict) for one in value)
                else "…"
            )
        case dict():
            return ", ".join(f"{key} = {_typed(one)}" for key, one in value.items())
        case _:
            return str(value)
