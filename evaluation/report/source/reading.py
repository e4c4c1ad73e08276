"""From a run file or a campaign folder to the source of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.evaluation.across_runs import RecordingIdentity, each_once
from bufferstand.evaluation.archive import EvaluationSettings, LocalWorkers, evaluate_archive
from bufferstand.evaluation.archive import document as evaluation_document
from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.loading import load_opened
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.report.source.fields import ReportFields, language_for, load_fields
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.model_on_runs import apply_model
from bufferstand.evaluation.report.source.own_parts import own_parts
from bufferstand.evaluation.report.source.predecessor import predecessor_of
from bufferstand.evaluation.report.source.purposes import with_purposes
from bufferstand.evaluation.report.source.source import ReportRun, ReportSource
from bufferstand.evaluation.requirements import LimitSet, find_limit_set, shipped_limit_set, shipped_names
from bufferstand.evaluation.validation import load_validation
from bufferstand.evaluation.wording import Code, said
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import file_hash
from bufferstand.recording.finding import run_files
from bufferstand.recording.runfile import Run, open_run

_EARLIEST = datetime.min.replace(tzinfo=UTC)


@dataclass(frozen=True, eq=False)
class Loaded:
    """A run file as read: the run, its samples (None if it holds none), and what is wrong with them."""

    run: Run
    record: Record | None
    problem: str


def load_files(path: Path) -> tuple[list[Loaded], list[str]]:
    """Read the run files of a report, and say which could not be read.

    Returns
    -------
    (list of Loaded, list of str)
        Runs in the order of their start, and findings about the other files of the folder.

    Raises
    ------
    BadInput
        If there are no runs, none can be read, or two different ones have the same id.
    """
    files = run_files([path])
    findings = [
        said("{file}: a journal that was never sealed; its run is not in this report", file=left.name)
        for left in sorted(path.rglob("*.journal") if path.is_dir() else ())
    ]
    loaded = []
    for file in files:
        try:
            run = open_run(file)
            record, facts = load_opened(run)
        except BadInput as error:
            if len(files) == 1:
                raise
            findings.append(
                said(
                    "{file} could not be read and is not in this report: {problem}",
                    file=file.name,
                    problem=error.problem,
                )
            )
            continue
        loaded.append(Loaded(run, record if record.time_s.size else None, "; ".join(facts.problems)))
    if not loaded:
        raise BadInput("none of the run files can be read", file=path, remedy="see “bufferstand verify”")
    return _each_once(sorted(loaded, key=lambda one: _order(one.run)), findings), findings


def _each_once(loaded: Sequence[Loaded], findings: list[str]) -> list[Loaded]:
    """Return the runs without copies of one, which become findings.

    Raises
    ------
    BadInput
        If two runs have one id: results, statements and trends of a report go by it.
    """
    first: dict[str, Run] = {}
    for one in loaded:
        run = one.run
        before = first.setdefault(run.id, run)
        if before.sha256 != run.sha256:
            raise BadInput(
                f"run “{run.id}” is another than that of {before.path}, which has the same id: one report "
                "cannot tell them apart",
                file=run.path,
                remedy="make a report of each campaign’s own folder, or put one of the two files elsewhere",
            )
    told = each_once(
        [
            RecordingIdentity(str(run.path), run.id, run.sha256, run.samples_sha256)
            for run in (o.run for o in loaded)
        ]
    )
    findings += [said("{what}; it is in this report once", what=copy.text) for copy in told.copies]
    return [loaded[place] for place in told.kept]


@dataclass(frozen=True)
class Given:
    """What a report is made with besides the runs.

    Attributes
    ----------
    options : Options
        How to evaluate where runs are evaluated for the report.
    limit_set : LimitSet or None
        Limits to judge by then; None: the shipped set.
    fields : ReportFields or None
        What only the laboratory knows; None: ``report.toml`` beside the runs.
    model : Path or None
        A spring model (TOML) to show beside the runs.
    earlier : mapping or None
        An earlier evaluation document of the same runs, to say what moved.
    conformity : tuple of str
        Runs that are the conformity test of their specimen, by id or path.
    jobs : int or None
        Processes that evaluate; None: one a core, spawned: a script needs its ``__main__`` guard then.
    language : str or None
        Language of the report (``de``); None: as its fields say.
    detailed : bool
        Whether the annex has the tables by cycle, every budget and the numbers behind the figures, too.
    """

    options: Options = field(default_factory=Options)
    limit_set: LimitSet | None = None
    fields: ReportFields | None = None
    model: Path | None = None
    earlier: Mapping[str, Any] | None = None
    conformity: tuple[str, ...] = ()
    jobs: int | None = 1
    language: Code | None = None
    detailed: bool = False


def read_source(
    path: Path, document: Mapping[str, Any] | None = None, given: Given | None = None
) -> ReportSource:
    """Read the runs of a report and join each with its evaluation.

    Parameters
    ----------
    path : Path
        A run file or a campaign folder.
    document : mapping, optional
        The evaluation document of the runs; without one they are evaluated here.
    given : Given, optional
        How to evaluate, and what to show besides.

    Returns
    -------
    Source
        Runs in the order of their start.

    Raises
    ------
    BadInput
        If there are no runs, none can be read, the document lacks one of them or is of another content.
    """
    given = given or Given()
    loaded, findings = load_files(path)
    rule: str | None = given.options.decision_rule
    if document is None:
        loaded, document = _evaluated(loaded, given, findings)
    else:
        rule = document.get("decision_rule")
    entries = _entries(document)
    runs = tuple(_report_run(number, one, entries, path) for number, one in enumerate(loaded, start=1))
    runs, statements, document = with_purposes(runs, document, given.conformity)
    fields = given.fields
    if fields is None:
        fields = load_fields(path if path.is_dir() else path.parent)
    fields, predecessor = predecessor_of(fields)
    earlier = given.earlier
    if earlier is not None:
        _entries(earlier)
    elif predecessor is not None and predecessor.moved(document):
        earlier = predecessor.evaluation
    return ReportSource(
        name=path.stem if path.is_file() else path.resolve().name,
        runs=runs,
        document=document,
        fields=fields,
        findings=tuple(findings),
        decision_rule=rule,
        limit_sets=_limit_sets(runs, given.limit_set),
        modelled=None if given.model is None else apply_model(given.model, runs),
        earlier=earlier,
        predecessor=predecessor,
        statements=statements,
        language=language_for(fields, given.language),
        detailed=given.detailed,
        mark=read_image(fields.mark, "mark", said("Mark of the laboratory")),
        photo=read_image(fields.specimen_photo, "specimen_photo", said("Photo of the specimen")),
        **own_parts(fields),
        validation=load_validation(Path(fields.validation)) if fields.validation else None,
    )


def _evaluated(
    loaded: list[Loaded], given: Given, findings: list[str]
) -> tuple[list[Loaded], dict[str, Any]]:
    """Evaluate the runs, and return those that could be with the document; the others become findings."""
    files = [one.run.path for one in loaded]
    settings = EvaluationSettings(given.options, given.limit_set or shipped_limit_set())
    evaluation = evaluate_archive(files, settings, LocalWorkers(given.jobs))
    problems = {failure.path: failure.problem for failure in evaluation.failures}
    if len(problems) == len(loaded):
        path, problem = next(iter(problems.items()))
        raise BadInput(problem, file=Path(path))
    findings += [
        said(
            "{file} could not be evaluated and is not in this report: {problem}",
            file=Path(path).name,
            problem=problem,
        )
        for path, problem in problems.items()
    ]
    return [one for one in loaded if str(one.run.path) not in problems], evaluation_document(evaluation)


def _limit_sets(runs: Sequence[ReportRun], given: LimitSet | None) -> tuple[LimitSet, ...]:
    """Return the sets that the runs were judged by: the given or a shipped one of the same hash."""
    used = {str(limits.get("sha256")) for run in runs if (limits := run.evaluated.get("limit_set"))}
    if not used:
        return ()
    known = {one.sha256: one for one in (*map(find_limit_set, shipped_names()), *([given] if given else []))}
    return tuple(known[hash_] for hash_ in sorted(used) if hash_ in known)


def _order(run: Run) -> tuple[datetime, int, str]:
    try:
        started = datetime.fromisoformat(str(run.metadata["run"].get("started_utc")))
    except ValueError:
        started = _EARLIEST
    if started.tzinfo is None:
        started = started.replace(tzinfo=UTC)
    return started, int(run.metadata["run"].get("step_index") or 0), run.path.name


def _entries(document: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    if not str(document.get("schema", "")).startswith("bufferstand/evaluation/1"):
        raise BadInput(
            "not an evaluation document", place="schema", remedy="make one with “bufferstand evaluate --json”"
        )
    return {str(entry["run"]["id"]): entry for entry in document.get("runs") or []}


def _place(file: Path, given: Path) -> str:
    """Return where a run file is below the folder that is reported on; a file that is given is only named."""
    return file.relative_to(given).as_posix() if file != given and file.is_relative_to(given) else file.name


def _report_run(
    number: int, loaded: Loaded, entries: Mapping[str, Mapping[str, Any]], given: Path
) -> ReportRun:
    run = loaded.run
    evaluated = entries.get(run.id)
    if evaluated is None:
        raise BadInput(
            f"the evaluation document lacks run “{run.id}”",
            file=run.path,
            remedy="evaluate the whole folder again",
        )
    stated = evaluated["run"].get("sha256")
    if stated and stated != run.sha256:
        raise BadInput(
            f"the evaluation document is of another content of run “{run.id}”",
            file=run.path,
            remedy="evaluate the run file again",
        )
    return ReportRun(
        number=number,
        file=run.path.name,
        sha256=file_hash(run.path),
        metadata=run.metadata,
        events=tuple((event.time_s, event.kind, event.text) for event in run.events),
        strokes=tuple(event.data for event in run.events if "reached_mean_mm" in event.data),
        forces=tuple(event.data for event in run.events if "reached_max_kN" in event.data),
        evaluated=evaluated,
        record=loaded.record,
        problem=loaded.problem,
        place=_place(run.path, given),
    )
