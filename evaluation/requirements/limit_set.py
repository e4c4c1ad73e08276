"""Limits of a standard as data: revised editions and a laboratory's own sets are files, not code.

A limit is a number, ``"fill-in"`` (the standard has one that the set does not know) or ``"none"`` (the
standard has none). What is not filled in is never passed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, model_validator

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.quantities.temperature import READING_INTERVAL_S
from bufferstand.evaluation.requirements.readings import LimitSetReadings
from bufferstand.foundation import BadInput, Kind
from bufferstand.foundation.files import content_hash
from bufferstand.foundation.settings import (
    CYCLES,
    DURATION_S,
    ENERGY_J,
    FACTOR,
    FIGURE,
    FORCE_KN,
    LENGTH_MM,
    REST_H,
    SHARE,
    SIGNED_FORCE_KN,
    SPEED_KM_H,
    SPEED_MM_PER_S,
    TEMPERATURE_C,
    Day,
    Settings,
    WrongKeyError,
    load_settings,
)

FOLDER = Path(__file__).resolve().parent / "limit_sets"
SHIPPED = FOLDER / "en15551-105mm.toml"
"""The set that is applied unless another is given."""

Open = Literal["fill-in", "none"]
Limit = float | Open
_Positive = Annotated[float, Field(gt=0)] | Open
_NotNegative = Annotated[float, Field(ge=0)] | Open
Temperature = Annotated[Limit, TEMPERATURE_C]
Ratio = Annotated[Limit, SHARE]
Force = Annotated[Limit, SIGNED_FORCE_KN]
PositiveForce = Annotated[_Positive, FORCE_KN]
Length = Annotated[Limit, LENGTH_MM]
PositiveLength = Annotated[_Positive, LENGTH_MM]
LengthOrNone = Annotated[_NotNegative, LENGTH_MM]
Speed = Annotated[_Positive, SPEED_MM_PER_S]
Duration = Annotated[_NotNegative, DURATION_S]
Rest = Annotated[_NotNegative, REST_H]
Energy = Annotated[Limit, ENERGY_J]
Count = Annotated[Annotated[int, Field(ge=1)] | Open, CYCLES]
CONDITION_IDS = (
    "cycle-count", "rest-after-assembly", "temperature-range", "speed-limit", "pause-limit",
    "immediate-unloading", "full-release", "full-stroke",
)  # fmt: skip
"""Conditions of the static test."""
Identifier = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$", description="small letters, digits and -")]


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Names = Annotated[tuple[str, ...], BeforeValidator(_as_tuple)]


def known(limit: Limit) -> float | None:
    """Return a limit's number, or None where it is not filled in or there is none."""
    return None if isinstance(limit, str) else limit


class Cited(Settings):
    """Where a requirement stands: a clause of the standard's own text, or the source that it was taken from.

    ``clause`` is left empty where that text was not at hand; ``source`` says then which it was.
    What a section leaves empty is that of the set.
    """

    clause: str = ""
    source: str = ""


class Applies(Settings):
    """Which specimens a set is for; ``elastic_systems`` empty: all of them."""

    specimen: Literal["buffer", "draw-gear"]
    stroke_mm: PositiveLength
    stroke_tolerance_mm: LengthOrNone
    elastic_systems: Names = ()


class StaticTestConditions(Cited):
    """Conditions of the static test."""

    sources: dict[str, str] = Field(default_factory=dict)
    """By id of a condition: its source, where that is another than the section's."""
    temperature_min_C: Temperature
    temperature_max_C: Temperature
    speed_max_mm_per_s: Speed
    cycles: Count
    pause_max_s: Annotated[_Positive, DURATION_S]
    rest_min_h: Rest
    rest_systems: Names
    rest_tolerance_h: Rest = "fill-in"
    """Only for the reading ``rest = "exactly"``."""
    dwell_max_s: Duration
    residual_stroke_max_mm: LengthOrNone
    reading_interval_max_s: Annotated[float, Field(gt=0), DURATION_S] = READING_INTERVAL_S
    """How far readings of temperature may be from each other, and from start and end, to cover a cycle."""
    block_slope_ratio: Annotated[float, Field(gt=1), FACTOR] = 3.0
    """Block contact: slope of the last 1 % of the stroke over that just before it, and over the secant's."""


