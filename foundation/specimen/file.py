"""What is tested: the facts of a buffer or draw gear and of its test, as users write them in a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from bufferstand.foundation.run_kinds import Kind
from bufferstand.foundation.run_purposes import Purpose
from bufferstand.foundation.settings import Moment, Settings, Within, load_settings
from bufferstand.foundation.specimen.maker_data import Catalogue


class Specimen(Settings):
    """A buffer or draw gear. Lengths in mm; stroke 0 is first contact, compression positive."""

    id: str = Field(min_length=1)
    kind: Literal["buffer", "draw-gear"] = "buffer"
    category: Literal["A", "B", "C"] | None = None
    max_stroke_mm: (
        Annotated[float, Field(gt=0), Within(1.0, 1000.0, "no buffer or draw gear has less, or 1 m")] | None
    ) = None
    elastic_system: Literal["elastomer", "rubber-steel", "ring-spring"] | None = None
    assembled: Moment | None = None
    maker: str = ""
    serial: str = ""
    year: Annotated[int, Within(1800, 2200, "railways are not older, and nobody tests the future")] | None = (
        None
    )
    customer: str = ""
    description: str = ""
    model: str | None = None
    """Path of the spring model (TOML), relative to the specimen file."""


class Test(Settings):
    """How a foreign record was made, as far as it is known."""

    kind: Kind | None = None
    proof_load: str | None = None
    """Of a proof run: which of the limit set's proof loads was applied (F1 …)."""
    purpose: Purpose | None = None
    """Whether the record is a conformity test of its specimen."""
    impact_speed_km_h: (
        Annotated[float, Field(gt=0), Within(0.1, 100.0, "no wagon is run against buffers faster")] | None
    ) = None
    """Of an impact: speed of the wagon that ran up."""
    impact_mass_t: Annotated[float, Field(gt=0), Within(0.01, 1000.0, "no wagon weighs 1000 t")] | None = None
    """Of an impact: mass of that wagon."""
    started: Moment | None = None
    operator: str = ""
    laboratory: str = ""
    note: str = ""


class SpecimenFile(Settings):
    """A specimen file: ``[specimen]``; ``[catalogue]`` if it has no spring model; ``[test]`` for imports."""

    specimen: Specimen
    catalogue: Catalogue | None = None
    test: Test = Test()


def load_specimen(path: Path) -> SpecimenFile:
    """Read a specimen file.

    Raises
    ------
    BadInput
        If the file cannot be read or breaks the schema.
    """
    return load_settings(path, SpecimenFile)
