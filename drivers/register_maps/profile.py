"""Register maps as data: schema and checks of ``profiles/*.toml``.

Driver and simulated device read the same profile, so that neither can disagree with the documentation.
Addresses are 0-based wire addresses, each table from 0 on.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from bufferstand.drivers.register_maps.coding import (
    WORDS,
    Layout,
    RegisterPlace,
    RegisterType,
    WordOrder,
    encode_value,
    from_wire,
    to_wire,
)
from bufferstand.drivers.register_maps.sampled_channels import (
    REQUIRED_CHANNELS,
    hole_in_strokes,
    missing_channels,
    quantity_of,
    unknown_name,
)
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import content_hash
from bufferstand.foundation.settings import COUNTS, SCALE, Settings, WrongKeyError, parse_settings, read_text

SHIPPED = Path(__file__).parent / "profiles"
"""Folder of the profiles that come with the software."""

MAX_READ = 125
"""Registers that one Modbus read (FC3, FC4, FC23) can carry (Modbus application protocol 1.1b3, 6.3)."""

IDENTITY = ("device_type", "profile_version", "test_float", "test_integer", "serial", "sample_rate")
"""Registers read at connect, in one transaction."""
STATUS = (
    *("status_word", "state", "fault_code", "echo_sequence", "reject_code", "done_sequence", "cycles_done"),
    *("heartbeat", "watchdog_remaining", "watchdog_trips", "end_reason", "force", "stroke", "position"),
    *("command", "tick", "request_echo", "status_check"),
)
"""Registers of one snapshot, read in one transaction."""
COMMAND = (
    *("command_sequence", "command_code", "target", "speed", "mean", "amplitude", "frequency", "cycles"),
    *("turning_force", "turning_stroke", "static_pause"),
)
"""Registers of one command, written in one transaction."""
LIMITS = ("force_limit", "stroke_limit")
"""Limits of the device, written in one transaction."""
CONTROL = ("execute", "control_word", "watchdog_feed", "watchdog_time")
"""Registers written one by one."""
WATCHDOG_LEFT = "watchdog_remaining"
_OPTIONAL = frozenset((WATCHDOG_LEFT, "request_echo", "status_check"))

COMMON_REGISTERS: Mapping[str, str] = {
    **{name: "r" for name in (*IDENTITY, *STATUS) if name not in {*_OPTIONAL, "sample_rate", "tick"}},
    **dict.fromkeys((*COMMAND, *CONTROL, *LIMITS), "rw"),
}
"""Registers that every controller must have, and the access to each."""

RING_REGISTERS: Mapping[str, str] = {
    **COMMON_REGISTERS,
    **dict.fromkeys(("sample_rate", WATCHDOG_LEFT, "tick"), "r"),
    "ring_acknowledge": "rw",
}
"""Registers that a controller with a sample ring must have."""

POLLED_REGISTERS: Mapping[str, str] = {
    **COMMON_REGISTERS,
    **{f"raw_{name}": "r" for name in REQUIRED_CHANNELS},
}
"""Registers that a controller without a ring must have: ``raw_…`` are the counts of each channel. One that
samples further channels has such a register of each."""

SIMULATED = "simulated"
"""Register by which a simulated controller says that it is one."""
SIMULATED_SIGN = 0x5349
"""What it holds then (“SI”). Whatever else is there is a real controller's: 1 could be anything."""

OPTIONAL_REGISTERS: Mapping[str, str] = {
    **dict.fromkeys((*_OPTIONAL, "sample_rate", "tick", SIMULATED), "r"),
    **dict.fromkeys(("request_number", "writer"), "rw"),
}
"""Registers that a controller may have."""

CHECK = "check"
"""Field of a ring's header with the block's CRC-32."""
ASKED = "asked"
"""Field of a ring's header that repeats the acknowledged sequence."""


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


