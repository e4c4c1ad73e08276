"""Schema of a description file: what a Modbus device shows, by the document that says so.

What a document does not say is not in its description: an ``[[ask]]`` names it, says why, and a stand file
has to answer it; ``"?key"`` stands in the place of the answer.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.drivers.descriptions import Asked, Question, Source, as_entries
from bufferstand.foundation.settings import (
    Settings,
    Within,
    WrongKeyError,
    load_shipped_or_own,
    shipped_names,
)

SHIPPED = Path(__file__).parent / "descriptions"
"""Folder of the descriptions that come with the software."""
IoTable = Literal["holding", "input", "coil", "discrete"]
"""Holding registers (function 3), input registers (4), coils (1), discrete inputs (2)."""
IoType = Literal["u16", "i16", "sm16", "u32", "i32", "sm32", "f32", "bit"]
"""Unsigned, two's complement, sign and magnitude (the topmost bit is the sign), IEEE 754; a coil or input."""
Order = Literal["big", "little"]
WORDS: dict[str, int] = {"u16": 1, "i16": 1, "sm16": 1, "u32": 2, "i32": 2, "sm32": 2, "f32": 2, "bit": 1}
"""Registers (or bits of a table of bits) that a value of each type takes."""
BIT_TABLES = frozenset({"coil", "discrete"})
Address = Annotated[int, Field(ge=0, le=65535)]
Step = Annotated[int, Field(ge=-1000, le=1000)]
Content = Annotated[float, Within(-(2.0**128), 2.0**128, "no register holds more")]
"""What registers hold, before it is scaled."""
Number = Annotated[float, Within(-1e12, 1e12, "no measured value is larger")]
Span = Annotated[
    tuple[float, float],
    BeforeValidator(lambda v: tuple(float(one) for one in v) if isinstance(v, list) else v),
    Within(-1e12, 1e12, "no measured value is larger"),
]
"""A TOML array of two numbers, lowest first."""
Places = Annotated[
    tuple[int, int],
    BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v),
    Within(0, 31, "a value has 32 bits at most"),
]


class Expected(Settings):
    """Registers that always hold the same: the device is known by them."""

    what: str = Field(min_length=1)
    table: IoTable = "holding"
    address: Address
    type: IoType = "u16"
    expect: Content
    swapped: Content | None = None
    """What is read there if something on the way exchanges bytes or words."""


class Status(Settings):
    """A place that says whether a value can be believed."""

    table: IoTable | Asked = "holding"
    address: Address
    step: Step = 0
    """Addresses from one point of a row to the next."""
    bit: int | None = Field(default=None, ge=0, le=15)
    """The bit that is looked at; without it the whole register is."""
    equals: Annotated[int, Field(ge=0, le=65535)] = 1
    """With this content it says what ``what`` says."""
    what: str = Field(min_length=1)
    valid: bool = False
    """Whether the value may be used all the same: then it is only told."""


class Sign(Settings):
    """A bit apart from the value that makes it negative."""

    table: IoTable | Asked = "holding"
    address: Address
    step: Step = 0
    bit: int = Field(default=0, ge=0, le=15)


class Fault(Settings):
    """A content of the value's own registers that is no measurement."""

    raw: Content
    what: str = Field(min_length=1)


