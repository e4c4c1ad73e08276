"""What a requirement refers to: the clause of the standard, or the source where no clause is on record.

A statement of conformity names the edition and the clauses that were met or not (ISO/IEC 17025, 7.8.6.2 b).
One that cannot is a draft.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from bufferstand.evaluation.report.sections.verdicts import name_of
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import joined, said

_REMEDY = said("state them in a limit set of the laboratory’s own (--limits)")


def reference_text(requirement: Mapping[str, Any]) -> str:
    """Return standard and clause: ``EN 15551, 6.2``; or that no clause is on record, and the source."""
    standard = str(requirement["standard"])
    if clause := requirement.get("clause"):
        return said("{standard}, {clause}", standard=standard, clause=clause)
    source = requirement.get("source") or said("not stated")
    return said("{standard}, clause not on record (source: {source})", standard=standard, source=source)


def is_draft(requirement: Mapping[str, Any]) -> bool:
    """Say whether a statement on a requirement can only be a draft: edition or clause is not on record."""
    return not requirement.get("edition") or not requirement.get("clause")


def missing_references(source: ReportSource) -> tuple[str, ...]:
    """Return what statements of conformity lack, in words: a line a standard; none where they are whole."""
    return tuple(_lacking([r for run in source.runs for r in run.stated]))


def draft_texts(requirements: Iterable[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return the sentence that says why a statement is a draft; nothing where it is none."""
    return tuple(
        said(
            "Draft of a statement of conformity, and none yet: what is missing is the {text}.",
            text=said("{list}: {remedy}", list=text, remedy=_REMEDY),
        )
        for text in _lacking(requirements)
    )


def _lacking(requirements: Iterable[Mapping[str, Any]]) -> list[str]:
    editions: dict[str, bool] = {}
    without: dict[str, dict[str, None]] = {}
    counted: dict[str, set[str]] = {}
    for requirement in requirements:
        standard, name = str(requirement["standard"]), name_of(requirement)
        editions[standard] = editions.get(standard, True) and bool(requirement.get("edition"))
        counted.setdefault(standard, set()).add(name)
        if not requirement.get("clause"):
            without.setdefault(standard, {})[name] = None
    texts = []
    for standard, has_edition in editions.items():
        names = list(without.get(standard, ()))
        parts = [] if has_edition else [said("edition of {standard}", standard=standard)]
        if names:
            every = len(names) == len(counted[standard])
            of = said("what it requires") if every else joined(", ", names)
            parts.append(said("clauses of {standard} for {of}", standard=standard, of=of))
        if parts:
            texts.append(joined(said(" and the "), parts))
    return texts
