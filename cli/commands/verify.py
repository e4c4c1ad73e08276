"""``bufferstand verify``: is what was recorded still what was recorded?"""

from __future__ import annotations

from pathlib import Path

import click

from cli.options import EXISTING
from foundation.errors import BadInput, ExitStatus
from recording.catalogue import list_runs
from recording.verify import verify


@click.command("verify", epilog="Example:  bufferstand verify campaign/runs")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
def command(paths: tuple[Path, ...]) -> int:
    """Check that run files are whole and unaltered, by their checksums; PATH is a file or a folder.

    Exit status 0 if every file is; 2 if one is damaged, altered or no run file.
    """
    damaged = 0
    for path in (facts.path for given in paths for facts in list_runs(given)):
        try:
            findings = verify(path)
        except BadInput as error:
            click.echo(f"{path}: DAMAGED\n    {error.problem}")
            damaged += 1
            continue
        faults = [finding for finding in findings if finding.level == "fault"]
        damaged += bool(faults)
        click.echo(f"{path}: {'DAMAGED OR ALTERED' if faults else 'whole and unaltered'}")
        for finding in findings:
            click.echo(f"    {finding.level}: {finding.place}: {finding.text}")
    if damaged:
        click.echo(f"bufferstand: {damaged} damaged or altered; do not evaluate them", err=True)
        return ExitStatus.BAD_INPUT
    return ExitStatus.DONE
