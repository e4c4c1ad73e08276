"""Standard data sets as they lie on disk: ``GROUP/NAME`` with record.csv, record.toml and truth.json."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from bufferstand.foundation import BadInput, Kind
from bufferstand.foundation.files import content_hash, file_hash

SCHEMA = "bufferstand/validation-set/1"
RECORD, FACTS, MAPPING, TRUTH = "record.csv", "record.toml", "mapping.toml", "truth.json"
_STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

Place = Literal["summary", "cycle", "step", "requirement", "run"]


@dataclass(frozen=True, config=_STRICT)
class Where:
    """Where an agreed value stands in the entry of a run of the evaluation document.

    ``summary``: means over the cycles used. ``cycle`` and ``step``: number ``index``, from 1.
    ``requirement``: ``id`` and ``cycle`` (None where it concerns the run). ``run``: the run itself.
    """

    in_: Annotated[Place, Field(alias="in")]
    index: int | None = None
    id: str | None = None
    cycle: int | None = None

    @property
    def text(self) -> str:
        """The place in words."""
        if self.in_ == "requirement":
            return f"{self.id}" + ("" if self.cycle is None else f", cycle {self.cycle}")
        return f"{self.in_} {self.index}" if self.index is not None else self.in_


@dataclass(frozen=True, config=_STRICT)
class Agreed:
    """One agreed value: ``tolerance`` is absolute, in ``unit``; None for texts, which must be the same."""

    of: Where
    what: str
    value: Annotated[float | str, BeforeValidator(lambda v: float(v) if type(v) is int else v)]
    tolerance: float | None
    unit: str
    source: str


@dataclass(frozen=True, config=_STRICT)
class _Options:
    """How the record is to be read and judged: options of ``import`` and ``evaluate`` by their names."""

    column: dict[str, str] | None = None
    invert: list[str] | None = None
    sample_rate_Hz: float | None = None
    decision_rule: Literal["simple", "guard-band"] | None = None


@dataclass(frozen=True, config=_STRICT)
class AgreedTruth:
    """What is agreed of a record (``truth.json``)."""

    schema: Literal["bufferstand/validation-set/1"]
    id: str
    title: str
    about: str
    kind: Kind
    options: _Options
    agreed: list[Agreed]


_TRUTH = TypeAdapter(AgreedTruth)


@dataclass(frozen=True)
class StandardSet:
    """A standard data set: its folder and what is agreed of its record."""

    folder: Path
    truth: AgreedTruth

    @property
    def id(self) -> str:
        """``GROUP/NAME``."""
        return self.truth.id

    @property
    def mapping(self) -> Path | None:
        """Its mapping file, if there is one."""
        path = self.folder / MAPPING
        return path if path.is_file() else None

    def hashes(self) -> Mapping[str, str]:
        """Return the SHA-256 of each of its files by name."""
        names = (RECORD, FACTS, MAPPING, TRUTH)
        return {name: file_hash(path) for name in names if (path := self.folder / name).is_file()}


def shipped_sets() -> list[StandardSet]:
    """Return the sets that this installation ships, in the order of their ids."""
    return load_sets(Path(str(files("bufferstand.evaluation.validation").joinpath("sets"))))


def load_sets(folder: Path) -> list[StandardSet]:
    """Return every set below a folder, in the order of their ids.

    Raises
    ------
    BadInput
        If there is none, a truth file breaks the schema, or a record is missing.
    """
    found = sorted(folder.rglob(TRUTH))
    if not found:
        raise BadInput(
            f"holds no standard data set (no {TRUTH} below it)",
            file=folder,
            remedy="name a folder of sets, or leave the option out for those that are shipped",
        )
    return [_load(path) for path in found]


def _load(path: Path) -> StandardSet:
    try:
        truth = _TRUTH.validate_json(path.read_bytes())
    except (OSError, ValueError) as error:
        raise _refused(path, error) from None
    if not (path.parent / RECORD).is_file():
        raise BadInput(f"the set has no {RECORD}", file=path.parent, remedy="copy the set again, whole")
    return StandardSet(path.parent, truth)


def _refused(path: Path, error: Exception) -> BadInput:
    remedy = "copy the set again, whole; docs/validation.md describes the file"
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return BadInput(first["msg"], file=path, place=".".join(map(str, first["loc"])), remedy=remedy)
    if isinstance(error, OSError):
        return BadInput(f"cannot be read: {error.strerror or error}", file=path, remedy=remedy)
    return BadInput(f"is no truth file: {error}", file=path, remedy=remedy)


def hash_of_sets(sets: list[StandardSet]) -> str:
    """Return one hash for the content of all sets."""
    content: dict[str, Any] = {one.id: dict(one.hashes()) for one in sets}
    return content_hash(content)
