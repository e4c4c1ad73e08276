"""Which runs of a report are the conformity test: as the evaluation document says, or decided here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from bufferstand.evaluation.across_runs.conformity import Candidate, decide_purposes, standing_of
from bufferstand.evaluation.archive import settings_entry
from bufferstand.evaluation.report.source.source import ReportRun, ReportSource, runs_text
from bufferstand.evaluation.wording import joined, said, test_words
from bufferstand.foundation import BadInput


def with_purposes(
    runs: Sequence[ReportRun], document: Mapping[str, Any], chosen: Sequence[str]
) -> tuple[tuple[ReportRun, ...], tuple[Mapping[str, Any], ...], Mapping[str, Any]]:
    """Return the runs with the purpose of each, the statements that rest on them, and the document.

    Where the user names runs here, the document's settings, and their hash, have these.

    Parameters
    ----------
    runs : sequence of ReportRun
    document : mapping
        The evaluation document. What it says holds, unless it is of an earlier version or the user chooses.
    chosen : sequence of str
        Ids or paths of runs that the user names; those that are none of these runs are passed over.

    Raises
    ------
    BadInput
        If nothing is required of a run that the user names.
    """
    chosen = [name for name in chosen if any(name in _names(run) for run in runs)]
    if not chosen and "conformity" in document:
        ids = {run.id for run in runs}
        own = [s for s in document["conformity"] if ids & {*s["runs"], *s["characterisation"]}]
        return tuple(runs), tuple(own), document
    decided = decide_purposes([_candidate(run) for run in runs], chosen)
    told = [
        replace(run, evaluated={**run.evaluated, **purpose.entry()})
        for run, purpose in zip(runs, decided.purposes, strict=True)
    ]
    if (settings := document.get("settings")) is not None:
        document = {**document, "settings": settings_entry(settings, decided.named)}
    return tuple(told), tuple(statement.entry() for statement in decided.statements), document


def check_chosen(sources: Sequence[ReportSource], chosen: Sequence[str]) -> None:
    """Refuse a name that is that of no run.

    Raises
    ------
    BadInput
        If none of the runs has it.
    """
    for name in chosen:
        if not any(name in _names(run) for source in sources for run in source.runs):
            ids = joined(", ", (run.id for source in sources for run in source.runs if run.requirements))
            raise BadInput(
                f"no run “{name}” is in this report",
                file="--conformity",
                remedy=f"name one that is judged: {ids or 'none is'}",
            )


def purpose_texts(source: ReportSource) -> tuple[str, ...]:
    """Return a sentence for each statement: on which runs it rests, by whose word, and which are left out."""
    numbers = {run.id: run.number for run in source.runs}
    texts = []
    for statement in source.statements:
        of = said(" of specimen {specimen}", specimen=statement["specimen"]) if statement["specimen"] else ""
        tests = [numbers[name] for name in statement["runs"] if name in numbers]
        what = said("Conformity test{of} ({kind})", of=of, kind=test_words(statement["kind"]))
        text = (
            said("{what}: {runs}, {why}.", what=what, runs=runs_text(tests), why=statement["why"])
            if tests
            else said("{what}: {statement}.", what=what, statement=_none(statement))
        )
        others = [numbers[name] for name in statement["characterisation"] if name in numbers]
        if others:
            text += said(" Characterisation, and no part of this statement: {runs}.", runs=runs_text(others))
        texts.append(text)
    return tuple(texts)


def _none(statement: Mapping[str, Any]) -> str:
    elsewhere = joined(", ", statement["runs"])
    return (
        said("run {elsewhere}, which is not in this report", elsewhere=elsewhere)
        if elsewhere
        else said("none; {why}", why=statement["why"])
    )


def purpose_warnings(source: ReportSource) -> list[str]:
    """Return what else could have been meant."""
    return [
        said(
            "Conformity test of {what}: {text}.",
            what=statement["specimen"] or said("a specimen without id"),
            text=text,
        )
        for statement in source.statements
        for text in statement["warnings"]
    ]


def _names(run: ReportRun) -> tuple[str, ...]:
    return run.id, str(run.evaluated.get("run", {}).get("path")), run.file


def _candidate(run: ReportRun) -> Candidate:
    stated = run.fact("step", "purpose") if run.fact("step") else run.fact("test", "purpose")
    rows = [(bool(r.get("condition")), str(r["verdict"])) for r in run.requirements]
    return Candidate(
        id=run.id,
        path=str(run.evaluated.get("run", {}).get("path") or run.file),
        kind=run.kind,
        specimen=run.fact("specimen", "id"),
        campaign=run.fact("campaign", "id"),
        started=None if run.started is None else run.started.isoformat(),
        step_kind=run.fact("step", "kind"),
        stated=stated if stated in ("conformity", "characterisation") else None,
        standing=standing_of(rows),
        verdict=run.evaluated.get("verdict"),
    )
