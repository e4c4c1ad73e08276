"""Register maps as data: schema and checks of ``profiles/*.toml``.

Driver and simulated device read the same profile, so that neither can disagree with the documentation.
Addresses are 0-based wire addresses in the holding table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from drivers.registers import (
    WORDS,
    Layout,
    Place,
    RegisterType,
    WordOrder,
    decode_value,
    encode_value,
)
from foundation.canonical import content_hash
from foundation.errors import BadInput
from foundation.settings import Settings, load_settings

SHIPPED = Path(__file__).parent / "profiles"
"""Folder of the profiles that come with the software."""

MAX_READ = 125
"""Registers that one Modbus read (FC3, FC4, FC23) can carry (Modbus application protocol 1.1b3, 6.3)."""

RING_REGISTERS: Mapping[str, str] = {
    **dict.fromkeys(("device_type", "profile_version", "test_float", "test_integer", "serial"), "r"),
    **dict.fromkeys(("sample_rate", "status_word", "state", "fault_code", "echo_sequence"), "r"),
    **dict.fromkeys(("reject_code", "done_sequence", "cycles_done", "heartbeat", "watchdog_remaining"), "r"),
    **dict.fromkeys(("watchdog_trips", "end_reason", "force", "stroke", "position", "command", "tick"), "r"),
    **dict.fromkeys(("command_sequence", "command_code", "target", "speed", "mean", "amplitude"), "rw"),
    **dict.fromkeys(("frequency", "cycles", "turning_force", "turning_stroke", "static_pause"), "rw"),
    **dict.fromkeys(("execute", "control_word", "watchdog_feed", "watchdog_time", "force_limit"), "rw"),
    **dict.fromkeys(("stroke_limit", "ring_acknowledge"), "rw"),
}
"""Registers that a controller with a sample ring must have, and the access to each."""

_BLOCKS = (
    ("device_type", "sample_rate"),
    ("status_word", "tick"),
    ("command_sequence", "static_pause"),
    ("force_limit", "stroke_limit"),
)
"""Registers that go in one transaction."""


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

    @model_validator(mode="after")
    def _complete(self) -> ProfileFile:
        by_name = {register.name: register for register in self.register_}
        for name, access in RING_REGISTERS.items():
            if name not in by_name:
                raise ValueError(f"register “{name}” is missing")
            if access == "rw" and by_name[name].access != "rw":
                raise ValueError(f"register “{name}” must have access “rw”")
        for first, last in _BLOCKS:
            start, end = by_name[first].address, by_name[last].address + by_name[last].words
            if not 0 < end - start <= MAX_READ:
                raise ValueError(f"“{first}” to “{last}” do not fit one transaction of {MAX_READ} registers")
            named = sum(r.words for r in self.register_ if start <= r.address < end)
            if named != end - start:
                raise ValueError(f"“{first}” to “{last}” must follow each other without a hole")
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
