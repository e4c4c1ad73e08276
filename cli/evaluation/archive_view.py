"""An archive's evaluation shown in the terminal: how far it is, and what came out, in a screenful."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from bufferstand.cli.evaluation.view import show_conformity, show_together
from bufferstand.cli.options import figure
from bufferstand.cli.terminal_tables import show_table
from bufferstand.evaluation.archive import ArchiveEvaluation, ArchiveProgress, StoredRun
from bufferstand.evaluation.catalogue import QUANTITIES

_SPANS = [(entry.name, entry.shown.archive) for entry in QUANTITIES if entry.shown.archive is not None]
LEAST_RUNS = 3
"""Fewer are done before a bar is read."""


@contextmanager
def progress_bar() -> Iterator[Callable[[ArchiveProgress], None]]:
    """Show a bar on standard error, and none where that is no terminal or there is next to nothing to do."""
    from rich.console import Console  # noqa: PLC0415 - only where a bar is shown
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn  # noqa: PLC0415
    from rich.progress import Progress as Bar  # noqa: PLC0415

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("evaluating", total=None, visible=False)

        def report(progress: ArchiveProgress) -> None:
            text = "evaluating"
            if progress.reused:
                text += f", {progress.reused} known from before"
            if progress.failed:
                text += f", {progress.failed} refused"
            left = progress.total - progress.reused
            bar.update(
                task,
                description=text,
                total=left,
                completed=progress.done - progress.reused,
                visible=left >= LEAST_RUNS,
            )

        yield report


def show_archive(evaluation: ArchiveEvaluation) -> None:
    """Print an archive's evaluation by specimen and kind, its verdicts and trends."""
    groups: dict[tuple[str, str], list[StoredRun]] = {}
    for run in evaluation.runs:
        specimen = (run.facts["specimen"].get("id") or "—") + " (simulated)" * bool(run.facts["simulated"])
        groups.setdefault((specimen, run.facts["kind"]), []).append(run)
    show_table(
        [("specimen", "left"), ("kind", "left"), ("runs", "right"), ("cycles", "right"),
         *((words, "right") for _, column in _SPANS for words in (f"{column.heading}, from", "to")),
         ("verdicts", "left")],
        [
            (
                specimen,
                kind,
                str(len(runs)),
                str(sum(run.facts["cycles"] for run in runs)),
                *(text for name, column in _SPANS for text in _span(runs, name, column.decimals)),
                _verdicts(runs),
            )
            for (specimen, kind), runs in groups.items()
        ],
    )  # fmt: skip
    show_conformity(evaluation.tail)
    show_together(evaluation.tail)
    with_warnings = sum(run.facts["warnings"] > 0 for run in evaluation.runs)
    click.echo(
        f"\n{len(evaluation.runs)} runs evaluated, {evaluation.reused} of them known from before; "
        f"{with_warnings} have warnings (--json names them)"
    )


def _span(runs: list[StoredRun], name: str, digits: int) -> tuple[str, str]:
    values = [value for run in runs if (value := run.facts["means"][name][0]) is not None]
    return figure(min(values, default=None), digits), figure(max(values, default=None), digits)


def _verdicts(runs: list[StoredRun]) -> str:
    counted = Counter(run.facts["verdict"] for run in runs if run.facts["verdict"] is not None)
    return ", ".join(f"{number} {verdict}" for verdict, number in counted.items()) or "—"
