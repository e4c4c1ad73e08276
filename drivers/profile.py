"""Register maps as data: schema of ``profiles/*.toml``, checks, and the coding of values into registers.

Driver and simulated device read the same profile, so that neither can disagree with the documentation.
Addresses are 0-based wire addresses in the holding table.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from foundation.canonical import content_hash
from foundation.errors import BadInput
from foundation.settings import Settings, load_settings

RegisterType = Literal["u16", "i16", "u32", "i32", "f32"]
WordOrder = Literal["big", "little"]
"""Which of the two registers of a 32-bit value comes first: the high word (``big``) or the low one."""

WORDS: Mapping[str, int] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}
"""Registers that a value of each type takes."""
_CODES: Mapping[str, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
_DTYPES: Mapping[str, str] = {"u16": "u2", "i16": "i2", "u32": "u4", "i32": "i4", "f32": "f4"}

SHIPPED = Path(__file__).parent / "profiles"
"""Folder of the profiles that come with the software."""

MAX_READ = 125
"""Registers that one Modbus read (FC3, FC4, FC23) can carry (Modbus application protocol 1.1b3, 6.3)."""


def encode_value(value: float, kind: str, word_order: str = "big") -> list[int]:
    """Return the registers of a value.

    Parameters
    ----------
    value : float or int
        In the register's own unit.
    kind : str
        ``u16``, ``i16``, ``u32``, ``i32`` or ``f32``.
    word_order : str
        ``big`` or ``little``.

    Returns
    -------
    list of int
        One or two unsigned 16-bit words.

    Raises
    ------
    ValueError
        If the value does not fit the type, or is no whole number where one is needed.
    """
    number: float | int = value
    if kind != "f32":
        if not float(value).is_integer():
            raise ValueError(f"{value!r} is not a whole number, {kind} needs one")
        number = int(value)
    try:
        packed = struct.pack(_CODES[kind], number)
    except (struct.error, OverflowError):
        raise ValueError(f"{value!r} does not fit {kind}") from None
    words = list(struct.unpack(f">{len(packed) // 2}H", packed))
    return words if word_order == "big" else words[::-1]


def decode_value(registers: Sequence[int], kind: str, word_order: str = "big") -> float | int:
    """Return the value that registers hold: the inverse of :func:`encode_value`.

    Raises
    ------
    ValueError
        If the number of registers is not that of the type.
    """
    if len(registers) != WORDS[kind]:
        raise ValueError(f"{kind} takes {WORDS[kind]} registers, got {len(registers)}")
    words = registers if word_order == "big" else registers[::-1]
    packed = struct.pack(f">{len(words)}H", *words)
    value: float | int = struct.unpack(_CODES[kind], packed)[0]
    return value


@dataclass(frozen=True)
class Place:
    """One typed value inside a window of registers."""

    name: str
    kind: str
    offset: int

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return WORDS[self.kind]


@dataclass(frozen=True)
class Layout:
    """A window of registers as named values: a block of the map, the ring's header, one sample.

    Parameters
    ----------
    address : int
        Wire address of the window's first register (0 for a part of another window).
    words : int
        Registers in the window, those without a name included.
    places : tuple of Place
        The values, by ascending offset.
    word_order : str
        ``big`` or ``little``.
    """

    address: int
    words: int
    places: tuple[Place, ...]
    word_order: str

    def decode(self, registers: Sequence[int]) -> dict[str, float | int]:
        """Return every value of the window by name.

        Raises
        ------
        ValueError
            If the number of registers is not that of the window.
        """
        self._demand(len(registers), self.words)
        return {
            place.name: decode_value(
                registers[place.offset : place.offset + place.words], place.kind, self.word_order
            )
            for place in self.places
        }

    def encode(self, values: Mapping[str, float]) -> list[int]:
        """Return the window's registers; registers without a name are 0.

        Raises
        ------
        ValueError
            If a value is missing, has no place here, or does not fit.
        """
        names = {place.name for place in self.places}
        if wrong := names.symmetric_difference(values):
            raise ValueError(f"values do not match the window: {', '.join(sorted(wrong))}")
        registers = [0] * self.words
        for place in self.places:
            try:
                words = encode_value(values[place.name], place.kind, self.word_order)
            except ValueError as error:
                raise ValueError(f"{place.name}: {error}") from None
            registers[place.offset : place.offset + place.words] = words
        return registers

    def decode_rows(self, registers: Sequence[int], rows: int) -> dict[str, NDArray[Any]]:
        """Return each value of ``rows`` windows in a row, as an array of its own type, shape (rows,).

        Raises
        ------
        ValueError
            If the number of registers is not ``rows`` windows.
        """
        self._demand(len(registers), rows * self.words)
        table = np.asarray(registers, dtype=np.uint16).reshape(rows, self.words)
        columns: dict[str, NDArray[Any]] = {}
        for place in self.places:
            words = table[:, place.offset : place.offset + place.words]
            if self.word_order == "little":
                words = words[:, ::-1]
            packed = np.ascontiguousarray(words).astype(">u2").view(">" + _DTYPES[place.kind])
            columns[place.name] = packed[:, 0].astype(_DTYPES[place.kind])
        return columns

    def encode_rows(self, columns: Mapping[str, NDArray[Any]]) -> list[int]:
        """Return the registers of windows in a row from arrays of equal length (undoes :meth:`decode_rows`).

        Raises
        ------
        ValueError
            If a column is missing, lengths differ, or a value does not fit its type.
        """
        rows = len(columns[self.places[0].name])
        table = np.zeros((rows, self.words), dtype=np.uint16)
        for place in self.places:
            column = np.asarray(columns[place.name])
            with np.errstate(invalid="ignore", over="ignore"):  # what does not fit is refused below
                typed = column.astype(">" + _DTYPES[place.kind])
            if typed.shape != (rows,) or (place.kind != "f32" and not np.array_equal(typed, column)):
                raise ValueError(f"{place.name}: a value does not fit {place.kind}, or lengths differ")
            words = typed.view(">u2").reshape(rows, place.words)
            table[:, place.offset : place.offset + place.words] = (
                words if self.word_order == "big" else words[:, ::-1]
            )
        flat: list[int] = table.ravel().tolist()
        return flat

    @staticmethod
    def _demand(got: int, wanted: int) -> None:
        if got != wanted:
            raise ValueError(f"the window has {wanted} registers, got {got}")


class Register(Settings):
    """One named value of the map."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    address: int = Field(ge=0, le=0xFFFF)
    type: RegisterType
    access: Literal["r", "rw"]
    unit: str = ""
    expect: float | int | None = None
    """What it must hold at connect, where it is a test value."""
    description: str = ""

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return WORDS[self.type]

    @model_validator(mode="after")
    def _expected_fits(self) -> Register:
        if self.expect is not None:
            encode_value(self.expect, self.type)
        if self.address + self.words > 0x10000:
            raise ValueError(f"“{self.name}” reaches beyond address 65535")
        return self