class ProfileRegister(Settings):
    """One named value of the map."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$", description="small letters, digits and _")
    address: int = Field(ge=0, le=0xFFFF)
    type: RegisterType
    access: Literal["r", "rw"]
    table: Literal["holding", "input"] = "holding"
    """Holding registers (FC3, FC6, FC16, FC23), or input registers (FC4)."""
    word_order: WordOrder | None = None
    """Its own, where it differs from the profile's."""
    scale: Annotated[float, Field(gt=0), SCALE] = 1.0
    """Units per count."""
    unit: str = ""
    expect: Annotated[float | int, COUNTS] | None = None
    """What it must hold at connect, where it is a test value."""
    accept: Annotated[tuple[int, ...], BeforeValidator(_as_tuple), COUNTS] = ()
    """What it may hold instead: a device of an earlier edition that this map fits, too."""
    description: str = ""

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return WORDS[self.type]

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what is not used, so that a map keeps its hash."""
        content: dict[str, Any] = handler(self)
        return content if self.accept else {k: v for k, v in content.items() if k != "accept"}

    @model_validator(mode="after")
    def _expected_fits(self) -> ProfileRegister:
        if self.expect is not None:
            encode_value(self.expect, self.type)
            if self.scale != 1.0:
                raise WrongKeyError(f"“{self.name}” has an expected value, so it can have no scale", "scale")
        if self.accept and (self.expect is None or self.type != "u16"):
            raise WrongKeyError(
                f"“{self.name}” accepts other values, so it must expect one and be u16", "expect"
            )
        for value in self.accept:
            encode_value(value, self.type)
        if self.table == "input" and self.access != "r":
            raise WrongKeyError(f"“{self.name}” lies in the input table, which cannot be written", "table")
        if self.address + self.words > 0x10000:
            raise WrongKeyError(f"“{self.name}” reaches beyond address 65535", "address")
        return self


def _split_field(value: object) -> object:
    """Turn ``name:type`` into a pair."""
    return tuple(value.split(":")) if isinstance(value, str) else value


_Field = Annotated[
    tuple[str, RegisterType],
    BeforeValidator(_split_field, json_schema_input_type=Annotated[str, Field(pattern=r"^\w+:\w+$")]),
]
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
                raise WrongKeyError(f"the ring's header lacks “{name}”", "header")
        if CHECK in header and self.header[-1] != (CHECK, "u32"):
            raise WrongKeyError("“check:u32” must be the last of the ring's header", "header")
        if ASKED in header and (ASKED, "u32") not in self.header:
            raise WrongKeyError("“asked” must be u32", "header")
        if ("tick", "u32") not in self.sample:
            raise WrongKeyError("a sample of the ring lacks “tick:u32”", "sample")
        _demand_channels([name for name, _ in self.sample if name != "tick"], "ring.sample", "sample")
        if self.samples_per_block < 1:
            raise WrongKeyError(f"not one sample fits in {self.registers} registers", "sample", "registers")
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


class Poll(Settings):
    """How a controller without a ring is sampled: each group of channels is one read of their registers."""

    rate_Hz: float = Field(gt=0, le=1000)
    """Polls a second, by the computer's clock."""
    reads: Annotated[
        tuple[Annotated[tuple[str, ...], BeforeValidator(_as_tuple)], ...], BeforeValidator(_as_tuple)
    ]
    """Channels of each read, in the order of reading."""
    description: str = ""

    @model_validator(mode="after")
    def _each_once(self) -> Poll:
        names = [name for read in self.reads for name in read]
        _demand_channels(names, "poll.reads", "reads")
        return self


def _demand_channels(names: Sequence[str], where: str, key: str) -> None:
    """See that what is sampled are channels of a controller, each once, and those that must be there."""
    twice = [name for number, name in enumerate(names) if name in names[:number]]
    if twice or missing_channels(names):
        listed = ", ".join(REQUIRED_CHANNELS)
        raise WrongKeyError(f"{where} must name each of {listed} exactly once, others at most once", key)
    for name in names:
        if quantity_of(name) is None:
            raise WrongKeyError(unknown_name(name), key)
    if problem := hole_in_strokes(names):
        raise WrongKeyError(problem, key)


class WireFacts(Settings):
    """What the controller's Modbus server can do."""

    read_write: bool = True
    """Whether it knows function 23; without it registers are written, then read (FC16, FC3)."""