class ForceWindow(Cited):
    """A window of the force on the loading branch at a stroke; stroke 0 is the preload."""

    id: Identifier
    stroke_mm: LengthOrNone
    lower_kN: Force = "none"
    upper_kN: Force = "none"


class EnergyLimits(Cited):
    """Energies of the static test."""

    stored_min_J: Energy
    force_cap_kN: PositiveForce
    ratio_first_min: Ratio
    ratio_later_min: Ratio
    printed_greater: Names = ()
    """Keys of these limits that the source prints with “greater than”."""


class ImpactLimits(Cited):
    """Energies of the impact test, by category."""

    stored_min_J: dict[str, Energy]
    ratio_min: Ratio
    speed_max_km_h: Annotated[_Positive, SPEED_KM_H] = "none"
    """Up to this impact speed the energies are required."""
    printed_greater: Names = ()
    """Categories, or ``ratio_min``, that the source prints with “greater than”."""


class ProofLoad(Cited):
    """A load that the specimen must bear; the record names it as ``[test] proof_load``."""

    id: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9]*$", description="capitals and digits, e.g. “F1”")]
    text: str
    force_min_kN: PositiveForce
    permanent_deformation_max_mm: LengthOrNone
    cycles_min: Count = "none"
    serviceable: bool
    """Whether the inspector must state that the specimen is serviceable afterwards."""


class ProofLoads(Settings):
    """Proof loads, and up to which force the specimen counts as relieved."""

    relief_force_max_kN: Annotated[float, Field(ge=0), FORCE_KN]
    load: Annotated[tuple[ProofLoad, ...], BeforeValidator(_as_tuple)]


class Maintenance(Cited):
    """The check of a ring spring at overhaul: preload, and lengths as the spring is held at a force."""

    hold_force_kN: Annotated[float, Field(gt=0), FORCE_KN]
    preload_min_kN: Force
    preload_max_kN: Force
    assembled_length_min_mm: Length
    assembled_length_max_mm: Length
    length_at_hold_min_mm: Length
    length_at_hold_max_mm: Length
    final_length_min_mm: Length
    final_length_max_mm: Length


def _known_quantity(name: str) -> str:
    known_names = (*QUANTITIES.names, "speed_max_mm_per_s")
    if name not in known_names:
        raise ValueError(f"no quantity is called “{name}”; one of {', '.join(known_names)}")
    return name


QuantityName = Annotated[str, AfterValidator(_known_quantity)]
Range = Annotated[tuple[float, float], BeforeValidator(_as_tuple), FIGURE]


class QuantityLimit(Cited):
    """``[[requirement]]``: a limit on a quantity of runs of a kind."""

    id: Identifier
    quantity: QuantityName
    """Name of a quantity of a cycle (docs/symbols.md): its mean over the cycles used. An extreme of all
    samples, where it is one: ``force_max_kN``, ``stroke_max_mm``, ``temperature_max_C`` …"""
    kind: Kind
    """Of runs: ``static``, ``harmonic``, ``impact`` or ``proof``."""
    text: str = ""
    """What is required, in words; the name of the quantity where it is left out."""
    where: dict[QuantityName, Range] = Field(default_factory=dict)
    """Only of runs whose quantities lie in these ranges, e.g. ``{ frequency_Hz = [0.9, 1.1] }``."""
    lower: Annotated[Limit, FIGURE] = "none"
    upper: Annotated[Limit, FIGURE] = "none"


class InspectionItem(Cited):
    """Something that the inspector looks at."""

    id: Identifier
    text: str


_NO_CONDITIONS = StaticTestConditions(
    temperature_min_C="none",
    temperature_max_C="none",
    speed_max_mm_per_s="none",
    cycles="none",
    pause_max_s="none",
    rest_min_h="none",
    rest_systems=(),
    dwell_max_s="none",
    residual_stroke_max_mm="none",
)
_NO_ENERGY = EnergyLimits(
    stored_min_J="none", force_cap_kN="none", ratio_first_min="none", ratio_later_min="none"
)
_NO_IMPACT = ImpactLimits(stored_min_J={}, ratio_min="none")


