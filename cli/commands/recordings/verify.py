"""``bufferstand verify``: is what was recorded still what was recorded?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING
from bufferstand.foundation import BadInput, ExitStatus

if TYPE_CHECKING:
    from bufferstand.recording.runfile import ContentFault


@click.command("verify", epilog="Example:  bufferstand verify campaign/runs")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
def command(paths: tuple[Path, ...]) -> int:
    """Check that run files are whole and unaltered, by their checksums; PATH is a file or a folder.

    Journals that a crash left there are checked, too: what of them can be recovered.

    Exit status 0 if every file is; 2 if one is damaged, altered or no run file.
    """
    from bufferstand.recording.finding import unsealed

    journals = unsealed(paths)
    damaged = sum(_told(journal, _of_journal(journal), good="whole") for journal in journals)
    runs = _runs_beside(paths, journals)
    damaged += sum(_told(run, _of_run(run), good="whole and unaltered") for run in runs)
    if damaged:
        click.echo(f"bufferstand: {damaged} damaged or altered; do not evaluate them", err=True)
        return ExitStatus.BAD_INPUT
    return ExitStatus.DONE


def _runs_beside(paths: Sequence[Path], journals: Sequence[Path]) -> list[Path]:
    """Return the run files that paths stand for; a folder with nothing but journals is no error here."""
    from bufferstand.recording.finding import run_files

    files: list[Path] = []
    for path in paths:
        try:
            files += [] if path in journals else run_files([path])
        except BadInput:
            if not any(journal.is_relative_to(path) for journal in journals):
                raise
    return list(dict.fromkeys(files))


def _of_run(path: Path) -> list[ContentFault]:
    from bufferstand.recording.runfile import ContentFault
    from bufferstand.recording.sealing import verify

    try:
        return verify(path)
    except BadInput as error:
        return [ContentFault("fault", error.place or "file", error.problem)]


def _of_journal(path: Path) -> list[ContentFault]:
    from bufferstand.recording.runfile import ContentFault
    from bufferstand.recording.sealing import DAMAGED_SUFFIX, is_in_use, verify_journal

    if path.suffix == DAMAGED_SUFFIX:
        text = "records behind the damage were not recovered; what lies before it is in the run file"
        return [ContentFault("fault", "journal", text)]
    if is_in_use(path):
        return [ContentFault("note", "journal", "is being recorded, or sealed")]
    try:
        return verify_journal(path)
    except BadInput as error:
        return [ContentFault("fault", error.place or "journal", error.problem)]


def _told(path: Path, findings: Sequence[ContentFault], *, good: str) -> bool:
    """Say what was found of a file; return whether it is damaged."""
    damaged = any(finding.level == "fault" for finding in findings)
    click.echo(f"{path}: {'DAMAGED OR ALTERED' if damaged else good}")
    for finding in findings:
        click.echo(f"    {finding.level}: {finding.place}: {finding.text}")
    return damaged
