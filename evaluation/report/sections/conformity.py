"""Conformity clause by clause, and what was not tested (ISO/IEC 17025, 7.8.3.1 b and 7.8.6.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from bufferstand.evaluation.report.content import (
    DASH,
    Block,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    Tone,
    limits_text,
    measured_cell,
    probability_text,
    span_text,
    usable,
)
from bufferstand.evaluation.report.sections.certificate import told_on_first_page
from bufferstand.evaluation.report.sections.limit_set import inspection_blocks
from bufferstand.evaluation.report.sections.references import is_draft, reference_text
from bufferstand.evaluation.report.sections.verdicts import (
    grouped_points,
    is_condition,
    name_of,
    nearest_to_a_limit,
    worst,
)
from bufferstand.evaluation.report.source import (
    ReportRun,
    ReportSource,
    purpose_texts,
    runs_text,
)
from bufferstand.evaluation.requirements import LimitSet
from bufferstand.evaluation.wording import joined, numeral, said

_STATEMENTS: dict[str, tuple[str, Tone]] = {
    "pass": (said("✓ met"), "good"),
    "conditional-pass": (said("(✓) met, nearer to the limit than U"), "good"),
    "conditional-fail": (said("(✗) not met, nearer to the limit than U"), "bad"),
    "fail": (said("✗ not met"), "bad"),
    "inconclusive": (said("◇ not decided"), "open"),
    "not-tested": (said("◇ not tested"), "open"),
    "invalid": (said("✗ not stated: conditions broken"), "bad"),
}
_EXPLANATION = said(
    "A statement is that of the gravest verdict among the runs and cycles named beside it; the "
    "value with U and the conformance probability are those of the cycle nearest to a limit. "
    "What is not decided or not tested is neither met nor not met."
)
_DRAFT = said("A draft states nothing yet: what it lacks is on the first page.")
_NOT_MEASURED = said("nothing was measured of it")
_NO_PROBABILITY = said("not judged by an uncertainty")
_OPEN = frozenset({"inconclusive", "not-tested"})


@dataclass
class _Stated:
    """One requirement of one clause, as judged over runs and cycles."""

    requirement: Mapping[str, Any]
    runs: dict[int, list[int]] = field(default_factory=dict)
    judged: list[Mapping[str, Any]] = field(default_factory=list)

    def add(self, run: ReportRun, requirement: Mapping[str, Any]) -> None:
        cycles = self.runs.setdefault(run.number, [])
        if (cycle := requirement.get("cycle")) is not None:
            cycles.append(int(cycle))
        self.judged.append(requirement)

    def values(self) -> list[float]:
        """Return what was measured of it, in the order of runs and cycles."""
        return [value for one in self.judged if (value := usable(one.get("measured"))) is not None]

    def nearest(self) -> Mapping[str, Any]:
        """Return the row that lies nearest to a limit, of those with a measured value if there are any."""
        measured = [one for one in self.judged if usable(one.get("measured")) is not None]
        return min(measured or self.judged, key=nearest_to_a_limit)


def conformity_section(source: ReportSource) -> Section | None:
    """Return which clauses are met and which are not, to what each statement applies, and by which rule."""
    stated: dict[tuple[Any, ...], _Stated] = {}
    for run in source.runs:
        for requirement in run.stated:
            limits = tuple(requirement.get(key) for key in ("lower_limit", "upper_limit"))
            key = (reference_text(requirement), requirement["id"], *limits)
            stated.setdefault(key, _Stated(requirement)).add(run, requirement)
    if not stated and not source.statements:
        return None
    blocks: list[Block] = []
    if texts := purpose_texts(source):
        blocks.append(Texts(texts, listed=True))
    for conditions, words in (
        (False, said("requirements on the specimen")),
        (True, said("conditions of the test")),
    ):
        chosen = [one for one in stated.values() if is_condition(one.requirement) is conditions]
        if chosen:
            blocks.append(_table(words, chosen))
    if stated:
        drafts = (_DRAFT,) if any(is_draft(one.requirement) for one in stated.values()) else ()
        blocks.append(Texts((_EXPLANATION, *drafts)))
    blocks += inspection_blocks(source)
    return Section("conformity", said("Statement of conformity by clause"), tuple(blocks))


def _table(words: str, stated: Sequence[_Stated]) -> Table:
    drafts = [is_draft(one.requirement) for one in stated]
    return Table(
        said("Conformity: {words}", words=words),
        (
            Column(said("Requirement")),
            Column(said("Clause")),
            Column(said("Permitted")),
            Column(said("Unit")),
            Column(said("Least … greatest")),
            Column(said("Measured ± U")),
            Column(said("Conf. prob.")),
            Column(said("Runs (cycles)")),
            Column(said("Statement (draft)") if all(drafts) else said("Statement")),
        ),
        tuple(
            _row(one, said(", draft") if is_one and not all(drafts) else "")
            for one, is_one in zip(stated, drafts, strict=True)
        ),
    )


def _row(one: _Stated, draft: str) -> tuple[Cell, ...]:
    requirement, nearest = one.requirement, one.nearest()
    unit = str(requirement.get("unit") or "")
    text, tone = _STATEMENTS[worst([str(row["verdict"]) for row in one.judged])]
    probability = usable(nearest.get("conformance_probability"))
    return (
        Cell(name_of(requirement)),
        _clause(requirement),
        Cell(limits_text(requirement.get("lower_limit"), requirement.get("upper_limit")), "number"),
        Cell("–" if unit in {"", "1"} else unit),
        _range(one.values(), usable(nearest.get("expanded_uncertainty"))),
        measured_cell(nearest.get("measured"), nearest.get("expanded_uncertainty"), _NOT_MEASURED),
        Cell(DASH, "missing", _NO_PROBABILITY)
        if probability is None
        else Cell(probability_text(probability), "number"),
        Cell(joined("; ", (_of(number, cycles) for number, cycles in one.runs.items()))),
        Cell(text + draft, tone),
    )


def _clause(requirement: Mapping[str, Any]) -> Cell:
    """Return the clause; or a dash whose footnote says where the number is from."""
    reference = reference_text(requirement)
    return Cell(reference) if requirement.get("clause") else Cell(DASH, "missing", reference)


def _range(values: Sequence[float], expanded: float | None) -> Cell:
    if not values:
        return Cell(DASH, "missing", _NOT_MEASURED)
    return Cell(span_text(min(values), max(values), expanded), "number")


def _of(number: int, cycles: Sequence[int]) -> str:
    return (
        said("{number} ({list})", number=number, list=joined(", ", map(str, cycles)))
        if cycles
        else str(number)
    )


def not_tested_section(source: ReportSource, *, first_page: bool = True) -> Section:
    """Return what was not tested or not decided, each with the reason; never left out.

    What the statement on the ``first_page`` gives the reason of is named only.
    """
    told = told_on_first_page(source) if first_page else None
    items = []
    for run in source.runs:
        rows = [row for row in run.stated if row["verdict"] in _OPEN]
        if rows and run is told:
            names = joined(", ", dict.fromkeys(name_of(row) for row in rows))
            items.append(
                said(
                    "Run {number}: {names}. The reasons stand on the first page.",
                    number=run.number,
                    names=names,
                )
            )
        else:
            items += [
                said("Run {number}: {point}.", number=run.number, point=point)
                for point in grouped_points(rows)
            ]
    items += [text for limits in source.limit_sets for text in _parts_without_a_run(source, limits)]
    items += source.fields.not_tested
    without = [run.number for run in source.runs if run.evaluated.get("verdict") is None]
    if without:
        items.append(
            said(
                "No requirement applies to {runs}: characterisation only, without a statement of conformity.",
                runs=runs_text(without),
            )
        )
    known = {limits.sha256 for limits in source.limit_sets}
    unknown = {
        str(limits.get("id"))
        for run in source.runs
        if (limits := run.evaluated.get("limit_set")) and limits.get("sha256") not in known
    }
    items += [
        said("Which further parts limit set {name} has is not known here: give it by --limits.", name=name)
        for name in sorted(unknown)
    ]
    return Section(
        "not-tested",
        said("Requirements not tested"),
        (Texts(tuple(items) or (said("Nothing was left out."),), listed=True),),
    )


def _parts_without_a_run(source: ReportSource, limits: LimitSet) -> list[str]:
    """Return the parts of a limit set that no run of the report is a test of."""
    kinds = {run.kind for run in source.runs if not run.characterises}
    of = said("{standard} (limit set {id})", standard=limits.standard, id=limits.id)
    parts = []
    if limits.covers("static") and "static" not in kinds:
        parts.append(
            said(
                "Static characteristic of {of}: this report has no static run that is a conformity test.",
                of=of,
            )
        )
    if limits.covers("impact") and "impact" not in kinds:
        clause, _ = limits.reference(limits.impact)
        parts.append(
            said(
                "Impact test of {of}{what}: this report has no record of an impact.",
                of=of,
                what=joined("", (", ", clause)) if clause else "",
            )
        )
    applied = {_proof_load(run) for run in source.runs if run.kind == "proof" and not run.characterises}
    absent = [load for load in (limits.proof.load if limits.proof else ()) if load.id not in applied]
    if absent:
        loads = joined(
            ", ",
            (
                load.id
                + (
                    said(" (≥ {force} kN)", force=numeral(f"{force:g}"))
                    if (force := usable(load.force_min_kN)) is not None
                    else ""
                )
                for load in absent
            ),
        )
        parts.append(said("Proof loads of {of}: no record of {loads}.", of=of, loads=loads))
    return parts


def _proof_load(run: ReportRun) -> str:
    return str(run.fact("step", "proof_load") or run.fact("test", "proof_load") or "")
