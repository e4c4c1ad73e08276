"""``bufferstand runs``: what has been recorded, and which runs match an expression?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import EXISTING, FOLDER, check_named, figure, warn, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import BadInput, ExitStatus
from bufferstand.foundation.files import readable
from bufferstand.recording.finding import NO_FOLDER, default_folder

if TYPE_CHECKING:
    from bufferstand.recording.finding import Query, RunFileFacts

    Found = tuple[RunFileFacts, Mapping[str, Any]]


_STANDS = {True: "simulated", False: "real", None: "—"}


@click.command(
    "runs",
    epilog="Example:  bufferstand runs archive --where 'prestress == 50 and damping < 0.4'",
)
@click.argument("path", metavar="PATH", type=EXISTING)
@click.option("--where", metavar="EXPR", help="Only runs that match; names are listed in docs/archives.md.")
@click.option("--json", "json_file", metavar="FILE|-", help="Write them as JSON; - is standard output.")
@click.option(
    "--cache",
    "folder",
    metavar="DIR",
    type=FOLDER,
    help="Where the index lies (default: the user's cache folder).",
)
@click.option("--no-cache", is_flag=True, help="Open every run file; neither use nor keep an index.")
def command(path: Path, where: str | None, json_file: str | None, folder: Path | None, no_cache: bool) -> int:
    """List recorded runs with their key facts; PATH is a run file or a folder of them.

    --where takes comparisons of names with values, joined by and, or, not. Of results (damping, verdict …)
    it asks the evaluation with default settings; what is not known yet is evaluated first. Of a run with
    several steps each is listed that matches (FILE#STEP).

    What cannot be read is named and does not hide the others; exit status 2 if nothing can be.
    """
    from bufferstand.recording.finding import indexed_runs, list_runs, parse_query, recorded_facts

    check_named(json_file)
    place = None if no_cache else folder or default_folder()
    if place is None and not no_cache:
        warn(NO_FOLDER)
    query = None if where is None else parse_query(where, _fields())
    listed = list_runs(path) if place is None else indexed_runs(path, place)
    _refuse_single(path, listed)
    sound = [run for run in listed if run.problem is None]
    results = _results(query, sound, place)
    found: list[Found] = []
    for run in sound:
        recorded = recorded_facts(run)
        for own in results.get(readable(run.path), [{}]):  # one, or one a step
            facts = {**recorded, **own}
            if query is None or query.matches(facts):
                found.append((run, facts))
    asked = _result_names(query)
    if json_file is not None:
        write_json(_document(where, found, listed, asked), json_file)
    if json_file != "-":
        _show(path, found, asked)
        if query is not None:
            click.echo(f"\n{len({run.path for run, _ in found})} of {len(sound)} runs match")
    _say_what_is_wrong(path, listed)
    return ExitStatus.DONE


def _refuse_single(path: Path, listed: Sequence[RunFileFacts]) -> None:
    """Refuse a file that is named itself and cannot be read, as every other command does."""
    if not path.is_dir() and listed[0].problem is not None:
        remedy = (
            "name a run file (*.h5) or a folder of them; “bufferstand import” makes runs of foreign records"
        )
        raise BadInput(listed[0].problem, file=readable(path), remedy=remedy)


def _say_what_is_wrong(path: Path, listed: Sequence[RunFileFacts]) -> None:
    unread = [run for run in listed if run.problem is not None]
    for run in unread:
        warn(f"{readable(run.path)}: {run.problem}")
    if len(unread) == len(listed):
        raise BadInput(
            f"none of its {len(unread)} run files can be read",
            file=readable(path),
            remedy="the warnings say what is wrong with each",
        )


def _fields() -> Mapping[str, Any]:
    from bufferstand.evaluation.archive import FIELDS

    return FIELDS


def _result_names(query: Query | None) -> list[str]:
    if query is None:
        return []
    from bufferstand.evaluation.archive import RESULTS

    return [name for name in RESULTS if name in query.facts]


def _results(
    query: Query | None, runs: Sequence[RunFileFacts], place: Path | None
) -> Mapping[str, Sequence[Mapping[str, Any]]]:
    """Return the results of runs by their file (readable), of each step its own, if they are asked for."""
    if not _result_names(query) or not runs:
        return {}
    from bufferstand.cli.evaluation import progress_bar
    from bufferstand.evaluation.archive import (
        Cache,
        EvaluationSettings,
        LocalWorkers,
        RequestedParts,
        evaluate_archive,
        results_by_path,
        software,
    )

    settings = EvaluationSettings()
    cache = None if place is None else Cache(place, settings.sha256, software().sha256)
    try:
        with progress_bar() as report:
            evaluation = evaluate_archive(
                [run.path for run in runs],
                settings,
                LocalWorkers(),
                cache,
                wanted=RequestedParts(entries=False, rows=False),
                report=report,
            )
    finally:
        if cache is not None:
            cache.close()
    for failure in evaluation.failures:
        warn(f"{failure.path}: no results: {failure.problem}")
    return results_by_path(evaluation)


def _document(
    where: str | None, found: Sequence[Found], listed: Sequence[RunFileFacts], asked: Sequence[str]
) -> dict[str, Any]:
    recorded = ("path", "id", "kind", "status", "started_utc", "specimen", "campaign", "operator", "step",
                "prestress_mm", "amplitude_mm", "frequency_Hz", "sha256")  # fmt: skip
    return {
        "schema": "bufferstand/runs/1",
        "where": where,
        "runs": [
            {
                **{name: facts.get(name) for name in (*recorded, *asked)},
                "simulated": run.simulated,
                **({"part": facts["part"]} if "part" in facts else {}),
            }
            for run, facts in found
        ],
        "problems": [
            {"path": readable(run.path), "problem": run.problem} for run in listed if run.problem is not None
        ],
    }


def _show(path: Path, found: Sequence[Found], asked: Sequence[str]) -> None:
    show_table(
        [
            ("file", "left"),
            ("kind", "left"),
            ("status", "left"),
            ("started (UTC)", "left"),
            ("stand", "left"),
            ("specimen", "left"),
            ("step", "left"),
            ("prestress mm", "right"),
            ("amplitude mm", "right"),
            ("frequency Hz", "right"),
            *((name, "right") for name in asked),
        ],
        [
            (
                readable(run.path.relative_to(path) if path.is_dir() else run.path.name)
                + (f"#{facts['part']}" if facts.get("part") else ""),
                run.kind,
                run.status,
                (run.started_utc or "—")[:19].replace("T", " "),
                _STANDS[run.simulated],
                run.specimen_id or "—",
                run.step or "—",
                figure(run.prestress_mm, 1),
                figure(run.amplitude_mm, 1),
                figure(run.frequency_Hz, 3),
                *(_cell(facts.get(name)) for name in asked),
            )
            for run, facts in found
        ],
    )


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value or "—")
