"""Runs that were evaluated before: what changed, by how much, and whether by more than its uncertainty."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from bufferstand.evaluation.archive import EvaluationComparison, Move, VerdictChange, compare_evaluations
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.report.content import (
    DASH,
    Block,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    fixed,
    significant,
)
from bufferstand.evaluation.report.sections.verdicts import name_of, verdict_cell
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import joined, label, numeral, said

MOST_ROWS = 60
"""Changes of results that are printed; those beyond their uncertainty are never left out."""
_LONGEST = 60
_UNITS = (
    ("_kN_per_mm", "kN/mm"),
    ("_mm_per_s", "mm/s"),
    ("_kN", "kN"),
    ("_mm", "mm"),
    ("_Hz", "Hz"),
    ("_J", "J"),
    ("_C", "°C"),
)
_METHOD = said(
    "Of one recording both evaluations share the errors of the measurement: a change is the "
    "effect of other settings or software alone, and is held against the larger of both expanded "
    "uncertainties. Where the recordings are different ones, it is held against U of their "
    "difference (E_n), in which errors that both name as the same cancel."
)
_ONE = said("only one of the evaluations has it")


def changes_of(source: ReportSource) -> EvaluationComparison | None:
    """Return what differs from the earlier evaluation, or None where none was given."""
    return None if source.earlier is None else compare_evaluations(source.earlier, source.document)


def reevaluation_notice(source: ReportSource) -> tuple[str, ...]:
    """Return the line at the top of the report, if there is an earlier evaluation."""
    changes = changes_of(source)
    if changes is None:
        return ()
    beyond = sum(move.beyond is True for move in changes.moves)
    results = said(
        "{count_of_moves} results are not what they were, {beyond} of them beyond their uncertainty",
        count_of_moves=len(changes.moves),
        beyond=beyond,
    )
    return (
        said(
            "Re-evaluation: {results}; {count_of_verdicts} verdicts are others.",
            results=results,
            count_of_verdicts=len(changes.verdicts),
        ),
    )


def reevaluation_section(source: ReportSource) -> Section | None:
    """Return settings, results and verdicts that are not what they were."""
    changes = changes_of(source)
    if changes is None:
        return None
    numbers = {run.id: run.number for run in source.runs}
    blocks: list[Block] = [Texts((_METHOD,)), _settings(changes)]
    if changes.verdicts:
        blocks.append(_verdicts(changes.verdicts, source, numbers))
    if changes.moves:
        blocks.append(_results(changes.moves, numbers))
    blocks.append(Texts(tuple(_remarks(changes)), listed=True))
    return Section("reevaluation", said("Comparison with the earlier evaluation"), tuple(blocks))


def _run(run: str, numbers: dict[str, int]) -> Cell:
    return Cell(str(numbers.get(run, run)), "number")


def _settings(changes: EvaluationComparison) -> Table:
    rows = [
        (Cell(name.replace("_", " ")), Cell(_text(was)), Cell(_text(now)))
        for name, (was, now) in changes.changed.items()
    ]
    return Table(
        said("Changed settings and software"),
        (Column(said("What")), Column(said("Before")), Column(said("Now"))),
        tuple(rows) or ((Cell(said("none")), Cell(said("the same")), Cell(said("the same"))),),
    )


def _text(value: object) -> str:
    if value is None or value == []:
        return said("none, or not stated")
    text = value if isinstance(value, str) else json.dumps(value, sort_keys=True, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _verdicts(verdicts: Sequence[VerdictChange], source: ReportSource, numbers: dict[str, int]) -> Table:
    none = said("not judged")
    rows = [
        (
            _run(one.run, numbers),
            Cell(name_of({"id": one.requirement}) if one.requirement else said("the run")),
            Cell(said("all") if one.cycle is None else str(one.cycle), "number"),
            verdict_cell(one.old, none),
            verdict_cell(one.new, none),
            Cell(_why(source, one)),
        )
        for one in verdicts
    ]
    columns = (said("Run"), said("Verdict of"), said("Cycle"), said("Before"), said("Now"), said("Why"))
    return Table(said("Changed verdicts"), tuple(Column(title) for title in columns), tuple(rows))


def _why(source: ReportSource, change: VerdictChange) -> str:
    """Return the reason of the new verdict."""
    requirements = [r for run in source.runs if run.id == change.run for r in run.requirements]
    named = [r for r in requirements if r["id"] == change.requirement and r.get("cycle") == change.cycle]
    return str(named[0].get("why") or "") if named else said("see its requirements")


def _weight(move: Move) -> tuple[bool, float]:
    share = move.share_of_uncertainty
    return share is not None, -(share or 0.0)


def _results(moves: Sequence[Move], numbers: dict[str, int]) -> Table:
    beyond = [move for move in moves if move.beyond is not False]
    within = sorted((move for move in moves if move.beyond is False), key=_weight)
    kept = [*sorted(beyond, key=_weight), *within[: max(0, MOST_ROWS - len(beyond))]]
    left = len(moves) - len(kept)
    return Table(
        said("Changed results"),
        (
            Column(said("Run")),
            Column(said("Quantity")),
            Column(said("Unit")),
            Column(said("Before")),
            Column(said("Now")),
            Column(said("Change ± U")),
            Column(said("Change / U")),
            Column(said("Change is")),
        ),
        tuple(_result(move, numbers) for move in kept),
        note=said("Means over the cycles used, those beyond their uncertainty first.")
        + (
            said(" {left} smaller changes within their uncertainty are not printed.", left=left)
            if left
            else ""
        ),
    )


def _result(move: Move, numbers: dict[str, int]) -> tuple[Cell, ...]:
    name, unit = _named(move.quantity)
    share, change = move.share_of_uncertainty, move.difference
    digits = move.expanded_uncertainty
    return (
        _run(move.run, numbers),
        Cell(name),
        Cell(unit),
        *(
            Cell(DASH, "missing", _ONE) if value is None else Cell(_like(value, digits), "number")
            for value in (move.old, move.new)
        ),
        Cell(DASH, "missing", _ONE) if change is None else Cell(_change(change, digits), "number"),
        Cell(DASH, "missing", _ONE if change is None else said("no uncertainty is stated"))
        if share is None
        else Cell(fixed(share, 2), "number"),
        _state(move),
    )


def _state(move: Move) -> Cell:
    if move.old is None or move.new is None:
        return Cell(said("◆ had none before") if move.old is None else said("◆ has none now"), "open")
    if move.beyond is None:
        return Cell(said("no U to hold it against"))
    return Cell(said("◆ beyond U"), "open") if move.beyond else Cell(said("within U"))


def _like(value: float, expanded: float | None) -> str:
    """Return a value to the place of its uncertainty's second digit, and one more to see small changes."""
    if not expanded:
        return significant(value, 6)
    return fixed(value, max(0, 2 - math.floor(math.log10(expanded))))