class ProfileFacts(Settings):
    """Which register map it is."""

    id: str = Field(min_length=1)
    edition: str
    word_order: WordOrder
    adjust_from: Annotated[int, Field(ge=0), COUNTS] | None = None
    """Least ``profile_version`` of a device that takes command 6 (adjust); None: none does."""
    description: str = ""

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what is not stated, so that a map keeps its hash."""
        content: dict[str, Any] = handler(self)
        return {key: value for key, value in content.items() if value is not None}


class ProfileFile(Settings):
    """A profile's TOML file."""

    profile: ProfileFacts
    register_: Annotated[tuple[ProfileRegister, ...], BeforeValidator(_as_tuple)] = Field(alias="register")
    ring: Ring | None = None
    poll: Poll | None = None
    wire: WireFacts | None = None

    @model_validator(mode="after")
    def _one_way(self) -> ProfileFile:
        if (self.ring is None) == (self.poll is None):
            raise WrongKeyError("a profile has either a table [ring] or a table [poll]", "ring", "poll")
        return self

    @model_validator(mode="after")
    def _apart(self) -> ProfileFile:
        names = [register.name for register in self.register_]
        for name in names:
            if names.count(name) > 1:
                raise WrongKeyError(f"register “{name}” is there twice", "register")
        spans = [(r.table, r.address, r.address + r.words, f"“{r.name}”") for r in self.register_]
        if self.ring is not None:
            end = self.ring.address + self.ring.registers
            spans.append(("holding", self.ring.address, end, "the ring's window"))
        for (table, _, end, first), (other, start, _, second) in pairwise(sorted(spans)):
            if table == other and start < end:
                raise WrongKeyError(f"{first} and {second} overlap at address {start}", "register")
        return self

    @model_validator(mode="after")
    def _complete(self) -> ProfileFile:
        by_name = {register.name: register for register in self.register_}
        needed = dict(RING_REGISTERS if self.poll is None else POLLED_REGISTERS)
        polled = [] if self.poll is None else [name for read in self.poll.reads for name in read]
        needed |= {f"raw_{name}": "r" for name in polled}
        for name, access in needed.items():
            if name not in by_name:
                raise WrongKeyError(f"register “{name}” is missing", "register")
            if access == "rw" and by_name[name].access != "rw":
                raise WrongKeyError(f"register “{name}” must have access “rw”", "register")
        for name in ("request_number", "writer"):
            if name in by_name and by_name[name].access != "rw":
                raise WrongKeyError(f"register “{name}” must have access “rw”", "register")
        if ("request_number" in by_name) != ("request_echo" in by_name):
            raise WrongKeyError("“request_number” and “request_echo” need each other", "register")
        blocks = [IDENTITY, STATUS, COMMAND, LIMITS]
        if self.poll is not None:
            for name in polled:
                if by_name[f"raw_{name}"].scale != 1.0:
                    raise WrongKeyError(
                        f"“raw_{name}” can have no scale: the channel's calibration has it", "register"
                    )
            blocks += [tuple(f"raw_{name}" for name in read) for read in self.poll.reads]
        for names in blocks:
            self._demand_block([by_name[name] for name in names if name in by_name])
        return self

    def _demand_block(self, members: Sequence[ProfileRegister]) -> None:
        """See that registers go in one transaction: one table, no hole, not too many."""
        first = min(members, key=lambda r: r.address)
        last = max(members, key=lambda r: r.address)
        what = f"“{first.name}” to “{last.name}”"
        if {r.table for r in members} != {first.table}:
            raise WrongKeyError(f"{what} must lie in one table", "register")
        start, end = first.address, last.address + last.words
        if end - start > MAX_READ:
            raise WrongKeyError(f"{what} do not fit one transaction of {MAX_READ} registers", "register")
        if sum(r.words for r in members) != end - start:
            raise WrongKeyError(f"{what} must follow each other without a hole", "register")


