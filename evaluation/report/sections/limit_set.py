"""The basis of the verdicts: the limit set with its identity, and the inspector's checklist."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.report.content import DASH, Cell, Column, Sheet, Table, day_text
from bufferstand.evaluation.report.source import ReportSource, runs_text
from bufferstand.evaluation.wording import joined, numeral, said

_NOT_STATED = said("not stated in the evaluation document")
_SHEET = (
    (said("Standard"), "standard"),
    (said("Edition"), "edition"),
    (said("Clause"), "clause"),
    (said("Source of the numbers"), "source"),
    (said("Date"), "date"),
)
_NOT_ON_RECORD = {
    "edition": said("not on record: the source of the numbers does not say of which edition they are"),
    "clause": said("not on record for the whole set; what is known stands beside each requirement"),
}
_RESULTS = {
    "in-order": Cell(said("✓ in order"), "good"),
    "defect": Cell(said("✗ defect"), "bad"),
    "fill-in": Cell(said("◇ not looked at"), "open"),
}

_READINGS: Mapping[str, str] = {
    "static_extent": said("static extent"),
    "absorbed_energy": said("absorbed energy"),
    "force_cap_crossing": said("crossing of the force cap"),
    "comparator": said("comparator"),
    "force_cycles": said("cycles of the force windows"),
    "preload": said("preload"),
    "rest": said("rest"),
    "block_contact": said("block contact"),
}
"""Readings of the standard, as a limit set names them, in words …"""
_CHOSEN: Mapping[str, str] = {
    "full-stroke": said("to full stroke"),
    "proof-load": said("to the proof load"),
    "same-stroke-limits": said("between the same limits of stroke"),
    "whole-cycle": said("whole cycle"),
    "first": said("first"),
    "last": said("last"),
    "all": said("all"),
    "at-least": said("at least"),
    "as-printed": said("as printed"),
    "extrapolated": said("extrapolated to stroke 0"),
    "at-0.5mm": said("force at 0.5 mm"),
    "exactly": said("exactly"),
    "flag": said("named in words"),
    "inconclusive": said("inconclusive"),
}
"""… and what can be chosen."""


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
    facts = [(said("Applied to"), Cell(runs_text(numbers)))]
    facts += [(name, _given(limits.get(key), _NOT_ON_RECORD.get(key, _NOT_STATED))) for name, key in _SHEET]
    facts.append(("SHA-256", Cell(str(limits["sha256"]), "code") if limits.get("sha256") else _given(None)))
    readings = limits.get("readings") or {}
    if readings:
        text = joined(
            "; ",
            (
                said("{what}: {value}", what=_READINGS.get(name, name), value=_CHOSEN.get(value, value))
                for name, value in readings.items()
            ),
        )
        facts.append((said("Readings of what is unclear"), Cell(text)))
    if unfilled := limits.get("unfilled"):
        facts.append(
            (
                said("Limits not filled in"),
                Cell(said("nothing is passed on them: {list}", list=joined(", ", unfilled))),
            )
        )
    return Sheet(said("Limit set {what}", what=limits.get("id") or DASH), tuple(facts))


def _given(value: object, why: str = _NOT_STATED) -> Cell:
    return Cell(day_text(value)) if value else Cell(DASH, "missing", why)


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
        said("Inspection"),
        (
            (said("Goes with"), Cell(runs_text(numbers))),
            (said("Specimen"), _given(facts.get("specimen"))),
            (said("Inspector"), _given(facts.get("inspector"))),
            (said("Date"), _given(facts.get("date"))),
            (said("Assembled length"), _length(facts.get("assembled_length_mm"))),
            (said("Final length"), _length(facts.get("final_length_mm"))),
            (said("U of a length (k = 2)"), _length(facts.get("length_expanded_uncertainty_mm"))),
            ("SHA-256", Cell(str(inspection.get("sha256") or DASH), "code")),
        ),
    )


def _length(value: object) -> Cell:
    if isinstance(value, int | float):
        return Cell(said("{value} mm", value=numeral(f"{value:g}")))
    return Cell(DASH, "missing", said("not filled in by the inspector"))


def _checklist(items: list[Mapping[str, Any]], asked: Mapping[str, str]) -> Table:
    return Table(
        said("Visual inspection"),
        (
            Column(said("Item")),
            Column(said("Inspection point")),
            Column(said("Result")),
            Column(said("Note")),
        ),
        tuple(
            (
                Cell(str(item.get("id")), "code"),
                Cell(asked.get(str(item.get("id"))) or said("not asked for by the limit set of these runs")),
                _RESULTS.get(str(item.get("result")), Cell(str(item.get("result")))),
                Cell(str(item.get("note") or "")),
            )
            for item in items
        ),
    )
