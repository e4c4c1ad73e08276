"""What in the evaluation document has a key for each quantity: a cycle, and the means over cycles.

Programs that write and read them take them as dictionaries. Their JSON Schema has the keys that do not depend
on quantities, stated here, and those of every quantity of :data:`bufferstand.evaluation.catalogue.QUANTITIES`
at its ``path``, and no others: a further quantity is in it as soon as the catalogue has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_type_hints

from pydantic import ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema
from typing_extensions import TypedDict  # pydantic reads those of Python 3.12 and later only

from bufferstand.evaluation.catalogue import KINDS, QUANTITIES, Quantity


@dataclass(frozen=True)
class OneOf:
    """Marks a text that is one of some words."""

    words: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Accept the words alone."""
        return core_schema.literal_schema(list(self.words))


@dataclass(frozen=True)
class WithQuantities:
    """Marks a dictionary that has the keys of ``fixed``, those of every quantity, and no others.

    Attributes
    ----------
    name : str
        Of the dictionary, in the JSON Schema.
    fixed : type
        A ``TypedDict`` of the keys that do not depend on quantities; its docstring is the dictionary's.
    path : callable
        Returns where a quantity stands: a key, or a group and a key.
    value : object
        Type of what stands there.
    """

    name: str
    fixed: type
    path: Callable[[Quantity], tuple[str, ...]]
    value: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Accept what has these keys and no others."""
        keys = get_type_hints(self.fixed, include_extras=True)
        groups: dict[str, dict[str, Any]] = {}
        for quantity in QUANTITIES:
            *group, key = self.path(quantity)
            (groups.setdefault(group[0], {}) if group else keys)[key] = _described(quantity, self.value)
        for group_name, inner in groups.items():
            keys[group_name] = _closed(group_name, inner, "A group of quantities.")
        return handler.generate_schema(_closed(self.name, keys, self.fixed.__doc__))


def _described(quantity: Quantity, value: Any) -> Any:
    """Return the type of a quantity's value, with what an editor or a program is told of it."""
    symbol = f"{quantity.symbol}, " if quantity.symbol else ""
    of_kinds = "" if quantity.kinds == KINDS else f"; of {', '.join(sorted(quantity.kinds))} runs"
    facts: dict[str, Any] = {"unit": quantity.unit}
    return Annotated[
        value,
        Field(
            title=quantity.label,
            description=f"{symbol}{quantity.meaning} [{quantity.unit}]{of_kinds}",
            json_schema_extra=facts,
        ),
    ]


def _closed(name: str, keys: Mapping[str, Any], text: str | None) -> Any:
    """Return a ``TypedDict`` of these keys that refuses any other one."""
    make: Any = TypedDict  # the type checker takes literal keys alone, and these are the catalogue's
    made = make(name, dict(keys))
    made.__doc__ = text
    made.__pydantic_config__ = ConfigDict(extra="forbid")
    return made


NumberByQuantity = dict[Annotated[str, OneOf(QUANTITIES.names)], float | None]
"""U = 2 u, or half-widths of 95 % intervals, by name of quantity, in its unit; null where it has none."""
ReasonByQuantity = dict[Annotated[str, OneOf(QUANTITIES.names)], str]
"""Why quantities are missing, by name."""


class CycleFacts(TypedDict):
    """A cycle: when, whether it is complete and steady, and each quantity; null where one is missing."""

    index: Annotated[int, Field(description="number of the cycle in its run")]
    start_s: Annotated[float, Field(description="when the stroke leaves the lower turning point [s]")]
    end_s: Annotated[float, Field(description="when the stroke is back at the lower turning point [s]")]
    complete: Annotated[bool, Field(description="both turning points and all between them are on record")]
    steady: Annotated[
        bool, Field(description="complete, and like the cycles beside it: means are taken over such")
    ]
    expanded_uncertainty: Annotated[
        NumberByQuantity,
        Field(description="U = 2 u by name of quantity, in its unit; where it could be propagated"),
    ]
    why: Annotated[list[str], Field(description="why it is not complete, not steady or not evaluated")]
    missing: Annotated[
        dict[Annotated[str, OneOf((*QUANTITIES.names, *(f"U({name})" for name in QUANTITIES.names)))], str],
        Field(description="why a quantity is missing, by its name; why its U is, by U(name)"),
    ]


class MeanEntry(TypedDict):
    """The mean of a quantity over the cycles used."""

    value: float | None
    expanded_uncertainty: float | None
    coverage_factor: float


class SummaryFacts(TypedDict):
    """The mean of each quantity over the cycles used."""

    cycles_used: Annotated[list[int], Field(description="their numbers")]


CycleEntry = Annotated[
    dict[str, Any], WithQuantities("CycleEntry", CycleFacts, lambda quantity: quantity.path, float | None)
]
SummaryEntry = Annotated[
    dict[str, Any],
    WithQuantities("SummaryEntry", SummaryFacts, lambda quantity: (quantity.name,), MeanEntry),
]
