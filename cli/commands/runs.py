"""``bufferstand runs``: what has been recorded?"""

from __future__ import annotations

from pathlib import Path

import click

from cli.options import EXISTING, figure, show_table, warn
from recording.catalogue import list_runs


@click.command("runs", epilog="Example:  bufferstand runs campaign")
@click.argument("path", metavar="PATH", type=EXISTING)
def command(path: Path) -> None:
    """List recorded runs with their key facts; PATH is a run file or a folder of them."""
    facts = list_runs(path)
    show_table(
        [
            ("file", "left"),
            ("kind", "left"),
            ("status", "left"),
            ("started (UTC)", "left"),
            ("specimen", "left"),
            ("step", "left"),
            ("prestress mm", "right"),
            ("amplitude mm", "right"),
            ("frequency Hz", "right"),
        ],
        [
            (
                str(run.path.relative_to(path) if path.is_dir() else run.path.name),
                run.kind,
                run.status,
                (run.started_utc or "—")[:19].replace("T", " "),
                run.specimen_id or "—",
                run.step or "—",
                figure(run.prestress_mm, 1),
                figure(run.amplitude_mm, 1),
                figure(run.frequency_Hz, 3),
            )
            for run in facts
            if run.problem is None
        ],
    )
    for run in facts:
        if run.problem is not None:
            warn(f"{run.path}: {run.problem}")
