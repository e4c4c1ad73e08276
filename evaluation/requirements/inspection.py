"""What an inspector saw and measured by hand, as a file that he fills: the recorded checklist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from bufferstand.evaluation.results import RunFacts
from bufferstand.foundation.canonical import content_hash
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings import Day, Settings, load_settings

Length = Annotated[float, Field(gt=0)] | Literal["fill-in"]


class Inspected(Settings):
    """Who inspected which specimen and when, and the lengths read by hand."""

    specimen: str = Field(min_length=1)
    run: str = ""
    """Id of the one run that it belongs to; empty: every run of the specimen."""
    inspector: str = Field(min_length=1)
    date: Day
    assembled_length_mm: Length = "fill-in"
    final_length_mm: Length = "fill-in"
    length_expanded_uncertainty_mm: Annotated[float, Field(ge=0)] | Literal["fill-in"] = "fill-in"
    """U (k = 2) of a length read by hand."""


class Finding(Settings):
    """One item of the checklist; ``fill-in``: not looked at."""

    id: str = Field(min_length=1)
    result: Literal["in-order", "defect", "fill-in"]
    note: str = ""


class Inspection(Settings):
    """An inspector's file."""

    inspection: Inspected
    item: Annotated[
        tuple[Finding, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
    ] = ()

    def finding(self, identity: str) -> Finding | None:
        """Return what was found on an item; None where the file has nothing on it."""
        return next((item for item in self.item if item.id == identity), None)

    def record(self) -> dict[str, Any]:
        """Return the whole file with its hash, for the evaluation document."""
        content = self.model_dump(mode="json")
        return {**content, "sha256": content_hash(content)}


def load_inspection(path: Path, known_items: Sequence[str]) -> Inspection:
    """Read an inspector's file.

    Parameters
    ----------
    path : Path
    known_items : sequence of str
        Items that the limit set asks for.

    Raises
    ------
    BadInput
        If the file cannot be read, breaks the schema, answers an item twice or one that is not asked for.
    """
    inspection = load_settings(path, Inspection)
    answered = [item.id for item in inspection.item]
    for identity in answered:
        if identity not in known_items:
            asked = ", ".join(known_items) or "nothing"
            remedy = f"the limit set asks for: {asked}; take the item out, or name its set with --limits"
            raise BadInput(f"unknown item “{identity}”", file=path, place="item", remedy=remedy)
        if answered.count(identity) > 1:
            raise BadInput(
                f"item “{identity}” is answered twice", file=path, place="item", remedy="answer it once"
            )
    return inspection


def unused(inspections: Sequence[Inspection], runs: Sequence[Mapping[str, Any]]) -> list[Inspection]:
    """Return the inspections that belong to none of the runs; ``runs``: ``run`` of each document entry."""
    return [
        one
        for one in inspections
        if not any(
            run["specimen"].get("id") == one.inspection.specimen and one.inspection.run in ("", run["id"])
            for run in runs
        )
    ]


def inspection_of(facts: RunFacts, inspections: Sequence[Inspection]) -> Inspection | None:
    """Return the inspection that belongs to a run: one of that very run before one of its specimen."""
    mine = [i for i in inspections if i.inspection.specimen == facts.specimen.get("id")]
    for wanted in (facts.id, ""):
        for candidate in mine:
            if candidate.inspection.run == wanted:
                return candidate
    return None