def _split_field(value: object) -> object:
    """Turn ``name:type`` into a pair."""
    return tuple(value.split(":")) if isinstance(value, str) else value


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


_Field = Annotated[tuple[str, RegisterType], BeforeValidator(_split_field)]
_Fields = Annotated[tuple[_Field, ...], BeforeValidator(_as_tuple)]


class Ring(Settings):
    """The window through which the sample ring is read: a header, then as many samples as fit."""

    address: int = Field(ge=0, le=0xFFFF)
    registers: int = Field(ge=1, le=MAX_READ)
    header: _Fields
    sample: _Fields
    tick_unit: Literal["us"]
    description: str = ""

    @model_validator(mode="after")
    def _holds_a_sample(self) -> Ring:
        header = {name for name, _ in self.header}
        for name in ("first_sequence", "count", "overruns", "status_word"):
            if name not in header:
                raise ValueError(f"the ring's header lacks “{name}”")
        if ("tick", "u32") not in self.sample:
            raise ValueError("a sample of the ring lacks “tick:u32”")
        if self.samples_per_block < 1:
            raise ValueError(f"not one sample fits in {self.registers} registers")
        return self

    @property
    def header_words(self) -> int:
        """Registers of the header."""
        return sum(WORDS[kind] for _, kind in self.header)

    @property
    def sample_words(self) -> int:
        """Registers of one sample."""
        return sum(WORDS[kind] for _, kind in self.sample)

    @property
    def samples_per_block(self) -> int:
        """Samples that one transaction can carry."""
        return (self.registers - self.header_words) // self.sample_words


