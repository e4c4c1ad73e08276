"""Limits of a standard as data: revised editions and a laboratory's own sets are files, not code."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from foundation.canonical import content_hash
from foundation.settings import Day, Settings, load_settings

SHIPPED = Path(__file__).resolve().parent.parent / "limit_sets" / "en15551-105mm.toml"
"""The set that is applied unless another is given."""

Names = Annotated[tuple[str, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]


class Applies(Settings):
    """Which specimens a set is for."""

    specimen: Literal["buffer", "draw-gear"]
    stroke_mm: float = Field(gt=0)
    stroke_tolerance_mm: float = Field(ge=0)


class Conditions(Settings):
    """Conditions of the static test."""

    clause: str = ""
    temperature_min_C: float
    temperature_max_C: float
    speed_max_mm_per_s: float = Field(gt=0)
    cycles: int = Field(ge=1)
    pause_max_s: float = Field(gt=0)
    rest_min_h: float = Field(ge=0)
    rest_systems: Names
    dwell_max_s: float = Field(ge=0)
    residual_stroke_max_mm: float = Field(ge=0)


class ForceWindow(Settings):
    """A window of the force on the loading branch at a stroke; stroke 0 is the preload."""

    id: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    clause: str = ""
    stroke_mm: float = Field(ge=0)
    lower_kN: float | None = None
    upper_kN: float | None = None


class EnergyLimits(Settings):
    """Energies of the static test."""

    clause: str = ""
    stored_min_J: float
    force_cap_kN: float = Field(gt=0)
    ratio_first_min: float
    ratio_later_min: float


class ImpactLimits(Settings):
    """Energies of the impact test, by category."""

    clause: str = ""
    stored_min_J: dict[str, float]
    ratio_min: float


class LimitSet(Settings):
    """A standard's limits with their identity."""

    id: str = Field(min_length=1)
    standard: str
    edition: str
    date: Day
    source: str
    note: str = ""
    applies: Applies
    conditions: Conditions
    force: Annotated[
        tuple[ForceWindow, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
    ]
    energy: EnergyLimits
    impact: ImpactLimits

    @property
    def sha256(self) -> str:
        """Hash of the set's content, whatever its layout in the file."""
        return content_hash(self.model_dump(mode="json"))

    def identity(self) -> dict[str, Any]:
        """Return what a report must state of the limits applied."""
        return {
            "id": self.id,
            "standard": self.standard,
            "edition": self.edition,
            "date": self.date.isoformat(),
            "source": self.source,
            "sha256": self.sha256,
        }

    def why_not_for(self, specimen: Mapping[str, Any]) -> str:
        """Return why the set does not apply to a specimen, or nothing where it does.

        A specimen that says neither its kind nor its stroke is taken for one of the set's.
        """
        kind = specimen.get("kind") or self.applies.specimen
        if kind != self.applies.specimen:
            return f"limit set {self.id} is for a {self.applies.specimen}, the specimen is a {kind}"
        stroke = specimen.get("max_stroke_mm")
        if stroke is None:
            return ""
        nominal = self.applies.stroke_mm
        if not 0.0 <= nominal - stroke <= self.applies.stroke_tolerance_mm:
            return f"limit set {self.id} is for {nominal:g} mm stroke, the specimen has {stroke:g} mm"
        return ""


def load_limit_set(path: Path = SHIPPED) -> LimitSet:
    """Read a limit set.

    Raises
    ------
    BadInput
        If the file cannot be read or breaks the schema.
    """
    return load_settings(path, LimitSet)


@cache
def shipped_limit_set() -> LimitSet:
    """Return the shipped set, EN 15551 for 105 mm stroke."""
    return load_limit_set()
