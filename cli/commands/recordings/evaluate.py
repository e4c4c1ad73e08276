"""``bufferstand evaluate``: what recorded runs mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.evaluation import JudgingOptions, judging_options
from bufferstand.cli.options import FILE, FOLDER, check_named, open_output, warn
from bufferstand.evaluation.facts import DRAWS, check_draws
from bufferstand.foundation import BadInput, ExitStatus
from bufferstand.recording.finding import default_folder

if TYPE_CHECKING:
    from bufferstand.evaluation.archive import ArchiveEvaluation, Workers

SHOWN_RUNS = 40
"""More runs are shown as an overview; each one is in the tables and the JSON."""


@click.command("evaluate", epilog="Example:  bufferstand evaluate 'archive/**/*.h5' --table cycles.csv")
@click.argument("paths", metavar="PATH...", nargs=-1)
@click.option(
    "--from",
    "lists",
    metavar="FILE",
    type=FILE,
    multiple=True,
    help="Evaluate what a list names, a path a line.",
)
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the evaluation as JSON; - is standard output."
)
@click.option(
    "--table",
    "tables",
    metavar="FILE",
    type=FILE,
    multiple=True,
    help="Write a row a cycle as .csv, .parquet or .xlsx; may be given several times.",
)
@click.option("--run-table", metavar="FILE", type=FILE, help="Write a row a run as .csv, .parquet or .xlsx.")
@judging_options
@click.option(
    "--draws",
    metavar="N",
    type=click.IntRange(0),
    callback=lambda _context, _parameter, value: check_draws(value),
    default=DRAWS,
    help=f"Monte Carlo draws a run (default {DRAWS}; 0: no uncertainties, some times faster).",
)
@click.option(
    "--jobs",
    metavar="N",
    type=click.IntRange(1),
    help="Processes at work (default: one a core of this machine).",
)
@click.option(
    "--cluster", metavar="ADDRESS", help="Evaluate on the Dask cluster of this scheduler (tcp://HOST:PORT)."
)
@click.option(
    "--cache",
    "folder",
    metavar="DIR",
    type=FOLDER,
    help="Where results are kept (default: the user's cache folder).",
)
@click.option("--no-cache", is_flag=True, help="Evaluate everything again, and keep nothing.")
@click.option("--strict", is_flag=True, help="End with status 1 if a specimen failed.")
def command(
    paths: tuple[str, ...],
    lists: tuple[Path, ...],
    json_file: str | None,
    tables: tuple[Path, ...],
    run_table: Path | None,
    judging: JudgingOptions,
    draws: int,
    jobs: int | None,
    cluster: str | None,
    folder: Path | None,
    no_cache: bool,
    strict: bool,
) -> int:
    """Evaluate runs, campaigns or whole archives.

    PATH is a run file, a folder of them, a pattern ('archive/**/*.h5', quoted) or @FILE, a list of paths.

    Energies, damping, stiffness and speeds a cycle with their uncertainty, trends over frequency, and the
    requirements of EN 15551 or of another limit set. Only what changed since last time is evaluated. A run
    that cannot be evaluated is named and does not stop the others (status 2 at the end). Otherwise exit
    status 0 whatever the verdict, unless --strict.
    """
    from bufferstand.cli.evaluation import progress_bar, show_archive, show_evaluation
    from bufferstand.evaluation.archive import (
        Cache,
        EvaluationSettings,
        RequestedParts,
        document,
        evaluate_archive,
        find_runs,
        software,
        write_document,
        write_tables,
    )
    from bufferstand.evaluation.document import check_table_name

    for name in (*tables, *filter(None, (run_table,))):
        check_table_name(name)
    one_book = run_table in tables and run_table is not None and run_table.suffix.lower() == ".xlsx"
    check_named(json_file, *tables, None if one_book else run_table)
    if cluster is not None and jobs is not None:
        raise click.UsageError("--jobs is for this machine; how many work on a cluster, its workers say")
    files = find_runs(paths, lists)
    settings = EvaluationSettings(replace(judging.options, draws=draws), judging.limit_set)
    cache = None if no_cache else Cache(folder or default_folder(), settings.sha256, software().sha256)
    to_terminal = json_file != "-"
    shown_whole = len(files) <= SHOWN_RUNS
    try:
        with progress_bar() as report:
            evaluation = evaluate_archive(
                files,
                settings,
                _workers(cluster, jobs),
                cache,
                wanted=RequestedParts(
                    entries=json_file is not None or shown_whole,
                    rows=any(table.suffix.lower() == ".csv" for table in tables),
                ),
                report=report,
                conformity=judging.conformity,
            )
    finally:
        if cache is not None:
            cache.close()
    if cache is not None and cache.problem:
        warn(cache.problem)
    _refuse_single(files, evaluation)
    judging.warn_of_unused([run.facts for run in evaluation.runs])
    if json_file is not None:
        with open_output(json_file) as stream:
            write_document(evaluation, stream)
    for table in tables:
        write_tables(evaluation, table, run_table if table == run_table else None)
    if run_table not in tables:
        write_tables(evaluation, None, run_table)
    if to_terminal and shown_whole:
        show_evaluation(document(evaluation))
    elif to_terminal:
        show_archive(evaluation)
    else:  # who reads the JSON by a program sees it here, too
        for text in evaluation.warnings:
            warn(text)
    return _status(evaluation, len(files), strict=strict)


def _workers(cluster: str | None, jobs: int | None) -> Workers:
    from bufferstand.evaluation.archive import LocalWorkers

    if cluster is None:
        return LocalWorkers(jobs)
    from bufferstand.evaluation.archive import ClusterWorkers

    return ClusterWorkers(cluster, warn)


def _refuse_single(files: Sequence[Path], evaluation: ArchiveEvaluation) -> None:
    """Refuse a single file that cannot be evaluated, as every other command does."""
    if len(files) == 1 and evaluation.failures:
        (failure,) = evaluation.failures
        raise BadInput(failure.problem, file=failure.path)


def _status(evaluation: ArchiveEvaluation, files: int, *, strict: bool) -> ExitStatus:
    for failure in evaluation.failures:
        click.echo(f"bufferstand: {BadInput(failure.problem, file=failure.path)}", err=True)
    if evaluation.failures:
        click.echo(
            f"bufferstand: {len(evaluation.failures)} of {files} runs could not be evaluated",
            err=True,
        )
        return ExitStatus.BAD_INPUT
    failed = any(
        run.facts["verdict"] in ("fail", "conditional-fail") and purpose.purpose == "conformity"
        for run, purpose in zip(evaluation.runs, evaluation.decided.purposes, strict=True)
    )
    return ExitStatus.SPECIMEN_FAILED if strict and failed else ExitStatus.DONE
