"""An inspector's file: the recorded checklist and the lengths read by hand."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from bufferstand.foundation.files import content_hash
from bufferstand.foundation.settings import LENGTH_MM, Day, Settings

Length = Annotated[Annotated[float, Field(gt=0)] | Literal["fill-in"], LENGTH_MM]


class InspectionHead(Settings):
    """Who inspected which specimen and when, and the lengths read by hand."""

    specimen: str = Field(min_length=1)
    run: str = ""
    """Id of the one run that it belongs to; empty: every run of the specimen."""
    inspector: str = Field(min_length=1)
    date: Day
    assembled_length_mm: Length = "fill-in"
    final_length_mm: Length = "fill-in"
    length_expanded_uncertainty_mm: Annotated[
        Annotated[float, Field(ge=0)] | Literal["fill-in"], LENGTH_MM
    ] = "fill-in"
    """U (k = 2) of a length read by hand."""


class InspectionFinding(Settings):
    """One item of the checklist; ``fill-in``: not looked at."""

    id: str = Field(min_length=1)
    result: Literal["in-order", "defect", "fill-in"]
    note: str = ""


class Inspection(Settings):
    """An inspector's file."""

    inspection: InspectionHead
    item: Annotated[
        tuple[InspectionFinding, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
    ] = ()

    def finding(self, identity: str) -> InspectionFinding | None:
        """Return what was found on an item; None where the file has nothing on it."""
        return next((item for item in self.item if item.id == identity), None)

    def record(self) -> dict[str, Any]:
        """Return the whole file with its hash, for the evaluation document."""
        content = self.model_dump(mode="json")
        return {**content, "sha256": content_hash(content)}
