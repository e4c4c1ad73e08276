"""The first page: one statement, the key values with their limits, and who answers for the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Signature,
    Signatures,
    Table,
    Texts,
    VerdictLine,
    limits_text,
    measured_cell,
    significant,
    usable,
)
from bufferstand.evaluation.report.sections.identity import operator
from bufferstand.evaluation.report.sections.verdicts import (
    is_condition,
    name_of,
    nearest_to_a_limit,
    reading_order,
    severity,
    verdict_cell,
    verdict_line,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource, runs_text
from bufferstand.evaluation.wording import capital, joined, label, said, test_words

MOST_VALUES = 5
"""Key values on the first page."""
_MOST_POINTS = 4
"""Reasons below the statement; the others stand in the statement by clause."""
_MAIN = ("damping", "tangent_stiffness_kN_per_mm")
_EXTREMES = (
    ("force_max_kN", said("Greatest force")),
    ("stroke_max_mm", said("Greatest stroke")),
    ("speed_max_mm_per_s", said("Greatest speed")),
)
_NO_LIMIT = said("no limit is set on it")
_NO_STATEMENT = said("no requirement is set on it")
_VALIDITY = said(
    "The results relate only to the items tested. This report shall not be reproduced except in "
    "full without approval of the laboratory."
)


def statement(source: ReportSource) -> VerdictLine:
    """Return the one statement of the report: the gravest verdict of the runs that it rests on, and why."""
    tests = _tests(source)
    if not tests:
        return VerdictLine(
            Cell(said("No statement")),
            said("Characterisation"),
            said("No statement of conformity rests on these runs: the report says what was measured."),
        )
    gravest = _gravest(tests)
    line = verdict_line(gravest)
    standards = joined(said(" and "), dict.fromkeys(str(r["standard"]) for run in tests for r in run.stated))
    numbers = [run.number for run in tests]
    subject = said(
        "{standards}: {test}, {runs}",
        standards=standards,
        test=test_words(gravest.kind),
        runs=runs_text(numbers),
    )
    sentence = (
        line.sentence
        if len(tests) == 1
        else said("Gravest is run {number}. {sentence}", number=gravest.number, sentence=line.sentence)
    )
    points = line.points
    if (left := len(points) - _MOST_POINTS) > 0:
        points = (
            *points[:_MOST_POINTS],
            said("and {left} more: see Statement of conformity by clause", left=left),
        )
    return VerdictLine(line.verdict, subject, sentence, points)


def told_on_first_page(source: ReportSource) -> ReportRun | None:
    """Return the run whose open requirements all stand in the statement, with their reasons; None: none."""
    tests = _tests(source)
    if not tests:
        return None
    gravest = _gravest(tests)
    is_open = gravest.evaluated["verdict"] in {"inconclusive", "not-tested"}
    return gravest if is_open and len(verdict_line(gravest).points) <= _MOST_POINTS else None


def _tests(source: ReportSource) -> list[ReportRun]:
    return [run for run in source.runs if run.stated and run.evaluated.get("verdict") is not None]


def _gravest(tests: Sequence[ReportRun]) -> ReportRun:
    return min(tests, key=lambda run: severity(run.evaluated["verdict"]))


def key_values(source: ReportSource) -> Table:
    """Return the five values that say most of the specimen: those nearest to a limit, then characteristics.

    Of a requirement the cycle counts that lies nearest to a limit; all stand in the statement by clause.
    """
    rows = [*_required(source), *_characteristics(source)][:MOST_VALUES]
    return Table(
        said("Key values"),
        (
            Column(said("Quantity")),
            Column(said("Measured ± U")),
            Column(said("Limit")),
            Column(said("Unit")),
            Column(said("Run (cycle)")),
            Column(said("Verdict")),
        ),
        tuple(rows),
        note=said("Of a requirement: the cycle nearest to its limit. U: k = 2, about 95 % coverage."),
    )


def _required(source: ReportSource) -> list[tuple[Cell, ...]]:
    of: dict[tuple[Any, ...], list[tuple[ReportRun, Mapping[str, Any]]]] = {}
    for run in source.runs:
        for requirement in run.stated:
            if not is_condition(requirement) and usable(requirement.get("measured")) is not None:
                key = (requirement["standard"], requirement["id"])
                of.setdefault(key, []).append((run, requirement))
    nearest = [min(pairs, key=lambda pair: nearest_to_a_limit(pair[1])) for pairs in of.values()]
    chosen = sorted(nearest, key=lambda pair: nearest_to_a_limit(pair[1]))[:MOST_VALUES]
    return [
        _required_row(*pair)
        for pair in sorted(chosen, key=lambda pair: (reading_order(pair[1])[1:], pair[0].number))
    ]


def _required_row(run: ReportRun, requirement: Mapping[str, Any]) -> tuple[Cell, ...]:
    cycle = requirement.get("cycle")
    return (
        Cell(name_of(requirement)),
        measured_cell(requirement["measured"], requirement.get("expanded_uncertainty"), ""),
        Cell(limits_text(requirement.get("lower_limit"), requirement.get("upper_limit")), "number"),
        Cell(_unit(requirement.get("unit"))),
        Cell(str(run.number) + ("" if cycle is None else said(" ({cycle})", cycle=cycle))),
        verdict_cell(requirement["verdict"]),
    )


def _unit(unit: object) -> str:
    return "–" if unit in {None, "", "1"} else str(unit)


def _characteristics(source: ReportSource) -> list[tuple[Cell, ...]]:
    """Return damping and stiffness of the harmonic runs, then the extremes of all runs with their limits."""
    rows = []
    for name in _MAIN:
        entry = QUANTITIES.named(name)
        found = [
            (value, run)
            for run in source.runs
            if run.kind == "harmonic" and (value := run.result(name)) is not None
        ]
        if found:
            words = label(entry.label, capital(entry.label))
            rows.append(
                _spanned(words, entry.printed_unit, found, [_stated_u(run, name) for _, run in found])
            )
    rows += [row for name, words in _EXTREMES if (row := _extreme(source, name, words)) is not None]
    return rows


def _stated_u(run: ReportRun, name: str) -> float | None:
    entry = run.summary.get(name)
    return usable(entry.get("expanded_uncertainty")) if isinstance(entry, Mapping) else None


def _spanned(
    words: str, unit: str, found: Sequence[tuple[float, ReportRun]], expanded: Sequence[float | None]
) -> tuple[Cell, ...]:
    """Return the least and the greatest of some values, each with its U."""
    order = sorted(range(len(found)), key=lambda n: found[n][0])
    ends = dict.fromkeys((order[0], order[-1]))
    texts = [measured_cell(found[n][0], expanded[n], "").text for n in ends]
    return (
        Cell(words),
        Cell(joined(" … ", texts), "number"),
        Cell(DASH, "missing", _NO_LIMIT),
        Cell(_unit(unit)),
        Cell(joined(", ", (str(found[n][1].number) for n in ends))),
        Cell(DASH, "missing", _NO_STATEMENT),
    )


def _extreme(source: ReportSource, name: str, words: str) -> tuple[Cell, ...] | None:
    found = [
        (one.value, one, run) for run in source.runs if (one := run.extreme(name)) and one.value is not None
    ]
    if not found:
        return None
    value, extreme, run = max(found, key=lambda one: one[0])
    limit, _ = run.limit(name)
    shown = measured_cell(value, extreme.expanded_uncertainty, "")
    unit = {"force_max_kN": "kN", "stroke_max_mm": "mm"}.get(name, "mm/s")
    return (
        Cell(words),
        Cell(said("{text} ?", text=shown.text), "open") if extreme.doubt else shown,
        Cell(DASH, "missing", _NO_LIMIT)
        if limit is None
        else Cell(said("≤ {limit}", limit=significant(limit)), "number"),
        Cell(unit),
        Cell(str(run.number)),
        Cell(DASH, "missing", _NO_STATEMENT),
    )


def signatures(source: ReportSource) -> tuple[Signatures, Texts]:
    """Return who answers for the report, and what it is valid for."""
    fields = source.fields
    entries = (
        Signature(said("Tested by"), operator(source)),
        Signature(said("Checked by"), fields.checked_by),
        Signature(said("Authorised by"), fields.authorised_by),
    )
    return Signatures(entries), Texts((_VALIDITY,))
