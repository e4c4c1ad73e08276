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
    """The laboratory's name for this one specimen. Runs are gathered by it, and the operator types it
    before a stand moves.
    """
    kind: Literal["buffer", "draw-gear"] = "buffer"
    """``"buffer"`` or ``"draw-gear"``."""
    category: Literal["A", "B", "C"] | None = None
    """``"A"``, ``"B"`` or ``"C"`` of EN 15551: which limits are applied."""
    max_stroke_mm: (
        Annotated[float, Field(gt=0), Within(1.0, 1000.0, "no buffer or draw gear has less, or 1 m")] | None
    ) = None
    """Full stroke. No step may go further, and the limits at full stroke need it [mm]."""
    elastic_system: Literal["elastomer", "rubber-steel", "ring-spring"] | None = None
    """``"elastomer"``, ``"rubber-steel"`` or ``"ring-spring"``: whether heat destroys it (the temperature
    stop), and which limits are applied.
    """
    assembled: Moment | None = None
    """When it was put together, such as ``2026-01-12T08:00:00Z``: a static test asks for a rest after that.
    Without a zone it is UTC.
    """
    maker: str = ""
    """Printed in the report."""
    serial: str = ""
    """Printed in the report."""
    year: Annotated[int, Within(1800, 2200, "railways are not older, and nobody tests the future")] | None = (
        None
    )
    """Printed in the report."""
    customer: str = ""
    """Printed in the report."""
    description: str = ""
    """Printed in the report."""
    model: str | None = None
    """Path of the spring model, from the folder of this file. Plan and guards expect force and heat by it.
    """


class Test(Settings):
    """How a foreign record was made, as far as it is known."""

    kind: Kind | None = None
    """Kind of run, as ``import --kind``. Default: from the record."""
    proof_load: str | None = None
    """Of a proof run: which proof load of the limit set was applied (``"F1"`` …)."""
    purpose: Purpose | None = None
    """``"conformity"`` or ``"characterisation"``: which run is judged."""
    impact_speed_km_h: (
        Annotated[float, Field(gt=0), Within(0.1, 100.0, "no wagon is run against buffers faster")] | None
    ) = None
    """Of an impact: speed of the wagon that ran up [km/h]."""
    impact_mass_t: Annotated[float, Field(gt=0), Within(0.01, 1000.0, "no wagon weighs 1000 t")] | None = None
    """Of an impact: its mass [t]."""
    started: Moment | None = None
    """When the record begins. Default: from the record."""
    operator: str = ""
    """Kept in the run file."""
    laboratory: str = ""
    """Kept in the run file."""
    note: str = ""
    """Kept in the run file."""


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