def _change(value: float, expanded: float | None) -> str:
    shown = _compact(value)
    return (
        said("{shown} ± {what}", shown=shown, what=numeral(_compact(expanded).lstrip("+")))
        if expanded
        else shown
    )


def _compact(value: float) -> str:
    """Return a change with two significant digits; tiny ones keep their power of ten."""
    return numeral(f"{value:+.2g}".replace("-", "−"))


def _named(quantity: str) -> tuple[str, str]:
    for ending, unit in _UNITS:
        if quantity.endswith(ending):
            return _words(quantity, quantity.removesuffix(ending)), unit
    return _words(quantity, quantity), "–"


def _words(quantity: str, name: str) -> str:
    """Return the words of a quantity's name, which a language says as the catalogue of quantities does."""
    words = name.replace("_", " ")
    known = {entry.name: entry.label for entry in QUANTITIES}
    return label(known[quantity], words) if quantity in known else words


def _remarks(changes: EvaluationComparison) -> list[str]:
    remarks = [said("{compared} runs were compared.", compared=changes.compared)]
    for words, runs in (
        (said("only in the earlier evaluation"), changes.only_old),
        (said("only in this evaluation"), changes.only_new),
        (said("another recording of the same id than in the earlier evaluation"), changes.other_recordings),
    ):
        if runs:
            remarks.append(said("{list}: {words}.", list=joined(", ", runs), words=words))
    return remarks
