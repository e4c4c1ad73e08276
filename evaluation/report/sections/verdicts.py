"""Verdicts in words: the cell, the sentence that says why, and the table of what was required."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    Tone,
    VerdictLine,
    limits_text,
    measured_cell,
    probability_text,
    usable,
)
from bufferstand.evaluation.report.sections.limit_set import limit_set_sheets
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.evaluation.wording import joined, kind_words, numeral, said, said_count, verdict_words

_NAMES = {
    "preload": said("Preload"),
    "stored-energy": said("Stored energy"),
    "absorbed-energy-ratio": said("Absorbed / stored energy"),
    "temperature-range": said("Temperature of the test"),
    "speed-limit": said("Speed of the plunger"),
    "cycle-count": said("Number of cycles"),
    "pause-limit": said("Pause between cycles"),
    "rest-after-assembly": said("Rest after assembly"),
    "immediate-unloading": said("Unloading follows at once"),
    "full-release": said("Full release between cycles"),
    "full-stroke": said("Full stroke"),
    "impact-speed": said("Impact speed"),
    "stored-energy-category": said("Stored energy of the category"),
}
_FURTHER = {
    "permanent-deformation": said("Permanent deformation"),
    "serviceable-condition": said("Serviceable condition"),
}
"""Of proof loads, by a limit set of a maker's."""
_SYMBOLS: dict[str, tuple[str, Tone]] = {
    "pass": ("✓", "good"),
    "conditional-pass": ("(✓)", "good"),
    "conditional-fail": ("(✗)", "bad"),
    "fail": ("✗", "bad"),
    "inconclusive": ("◇", "open"),
    "not-tested": ("◇", "open"),
    "invalid": ("✗", "bad"),
}
_ORDER = ("invalid", "fail", "conditional-fail", "inconclusive", "not-tested", "conditional-pass", "pass")
_NO_VERDICT = said("nothing is required of a run of this kind")


_CONDITIONS = frozenset(
    name
    for name in _NAMES
    if name not in {"preload", "stored-energy", "absorbed-energy-ratio", "stored-energy-category"}
)


def is_condition(requirement: Mapping[str, Any]) -> bool:
    """Say whether it is a condition of the test, and no requirement on the specimen."""
    return bool(requirement.get("condition", requirement["id"] in _CONDITIONS))


def verdict_cell(verdict: object, why: str = _NO_VERDICT) -> Cell:
    """Return a verdict with its symbol, so that it reads without colour; None is a dash and why."""
    if verdict is None:
        return Cell(DASH, "missing", why)
    symbol, tone = _SYMBOLS[str(verdict)]
    return Cell(said("{symbol} {what}", symbol=symbol, what=verdict_words(verdict)), tone)


def run_verdict_cell(run: ReportRun) -> Cell:
    """Return the verdict of a run; a dash with the reason where no statement rests on it."""
    cell = verdict_cell(run.evaluated.get("verdict"))
    if run.characterises and cell.tone != "missing":
        return Cell(DASH, "missing", said("characterisation: no statement of conformity rests on it"))
    return cell


def worst(verdicts: Sequence[str]) -> str:
    """Return the gravest of some verdicts."""
    return min(verdicts, key=severity)


def severity(verdict: object) -> int:
    """Return the place of a verdict among all of them, the gravest first."""
    return _ORDER.index(str(verdict))


def nearest_to_a_limit(requirement: Mapping[str, Any]) -> tuple[int, float, float]:
    """Return how near a requirement is to be missed, for sorting: least is nearest.

    By its verdict, its conformance probability, and the distance from a limit as a share of the limits' span
    (of the limit, where there is one).
    """
    low, high = (usable(requirement.get(key)) for key in ("lower_limit", "upper_limit"))
    measured, probability = (usable(requirement.get(key)) for key in ("measured", "conformance_probability"))
    share = math.inf
    if measured is not None:
        away = [measured - low] if low is not None else []
        away += [high - measured] if high is not None else []
        ends = [end for end in (low, high) if end is not None]
        span = ends[-1] - ends[0] if len(ends) > 1 else sum(map(abs, ends))
        share = min(away) / span if span else math.inf
    return severity(requirement["verdict"]), 1.0 if probability is None else probability, share


def name_of(requirement: Mapping[str, Any]) -> str:
    """Return a requirement's id as words: ``Force at 60 mm``."""
    identifier = str(requirement.get("id"))
    if identifier.startswith("force-at-"):
        return said(
            "Force at {stroke} mm", stroke=numeral(identifier.removeprefix("force-at-").removesuffix("mm"))
        )
    if identifier.startswith("proof-load-"):
        return said("Proof load {load}", load=identifier.removeprefix("proof-load-"))
    return (_NAMES | _FURTHER).get(identifier) or identifier.replace("-", " ").capitalize()


def verdict_line(run: ReportRun) -> VerdictLine:
    """Return a run's verdict with a sentence that a person who reads nothing else can act on."""
    verdict = run.evaluated.get("verdict")
    sentence, deciding = _sentence(run, verdict)
    subject = said("Run {number} ({id}, {kind})", number=run.number, id=run.id, kind=kind_words(run.kind))
    if run.characterises:
        subject += said(": characterisation, no part of the statement of conformity")
    return VerdictLine(run_verdict_cell(run), subject, sentence, grouped_points(deciding))


