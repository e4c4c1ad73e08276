"""What an inspector saw and measured by hand, as a file that he fills: the recorded checklist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bufferstand.evaluation.facts import Inspection, RunFacts
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import load_settings


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