class LimitSet(Settings):
    """A standard's limits with their identity. A section that is left out requires nothing."""

    id: str = Field(min_length=1)
    standard: str = Field(min_length=1)
    edition: str = ""
    """Empty where it is not known which edition the numbers are of."""
    clause: str = ""
    """For every section that states none of its own; empty where the text of the standard was not at hand."""
    date: Day
    source: str = Field(min_length=1)
    note: str = ""
    applies: Applies
    readings: LimitSetReadings = LimitSetReadings()
    conditions: StaticTestConditions = _NO_CONDITIONS
    force: Annotated[tuple[ForceWindow, ...], BeforeValidator(_as_tuple)] = ()
    energy: EnergyLimits = _NO_ENERGY
    impact: ImpactLimits = _NO_IMPACT
    proof: ProofLoads | None = None
    maintenance: Maintenance | None = None
    inspection: Annotated[tuple[InspectionItem, ...], BeforeValidator(_as_tuple)] = ()
    requirement: Annotated[tuple[QuantityLimit, ...], BeforeValidator(_as_tuple)] = ()

    @model_validator(mode="after")
    def _consistent(self) -> LimitSet:
        for what, names in (
            ("force", [window.id for window in self.force]),
            ("proof.load", [load.id for load in self.proof.load] if self.proof else []),
            ("inspection", [item.id for item in self.inspection]),
            ("requirement", [limit.id for limit in self.requirement]),
        ):
            twice = {name for name in names if names.count(name) > 1}
            if twice:
                raise WrongKeyError(
                    f"{what}: the id {sorted(twice)[0]} is given twice", tuple(what.split("."))
                )
        for table, what, lower, upper in self._windows():
            least, most = known(lower), known(upper)
            if least is not None and most is not None and least > most:
                raise WrongKeyError(
                    f"{what}: the lower limit {least:g} is above the upper one {most:g}", table
                )
        for name in self.conditions.sources:
            if name not in CONDITION_IDS:
                raise WrongKeyError(
                    f"conditions.sources: no condition “{name}”; one of {', '.join(CONDITION_IDS)}",
                    "conditions",
                )
        if self.readings.static_extent == "proof-load" and self.proof_load("F1") is None:
            raise WrongKeyError(
                "readings.static_extent is proof-load, but the set has no proof.load F1", "readings", "proof"
            )
        return self

    def _windows(self) -> Iterator[tuple[str, str, Limit, Limit]]:
        """Yield table, name, lower and upper limit of everything that has both."""
        conditions, maintenance = self.conditions, self.maintenance
        yield (
            "conditions",
            "conditions.temperature",
            conditions.temperature_min_C,
            conditions.temperature_max_C,
        )
        for window in self.force:
            yield "force", f"force {window.id}", window.lower_kN, window.upper_kN
        for limit in self.requirement:
            yield "requirement", f"requirement {limit.id}", limit.lower, limit.upper
        if maintenance is not None:
            for name in ("preload", "assembled_length", "length_at_hold", "final_length"):
                unit = "kN" if name == "preload" else "mm"
                lower, upper = (getattr(maintenance, f"{name}_{end}_{unit}") for end in ("min", "max"))
                yield "maintenance", f"maintenance.{name}", lower, upper

    def reference(self, cited: Cited | None = None, condition: str = "") -> tuple[str | None, str]:
        """Return clause and source of a requirement; the clause is None where none is on record.

        Parameters
        ----------
        cited : Cited, optional
            The section that states it.
        condition : str
            Id of a condition of the static test.
        """
        own = cited or Cited()
        source = self.conditions.sources.get(condition) or own.source or self.source
        return own.clause or self.clause or None, source

    @property
    def sha256(self) -> str:
        """Hash of the set's content, whatever its layout in the file."""
        unused = set() if self.requirement else {"requirement"}  # sets without it keep the hash they had
        return content_hash(self.model_dump(mode="json", exclude=unused))

    @property
    def unfilled(self) -> tuple[str, ...]:
        """Places of the limits that are still to be filled in, as ``energy.stored_min_J``.

        Those that no reading of the set needs are left out.
        """
        needless = () if self.readings.rest == "exactly" else ("conditions.rest_tolerance_h",)
        return tuple(place for place in _unfilled(self, "") if place not in needless)

    def identity(self) -> dict[str, Any]:
        """Return what a report must state of the limits applied."""
        return {
            "id": self.id,
            "standard": self.standard,
            "edition": self.edition or None,
            "clause": self.clause or None,
            "date": self.date.isoformat(),
            "source": self.source,
            "sha256": self.sha256,
            "readings": self.readings.model_dump(mode="json"),
            "unfilled": list(self.unfilled),
        }

    def covers(self, kind: Kind) -> bool:
        """Say whether the set requires anything of runs of a kind."""
        static = {"conditions", "force", "energy"} & self.model_fields_set
        covered = {
            "static": bool(static) or self.maintenance is not None or bool(self.inspection),
            "impact": "impact" in self.model_fields_set,
            "proof": self.proof is not None,
        }
        return covered.get(kind, False)

    def asks_of(self, kind: Kind) -> bool:
        """Say whether a ``[[requirement]]`` is of runs of a kind."""
        return any(limit.kind == kind for limit in self.requirement)

    def proof_load(self, name: str | None) -> ProofLoad | None:
        """Return a proof load by its id, or None."""
        loads = self.proof.load if self.proof else ()
        return next((load for load in loads if load.id == name), None)

    def why_not_for(self, specimen: Mapping[str, Any]) -> str:
        """Return why the set does not apply to a specimen, or nothing where it does.

        A specimen that says neither its kind nor its stroke is taken for one of the set's.
        """
        kind = specimen.get("kind") or self.applies.specimen
        if kind != self.applies.specimen:
            return f"limit set {self.id} is for a {self.applies.specimen}, the specimen is a {kind}"
        system, systems = specimen.get("elastic_system"), self.applies.elastic_systems
        if system is not None and systems and system not in systems:
            return f"limit set {self.id} is for {', '.join(systems)}, the specimen has {system}"
        stroke, nominal = specimen.get("max_stroke_mm"), known(self.applies.stroke_mm)
        if stroke is None or nominal is None:
            return ""
        if not 0.0 <= nominal - stroke <= (known(self.applies.stroke_tolerance_mm) or 0.0):
            return f"limit set {self.id} is for {nominal:g} mm stroke, the specimen has {stroke:g} mm"
        return ""


