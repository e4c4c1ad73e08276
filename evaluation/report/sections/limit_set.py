"""The basis of the verdicts: the limit set with its identity, and the inspector's checklist."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.report.content import DASH, Cell, Column, Sheet, Table
from bufferstand.evaluation.report.source import ReportSource, runs_text

_NOT_STATED = "not stated in the evaluation document"
_SHEET = (
    ("Standard", "standard"),
    ("Edition", "edition"),
    ("Clause", "clause"),
    ("Source of the numbers", "source"),
    ("Date", "date"),
)
_NOT_ON_RECORD = {
    "edition": "not on record: the source of the numbers does not say of which edition they are",
    "clause": "not on record for the whole set; what is known stands beside each requirement",
}
_RESULTS = {
    "in-order": Cell("✓ in order", "good"),
    "defect": Cell("✗ defect", "bad"),
    "fill-in": Cell("◇ not looked at", "open"),
}


def limit_set_sheets(source: ReportSource) -> list[Sheet]:
    """Return a fact sheet for each limit set that runs were judged by."""
    found: dict[str, tuple[Mapping[str, Any], list[int]]] = {}
    for run in source.runs:
        limits = run.evaluated.get("limit_set")
        if isinstance(limits, Mapping):
            found.setdefault(_key(limits), (limits, []))[1].append(run.number)
    return [_sheet(limits, numbers) for limits, numbers in found.values()]


def _key(facts: Mapping[str, Any]) -> str:
    return json.dumps(facts, sort_keys=True, default=str)


def _sheet(limits: Mapping[str, Any], numbers: list[int]) -> Sheet:
    facts = [("Applied to", Cell(runs_text(numbers)))]
    facts += [(name, _given(limits.get(key), _NOT_ON_RECORD.get(key, _NOT_STATED))) for name, key in _SHEET]
    facts.append(("SHA-256", Cell(str(limits["sha256"]), "code") if limits.get("sha256") else _given(None)))
    readings = limits.get("readings") or {}
    if readings:
        text = "; ".join(f"{name.replace('_', ' ')}: {value}" for name, value in readings.items())
        facts.append(("Readings of what is unclear", Cell(text)))
    if unfilled := limits.get("unfilled"):
        facts.append(("Limits not filled in", Cell(f"nothing is passed on them: {', '.join(unfilled)}")))
    return Sheet(f"Limit set {limits.get('id') or DASH}", tuple(facts))


def _given(value: object, why: str = _NOT_STATED) -> Cell:
    return Cell(str(value)) if value else Cell(DASH, "missing", why)


def inspection_blocks(source: ReportSource) -> list[Sheet | Table]:
    """Return each inspector's file that runs were judged by: who, when, lengths, and the checklist."""
    found: dict[str, tuple[Mapping[str, Any], list[int], dict[str, str]]] = {}
    for run in source.runs:
        inspection = run.evaluated.get("inspection")
        if isinstance(inspection, Mapping):
            _, numbers, asked = found.setdefault(_key(inspection), (inspection, [], {}))
            numbers.append(run.number)
            asked |= {str(r["id"]): str(r.get("requirement") or "") for r in run.requirements}
    blocks: list[Sheet | Table] = []
    for inspection, numbers, asked in found.values():
        blocks.append(_inspected(inspection, numbers))
        if items := inspection.get("item") or []:
            blocks.append(_checklist(items, asked))
    return blocks


def _inspected(inspection: Mapping[str, Any], numbers: list[int]) -> Sheet:
    facts = inspection.get("inspection") or {}
    return Sheet(
        "Inspection",
        (
            ("Goes with", Cell(runs_text(numbers))),
            ("Specimen", _given(facts.get("specimen"))),
            ("Inspector", _given(facts.get("inspector"))),
            ("Date", _given(facts.get("date"))),
            ("Assembled length", _length(facts.get("assembled_length_mm"))),
            ("Final length", _length(facts.get("final_length_mm"))),
            ("U of a length (k = 2)", _length(facts.get("length_expanded_uncertainty_mm"))),
            ("SHA-256", Cell(str(inspection.get("sha256") or DASH), "code")),
        ),
    )


def _length(value: object) -> Cell:
    if isinstance(value, int | float):
        return Cell(f"{value:g} mm")
    return Cell(DASH, "missing", "not filled in by the inspector")


def _checklist(items: list[Mapping[str, Any]], asked: Mapping[str, str]) -> Table:
    return Table(
        "Visual inspection",
        (Column("Item"), Column("What was looked at"), Column("Result"), Column("Note")),
        tuple(
            (
                Cell(str(item.get("id")), "code"),
                Cell(asked.get(str(item.get("id"))) or "not asked for by the limit set of these runs"),
                _RESULTS.get(str(item.get("result")), Cell(str(item.get("result")))),
                Cell(str(item.get("note") or "")),
            )
            for item in items
        ),
    )