class PointEntry(Settings):
    """A value, or a row of like ones."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_. -]*(\{n\})?$")
    """As it is written on the device; ``{n}`` is the number in a row."""
    count: int = Field(default=1, ge=1, le=128)
    first: int = Field(default=0, ge=0, le=1000)
    """Number of the first one of a row."""
    step: int = Field(default=1, ge=1, le=1000)
    """Addresses from one to the next."""
    table: IoTable | Asked = "holding"
    address: Address
    type: IoType
    bits: Places | None = None
    """Lowest and highest bit of the value in its register; the others are not of it."""
    sign: Sign | None = None
    scale: Number | Asked = 1.0
    """Units per count; may be negative."""
    offset: Number | Asked = 0.0
    """Value at count 0."""
    unit: str = Field(min_length=1)
    range: Span | None = None
    """Lowest and highest value that can be, in the unit; outside it is no measurement."""
    fault: Annotated[tuple[Fault, ...], as_entries] = ()
    status: Annotated[tuple[Status, ...], as_entries] = ()

    @model_validator(mode="after")
    def _makes_sense(self) -> PointEntry:
        if (self.count > 1) != ("{n}" in self.name):
            raise WrongKeyError(
                f"name = “{self.name}”: a row, and only a row, has {{n}} in it", "name", "count"
            )
        if self.scale == 0.0:
            raise WrongKeyError("scale = 0 makes every value the same", "scale")
        if (self.table in BIT_TABLES) != (self.type == "bit") and not str(self.table).startswith("?"):
            raise WrongKeyError(
                f"type = “{self.type}” does not lie in table “{self.table}”; coils and discrete inputs hold "
                "“bit”, registers everything else",
                "type",
                "table",
            )
        if self.step < WORDS[self.type] and self.count > 1:
            raise WrongKeyError(f"step = {self.step}: a “{self.type}” takes more registers", "step", "type")
        if self.bits is not None and not self.bits[0] <= self.bits[1] < 16 * WORDS[self.type]:
            raise WrongKeyError(f"bits = {list(self.bits)} are not in a “{self.type}”", "bits")
        if self.bits is not None and self.type in {"f32", "bit"}:
            raise WrongKeyError(f"a “{self.type}” has no bits of its own; leave bits out", "bits")
        if self.range is not None and self.range[0] >= self.range[1]:
            raise WrongKeyError("range must be [lowest, highest]", "range")
        return self


class Description(Settings):
    """What a Modbus device shows, and where."""

    id: str = Field(min_length=1)
    edition: int = Field(ge=1, le=10_000)
    title: str = Field(min_length=1)
    confirmed: bool = False
    """Whether it was tried on the device itself."""
    wires: Annotated[tuple[Literal["tcp", "rtu"], ...], as_entries]
    """What it is reached by."""
    source: Annotated[tuple[Source, ...], as_entries] = Field(min_length=1)
    word_order: Order | Asked = "big"
    """Which of the two registers of a 32-bit value comes first: the high one (``big``) or the low one."""
    byte_order: Order | Asked = "big"
    """Which byte of a register comes first; Modbus has the high one first."""
    base: Annotated[int, Field(ge=-65535, le=65535)] | Asked = 0
    """Added to the address of every point; not to those of ``identity``."""
    most_registers: int = Field(default=125, ge=1, le=125)
    """Registers that one request may ask for."""
    bridge: int = Field(default=0, ge=0, le=124)
    """Registers between two wanted ones that may be read with them; others lie in reads of their own."""
    fastest_Hz: Annotated[float, Field(gt=0), Within(0.001, 10_000.0, "of a polled device")] | None = None
    """How often there is a new value, where the document says it."""
    ask: Annotated[tuple[Question, ...], as_entries] = ()
    identity: Annotated[tuple[Expected, ...], as_entries] = ()
    point: Annotated[tuple[PointEntry, ...], as_entries] = Field(min_length=1)

    @model_validator(mode="after")
    def _asks_what_it_uses(self) -> Description:
        asked = [one.key for one in self.ask]
        for key in asked:
            if asked.count(key) > 1:
                raise WrongKeyError(f"“{key}” is asked twice", "ask")
        used = set(_answers_used(self))
        for key in used - set(asked):
            raise WrongKeyError(f"“?{key}” is used, but no [[ask]] has key = “{key}”", "ask")
        for key in set(asked) - used:
            raise WrongKeyError(f"“{key}” is asked for nothing: nowhere stands “?{key}”", "ask")
        return self


def _answers_used(found: Description) -> list[str]:
    values: list[object] = [found.word_order, found.byte_order, found.base]
    for point in found.point:
        values += [point.table, point.scale, point.offset, point.unit]
        values += [one.table for one in point.status]
        if point.sign is not None:
            values.append(point.sign.table)
    return [one[1:] for one in values if isinstance(one, str) and one.startswith("?")]


def load_description(name: str, folder: Path) -> Description:
    """Return a description by the name of a shipped one, or from a TOML file.

    Parameters
    ----------
    name : str
        A name without ending, or a path that ends in ``.toml``.
    folder : Path
        Where a relative path starts from.

    Raises
    ------
    BadInput
        If there is none, or it breaks its schema.
    """
    return load_shipped_or_own(
        name,
        Description,
        folder=folder,
        shipped=SHIPPED,
        what="there is no description “{name}” of a Modbus device",
    )


def shipped_descriptions() -> tuple[str, ...]:
    """Return the names of the descriptions that come with the software."""
    return shipped_names(SHIPPED)
