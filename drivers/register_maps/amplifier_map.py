"""Register maps of amplifiers as data: schema and checks of ``amplifier_maps/*.toml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, field_validator, model_validator

from bufferstand.drivers.register_maps.coding import WORDS, RegisterType, WordOrder, decode_value
from bufferstand.foundation.settings import Settings, WrongKeyError, load_shipped_or_own

SHIPPED_MAPS = Path(__file__).parent / "amplifier_maps"
"""Folder of the maps that come with the software."""
_MOST_REGISTERS = 125
_SATURATED = {"i16": (-(2**15), 2**15 - 1), "u16": (0, 2**16 - 1), "i32": (-(2**31), 2**31 - 1)}


class AmplifierRegister(Settings):
    """One value in registers."""

    address: int = Field(ge=0, le=65535)
    """0-based wire address."""
    type: RegisterType

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return WORDS[self.type]


class StatusRegister(AmplifierRegister):
    """A word whose bits say what is wrong."""

    bits: dict[str, str] = Field(min_length=1)
    """Meaning of each bit, by its number."""

    @field_validator("bits")
    @classmethod
    def _numbers(cls, bits: dict[str, str]) -> dict[str, str]:
        for bit in bits:
            if not bit.isdigit() or int(bit) > 31:
                raise ValueError(f"“{bit}” is no number of a bit (0 … 31)")
        return bits

    @model_validator(mode="after")
    def _whole(self) -> StatusRegister:
        if self.type == "f32":
            raise WrongKeyError("a status is no float", "type")
        return self


class IdentityRegister(AmplifierRegister):
    """A register that always holds the same."""

    expect: int | float


class AmplifierMap(Settings):
    """What lies where in an amplifier."""

    id: str = Field(min_length=1)
    edition: int = Field(default=1, ge=1)
    table: str = Field(default="input", pattern="^(input|holding)$", description="“input” or “holding”")
    word_order: WordOrder = "big"
    value: AmplifierRegister
    status: StatusRegister | None = None
    counter: AmplifierRegister | None = None
    rate: AmplifierRegister | None = None
    identity: IdentityRegister | None = None

    @model_validator(mode="after")
    def _fits(self) -> AmplifierMap:
        taken: dict[int, str] = {}
        for name in ("value", "status", "counter", "rate", "identity"):
            register = getattr(self, name)
            if register is None:
                continue
            for address in range(register.address, register.address + register.words):
                if address in taken:
                    raise WrongKeyError(
                        f"{name} and {taken[address]} overlap at address {address}", name, taken[address]
                    )
                taken[address] = name
        if self.counter is not None and self.counter.type not in {"u16", "u32"}:
            raise WrongKeyError("a counter must be u16 or u32", "counter")
        block = self.block
        if block.words > _MOST_REGISTERS:
            raise WrongKeyError(
                f"value, status and counter lie over {block.words} registers; one read carries "
                f"{_MOST_REGISTERS}, and only one read shows them of one instant",
                "value",
                "status",
                "counter",
            )
        return self

    @property
    def block(self) -> Block:
        """The registers that are read together for each value."""
        together = [register for register in (self.value, self.status, self.counter) if register is not None]
        first = min(register.address for register in together)
        end = max(register.address + register.words for register in together)
        return Block(first, end - first)

    @property
    def saturation(self) -> tuple[float, float] | None:
        """Raw values at which a whole-numbered value register is at its end."""
        return _SATURATED.get(self.value.type)


@dataclass(frozen=True)
class Block:
    """Registers that are read in one request."""

    first: int
    words: int

    def decode(self, registers: Sequence[int], register: AmplifierRegister, word_order: str) -> float | int:
        """Return one value of the block."""
        at = register.address - self.first
        return decode_value(registers[at : at + register.words], register.type, word_order)


def load_amplifier_map(name: str, folder: Path) -> AmplifierMap:
    """Return a register map by the name of a shipped one, or from a TOML file.

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
        AmplifierMap,
        folder=folder,
        shipped=SHIPPED_MAPS,
        what="there is no register map “{name}” for amplifiers",
        place="amplifier.modbus.map",
    )


def status_texts(status: int, bits: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what the bits of a status word say: a key for each that is set, and its words."""
    return [(f"bit {bit}", text) for bit, text in bits.items() if status >> int(bit) & 1]