class ProfileFacts(Settings):
    """Which register map it is."""

    id: str = Field(min_length=1)
    edition: str
    word_order: WordOrder
    description: str = ""


class ProfileFile(Settings):
    """A profile's TOML file."""

    profile: ProfileFacts
    register_: Annotated[tuple[Register, ...], BeforeValidator(_as_tuple)] = Field(alias="register")
    ring: Ring

    @model_validator(mode="after")
    def _apart(self) -> ProfileFile:
        names = [register.name for register in self.register_]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"register “{name}” is there twice")
        spans = [(r.address, r.address + r.words, f"“{r.name}”") for r in self.register_]
        spans.append((self.ring.address, self.ring.address + self.ring.registers, "the ring's window"))
        for (_, end, first), (start, _, second) in pairwise(sorted(spans)):
            if start < end:
                raise ValueError(f"{first} and {second} overlap at address {start}")
        return self


@dataclass(frozen=True)
class Profile:
    """A checked register map.

    Parameters
    ----------
    facts : ProfileFacts
        Id, edition, word order.
    registers : mapping of str to Register
        By name, in the file's order.
    ring : Ring
        The sample ring's window.
    hash : str
        SHA-256 of the content, for the run file.
    """

    facts: ProfileFacts
    registers: Mapping[str, Register]
    ring: Ring
    hash: str

    @property
    def word_order(self) -> str:
        """``big`` or ``little``."""
        return self.facts.word_order

    def find(self, name: str) -> Register:
        """Return the register of a name.

        Raises
        ------
        KeyError
            If the map has none of that name.
        """
        return self.registers[name]

    def encode(self, name: str, value: float) -> list[int]:
        """Return the registers that ``value`` makes in register ``name``.

        Raises
        ------
        KeyError, ValueError
            If there is no such register, or the value does not fit it.
        """
        return encode_value(value, self.find(name).type, self.word_order)

    def decode(self, name: str, registers: Sequence[int]) -> float | int:
        """Return the value of register ``name`` from its words.

        Raises
        ------
        KeyError, ValueError
            If there is no such register, or the number of words is not its own.
        """
        return decode_value(registers, self.find(name).type, self.word_order)

    def block(self, first: str, last: str) -> Layout:
        """Return the window from register ``first`` to register ``last``, both included.

        Raises
        ------
        KeyError
            If there is no such register.
        """
        start = self.find(first).address
        end = self.find(last).address + self.find(last).words
        inside = sorted(
            (r for r in self.registers.values() if start <= r.address < end), key=lambda r: r.address
        )
        places = tuple(Place(r.name, r.type, r.address - start) for r in inside)
        return Layout(start, end - start, places, self.word_order)

    @property
    def ring_header(self) -> Layout:
        """The ring window's header."""
        return self._row(self.ring.address, self.ring.header)

    @property
    def ring_sample(self) -> Layout:
        """One sample of the ring."""
        return self._row(0, self.ring.sample)

    def _row(self, address: int, fields: Sequence[tuple[str, str]]) -> Layout:
        places: list[Place] = []
        offset = 0
        for name, kind in fields:
            places.append(Place(name, kind, offset))
            offset += WORDS[kind]
        return Layout(address, offset, tuple(places), self.word_order)


def load_profile(name: str, folder: Path | None = None) -> Profile:
    """Read and check a register profile.

    Parameters
    ----------
    name : str
        A shipped profile's name (``ring``), or the path of a TOML file (it ends in ``.toml``).
    folder : Path, optional
        Folder that a relative path starts from; the working directory without it.

    Raises
    ------
    BadInput
        If there is no such profile or it breaks the schema.
    """
    if name.endswith(".toml"):
        path = (folder or Path()) / name
    else:
        path = SHIPPED / f"{name}.toml"
        if not path.is_file():
            shipped = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.toml")))
            raise BadInput(
                f"there is no register profile “{name}”",
                remedy=f"shipped are: {shipped}; or give the path of a .toml file",
            )
    content = load_settings(path, ProfileFile)
    return Profile(
        content.profile,
        {register.name: register for register in content.register_},
        content.ring,
        content_hash(content.model_dump(mode="json", by_alias=True)),
    )