@dataclass(frozen=True)
class Profile:
    """A checked register map.

    Parameters
    ----------
    facts : ProfileFacts
        Id, edition, word order.
    registers : mapping of str to Register
        By name, in the file's order.
    window : Ring or None
        The sample ring's window, if the controller has one.
    poll : Poll or None
        How it is sampled, if it has none.
    hash : str
        SHA-256 of the content, for the run file.
    read_write : bool
        Whether the controller knows function 23.
    """

    facts: ProfileFacts
    registers: Mapping[str, ProfileRegister]
    window: Ring | None
    poll: Poll | None
    hash: str
    read_write: bool = True

    @property
    def ring(self) -> Ring:
        """The sample ring's window.

        Raises
        ------
        ValueError
            If the controller has none.
        """
        if self.window is None:
            raise ValueError(f"profile “{self.facts.id}” has no sample ring")
        return self.window

    @cached_property
    def sampled(self) -> Mapping[str, RegisterType]:
        """The channels that are sampled, in their order, and the type of each one's counts."""
        if self.window is not None:
            return {name: kind for name, kind in self.window.sample if name != "tick"}
        names = [] if self.poll is None else [name for read in self.poll.reads for name in read]
        return {name: self.find(f"raw_{name}").type for name in names}

    @property
    def word_order(self) -> str:
        """``big`` or ``little``."""
        return self.facts.word_order

    @property
    def version(self) -> float:
        """The ``profile_version`` that a device of this map itself shows; 0 where none is expected."""
        return self.find("profile_version").expect or 0

    def adjusts(self, version: float) -> bool:
        """Return whether a device that shows this ``profile_version`` can change a running sine."""
        return self.facts.adjust_from is not None and version >= self.facts.adjust_from

    def has(self, name: str) -> bool:
        """Return whether the map has a register of that name."""
        return name in self.registers

    def find(self, name: str) -> ProfileRegister:
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
        register = self.find(name)
        return to_wire(value, register.type, register.word_order or self.word_order, register.scale)

    def decode(self, name: str, registers: Sequence[int]) -> float | int:
        """Return the value of register ``name`` from its words.

        Raises
        ------
        KeyError, ValueError
            If there is no such register, or the number of words is not its own.
        """
        register = self.find(name)
        return from_wire(registers, register.type, register.word_order or self.word_order, register.scale)

    def block(self, first: str, last: str) -> Layout:
        """Return the window from register ``first`` to register ``last``, both included.

        Raises
        ------
        KeyError
            If there is no such register.
        """
        table, start = self.find(first).table, self.find(first).address
        end = self.find(last).address + self.find(last).words
        inside = sorted(
            (r for r in self.registers.values() if r.table == table and start <= r.address < end),
            key=lambda r: r.address,
        )
        places = tuple(
            RegisterPlace(r.name, r.type, r.address - start, r.scale, r.word_order or "") for r in inside
        )
        return Layout(start, end - start, places, self.word_order, table)

    def span(self, names: Sequence[str]) -> Layout:
        """Return the window of those of ``names`` that the map has.

        Raises
        ------
        ValueError
            If it has none of them.
        """
        members = sorted((self.registers[n] for n in names if self.has(n)), key=lambda r: r.address)
        if not members:
            raise ValueError(f"the map has none of {', '.join(names)}")
        return self.block(members[0].name, members[-1].name)

    @property
    def ring_header(self) -> Layout:
        """The ring window's header."""
        return self._row(self.ring.address, self.ring.header)

    @property
    def ring_sample(self) -> Layout:
        """One sample of the ring."""
        return self._row(0, self.ring.sample)

    def _row(self, address: int, fields: Sequence[tuple[str, str]]) -> Layout:
        places: list[RegisterPlace] = []
        offset = 0
        for name, kind in fields:
            places.append(RegisterPlace(name, kind, offset))
            offset += WORDS[kind]
        return Layout(address, offset, tuple(places), self.word_order)


def load_profile(name: str, folder: Path | None = None) -> Profile:
    """Read and check a register profile.

    Parameters
    ----------
    name : str
        A shipped profile's name (``ring``, ``polling``), or the path of a TOML file (it ends in ``.toml``).
    folder : Path, optional
        Folder that a relative path starts from; the working directory without it.

    Raises
    ------
    BadInput
        If there is no such profile or it breaks the schema.
    """
    if name.endswith(".toml"):
        path = (folder or Path()) / name
        if not os.path.exists(path):  # noqa: PTH110 - also of a name that no file can have
            raise BadInput(f"there is no register profile {path}", remedy="mend the path")
    else:
        path = SHIPPED / f"{name}.toml"
        if not path.is_file():
            shipped = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.toml")))
            raise BadInput(
                f"there is no register profile “{name}”",
                remedy=f"shipped are: {shipped}; or give the path of a .toml file",
            )
    return _profile_of(path, read_text(path))


@lru_cache(maxsize=16)
def _profile_of(path: Path, text: str) -> Profile:
    """Return the profile that a text holds; a campaign asks for it a dozen times."""
    content = parse_settings(text, ProfileFile, path)
    as_data = content.model_dump(mode="json", by_alias=True)
    if content.wire is None:  # a profile without this table keeps the hash that it always had
        del as_data["wire"]
    return Profile(
        content.profile,
        {register.name: register for register in content.register_},
        content.ring,
        content.poll,
        content_hash(as_data),
        content.wire is None or content.wire.read_write,
    )