def _sentence(run: ReportRun, verdict: object) -> tuple[str, Sequence[Mapping[str, Any]]]:
    """Return the sentence, and the requirements that decided."""
    if verdict is None:
        return said("No verdict: {no_verdict}.", no_verdict=_NO_VERDICT), ()
    conditions = [r for r in run.requirements if is_condition(r)]
    required = [r for r in run.requirements if not is_condition(r)]
    if verdict == "pass":
        kept = said(
            "all {count_of_conditions} conditions of the test were kept", count_of_conditions=len(conditions)
        )
        return said(
            "All {count_of_required} requirements are met and {kept}.",
            count_of_required=len(required),
            kept=kept,
        ), ()
    if verdict == "invalid":
        broken = [r for r in conditions if r["verdict"] == "fail"]
        return said("The test does not count, because its conditions were broken:"), broken
    if verdict == "fail":
        failed = [r for r in required if r["verdict"] == "fail"]
        return said(
            "{count_of_failed} of {count_of_required} requirements are not met:",
            count_of_failed=len(failed),
            count_of_required=len(required),
        ), failed
    if verdict in {"inconclusive", "not-tested"}:
        open_ = [r for r in [*conditions, *required] if r["verdict"] in {"inconclusive", "not-tested"}]
        met = sum(r["verdict"] in {"pass", "conditional-pass"} for r in required)
        return said(
            "Nothing failed; {met} of {count_of_required} requirements are met. Not decided:",
            met=met,
            count_of_required=len(required),
        ), open_
    near = [r for r in run.requirements if r["verdict"] == verdict]
    return said(
        "{count_of_near} results lie closer to a limit than their uncertainty:", count_of_near=len(near)
    ), near


def grouped_points(requirements: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return one line a requirement, with its cycles and the reason in the first of them."""
    reasons: dict[str, str] = {}
    cycles: dict[str, list[str]] = {}
    for requirement in requirements:
        name = name_of(requirement)
        reasons.setdefault(name, str(requirement.get("why") or "").rstrip(". "))
        cycle = requirement.get("cycle")
        cycles.setdefault(name, []).extend([] if cycle is None else [str(cycle)])
    points = []
    for name, why in reasons.items():
        of = cycles[name]
        where = (
            said_count(" (cycle {list})", " (cycles {list})", len(of), list=joined(", ", of)) if of else ""
        )
        points.append(
            said("{name}{where}: {why}", name=name, where=where, why=why)
            if why
            else said("{name}{where}", name=name, where=where)
        )
    return tuple(points)


def requirements_section(source: ReportSource) -> Section | None:
    """Return what runs were judged by, if any; in a detailed report each requirement by cycle, too."""
    tables = []
    for run in source.runs if source.detailed else ():
        ordered = sorted(run.requirements, key=reading_order)
        for conditions in (False, True):
            rows = [r for r in ordered if is_condition(r) is conditions]
            if rows:
                tables.append(_table(run, rows, conditions=conditions))
    judged = [requirement for run in source.runs for requirement in run.requirements]
    if not judged:
        return None
    standards = dict.fromkeys(str(r["standard"]) for r in judged)
    editions = dict.fromkeys(
        said(
            "{standard}, edition: {what}.",
            standard=r["standard"],
            what=r.get("edition") or said("not on record"),
        )
        for r in judged
    )
    sets = limit_set_sheets(source)
    blocks = (*(sets or (Texts(tuple(editions)),)), *tables)
    return Section(
        "requirements", said("Requirements of {list}", list=joined(", ", standards)), blocks, annex=True
    )


def reading_order(requirement: Mapping[str, Any]) -> tuple[int, int, float]:
    """Return the place of a requirement: cycle by cycle; the forces by stroke, then the energies."""
    at = usable(requirement.get("stroke_mm"))
    return int(requirement.get("cycle") or 0), 1 if at is None else 0, at or 0.0


def _table(run: ReportRun, requirements: Sequence[Mapping[str, Any]], *, conditions: bool) -> Table:
    what = said("conditions of the test") if conditions else said("requirements on the specimen")
    what += said(" (characterisation)") if run.characterises else ""
    return Table(
        said("Run {number} ({id}): {what}", number=run.number, id=run.id, what=what),
        (
            Column(said("Condition") if conditions else said("Requirement")),
            Column(said("Cycle")),
            Column(said("Measured ± U")),
            Column(said("Permitted")),
            Column(said("Unit")),
            Column(said("Conf. prob.")),
            Column(said("Verdict")),
            Column(said("Why")),
        ),
        tuple(_row(requirement) for requirement in requirements),
    )


def _row(requirement: Mapping[str, Any]) -> tuple[Cell, ...]:
    why = str(requirement.get("why") or "")
    probability = usable(requirement.get("conformance_probability"))
    cycle = requirement.get("cycle")
    unit = str(requirement.get("unit") or "")
    return (
        Cell(name_of(requirement)),
        Cell(said("all") if cycle is None else str(cycle), "number"),
        measured_cell(
            requirement.get("measured"), requirement.get("expanded_uncertainty"), why or said("not measured")
        ),
        Cell(limits_text(requirement.get("lower_limit"), requirement.get("upper_limit")), "number"),
        Cell("–" if unit in {"", "1"} else unit),
        Cell(DASH, "missing", said("no uncertainty, or no measured value, to compute it from"))
        if probability is None
        else Cell(probability_text(probability), "number"),
        verdict_cell(requirement["verdict"]),
        Cell(why or str(requirement.get("requirement") or "")),
    )
