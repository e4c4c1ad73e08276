"""The evaluation inside a report against the run files that it names: their hashes, and figures anew."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

from pydantic import TypeAdapter, ValidationError

from bufferstand.evaluation.archive import EvaluationSettings, LocalWorkers, evaluate_archive
from bufferstand.evaluation.archive import document as evaluation_document
from bufferstand.evaluation.document import version_text
from bufferstand.evaluation.facts import Inspection, Options
from bufferstand.evaluation.report.report_file import NamedRun, ReportFile
from bufferstand.evaluation.report.source import evaluation_hash, without_paths
from bufferstand.evaluation.report.verifying.differences import differences
from bufferstand.evaluation.report.verifying.findings import Finding, fault, holds, note
from bufferstand.evaluation.requirements import LimitSet, find_limit_set, shipped_names
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import file_hash
from bufferstand.recording.finding import run_files

PLACE = "run files"
_SHOWN = 5
_NOT_OF_SETTINGS = ("sha256", "conformity", "limit_set", "inspections")
_OF_A_MACHINE = ("software", "copies", "failures", "warnings")
"""What the evaluation says of software and files, not of runs; ``warnings`` name files by their paths."""


def run_findings(
    report: ReportFile, folders: Sequence[Path] | None, limit_set: LimitSet | None, jobs: int | None
) -> Iterator[Finding]:
    """Look for the run files of a report, compare their hashes, and evaluate them anew.

    Parameters
    ----------
    report : ReportFile
    folders : sequence of Path or None
        Where the run files are; None: beside the report, and in ``runs`` there or a folder above.
    limit_set : LimitSet or None
        What the runs were judged by, where it is no shipped set.
    jobs : int or None
        Processes that evaluate.

    Yields
    ------
    Finding

    Raises
    ------
    BadInput
        If a folder that is named does not exist or has no run files.
    """
    known = list(beside(report.path) if folders is None else run_files(folders))
    if not known:
        yield note(PLACE, "none are beside the report: give --runs DIR; its figures were not compared")
        return
    found: list[Path] = []
    missing: list[str] = []
    for run in report.proof.runs:
        path, other = _file_of(run, known)
        if path is not None:
            found.append(path)
        elif other is not None:
            missing.append(run.file)
            yield fault(
                PLACE,
                f"{other}: not the file that was reported: its SHA-256 is another than that in the report",
            )
        else:
            missing.append(run.file)
    if found:
        yield holds(
            PLACE, f"{len(found)} of {len(report.proof.runs)} have the SHA-256 that the report states"
        )
    if missing:
        yield note(PLACE, f"not found: {', '.join(missing)}; without all of them nothing is evaluated anew")
        return
    ids = dict(zip([run.id for run in report.proof.runs], found, strict=True))
    for name, document in report.evaluations.items():
        yield from _anew(name, document, ids, limit_set, jobs)


def beside(report: Path) -> Iterator[Path]:
    """Return the run files that may be those of a report: beside it, or in ``runs`` there or above."""
    here = report.resolve().parent
    for folder in (here, here / "runs", here.parent, here.parent / "runs"):
        yield from sorted(folder.glob("*.h5"))


def _file_of(run: NamedRun, known: Iterable[Path]) -> tuple[Path | None, Path | None]:
    """Return the file of a run, by its hash; else another one of its name."""
    name = PurePath(run.file).name
    named: list[Path] = []
    others: list[Path] = []
    for path in known:
        (named if path.name == name else others).append(path)
    for path in (*named, *others):
        try:
            if file_hash(path) == run.sha256:
                return path, None
        except OSError:
            continue
    return None, named[0] if named else None


def _anew(
    name: str,
    document: Mapping[str, Any],
    ids: Mapping[str, Path],
    limit_set: LimitSet | None,
    jobs: int | None,
) -> Iterator[Finding]:
    entries = [str(entry["run"]["id"]) for entry in document["runs"]]
    if strange := [run for run in entries if run not in ids]:
        yield fault(name, f"has run “{strange[0]}”, which is none of the report’s run files")
        return
    try:
        settings = _settings(document, limit_set)
    except BadInput as error:
        yield note(name, f"not evaluated anew: {error.message()}")
        return
    named = document["settings"].get("conformity") or ()
    evaluation = evaluate_archive(
        [ids[run] for run in entries], settings, LocalWorkers(jobs), conformity=named
    )
    anew = evaluation_document(evaluation)
    own, other = (version_text(one.get("software") or {}) for one in (anew, document))
    by = f" by other software ({other}; here {own})" if own != other else ""
    found = list(differences(_comparable(document), _comparable(anew)))
    if not found:
        mark = f"; the SHA-256 of what it found, as printed: {evaluation_hash(document)}"
        yield holds(name, f"the same as the evaluation made anew of {len(entries)} run file(s){by}{mark}")
        return
    for place, stated, made in found[:_SHOWN]:
        yield fault(name, f"{place} is {stated} in the report, and {made} when evaluated anew{by}")
    if len(found) > _SHOWN:
        yield fault(name, f"and {len(found) - _SHOWN} more differences")


def _comparable(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return what an evaluation says of runs, each by its id, wherever their files lie."""
    runs = {str(entry["run"]["id"]): entry for entry in document["runs"]}
    rest = {key: value for key, value in document.items() if key not in _OF_A_MACHINE}
    stated: dict[str, Any] = without_paths({**rest, "runs": runs})
    return stated


def _settings(document: Mapping[str, Any], limit_set: LimitSet | None) -> EvaluationSettings:
    """Return how an evaluation was made.

    Raises
    ------
    BadInput
        If it does not say so, or by a limit set that is not known here.
    """
    stated = document.get("settings")
    if not isinstance(stated, Mapping) or "limit_set" not in stated:
        raise BadInput("it does not say how it was made")
    plain = {key: value for key, value in stated.items() if key not in _NOT_OF_SETTINGS}
    try:
        inspections = tuple(
            Inspection.model_validate({key: value for key, value in one.items() if key != "sha256"})
            for one in stated.get("inspections") or ()
        )
        options = TypeAdapter(Options).validate_python({**plain, "inspections": inspections})
    except (ValidationError, AttributeError, TypeError):
        raise BadInput("it was made with settings that this version does not know") from None
    known = [*map(find_limit_set, shipped_names()), *([limit_set] if limit_set else [])]
    for one in known:
        if one.sha256 == stated["limit_set"]:
            return EvaluationSettings(options, one)
    raise BadInput("it was judged by a limit set that is not known here", remedy="give --limits FILE.toml")