def _unfilled(value: object, place: str) -> Iterator[str]:
    if value == "fill-in":
        yield place
    elif isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from _unfilled(getattr(value, name), f"{place}.{name}" if place else name)
    elif isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _unfilled(inner, f"{place}.{name}")
    elif isinstance(value, tuple):
        for inner in value:
            identity = getattr(inner, "id", None)
            yield from _unfilled(inner, f"{place}.{identity}" if identity else place)


def load_limit_set(path: Path = SHIPPED) -> LimitSet:
    """Read a limit set.

    Raises
    ------
    BadInput
        If the file cannot be read or breaks the schema.
    """
    return load_settings(path, LimitSet)


def shipped_files() -> list[Path]:
    """Return the files of the shipped limit sets, to be copied."""
    return sorted(FOLDER.glob("*.toml"))


def shipped_names() -> list[str]:
    """Return the names of the sets that are shipped."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def find_limit_set(given: str) -> LimitSet:
    """Return the set that a user names: a file, or the name of one that is shipped.

    Raises
    ------
    BadInput
        If there is no such file and no such name, or as :func:`load_limit_set`.
    """
    if given in shipped_names():
        return load_limit_set(FOLDER / f"{given}.toml")
    if not Path(given).exists():
        names = ", ".join(shipped_names())
        raise BadInput(
            "no such limit set", file=given, remedy=f"name a TOML file, or one that is shipped: {names}"
        )
    return load_limit_set(Path(given))


@cache
def shipped_limit_set() -> LimitSet:
    """Return the shipped set, EN 15551 for 105 mm stroke."""
    return load_limit_set()
