"""``bufferstand samples``: the shipped samples as files of one's own."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from bufferstand.cli.options import FOLDER
from bufferstand.cli.samples import copy_samples
from bufferstand.foundation import ExitStatus, program

_NEXT = """{count} files in {folder}; {readme} says what each is. Next:
  {program} plan {folder}/demo.toml
  {program} run {folder}/en15551.toml --out campaign --simulate --speed 6
  {program} evaluate {folder}/runs"""


@click.command("samples", epilog="Example:  bufferstand samples")
@click.argument("folder", metavar="[DIR]", type=FOLDER, default="sample_runs")
def command(folder: Path) -> int:
    """Copy the shipped samples to DIR (default sample_runs): campaigns, a stand, specimens, spring models,
    recorded runs and the shipped limit sets, to try the commands on and to begin files of your own from.

    No file that is there is written over: if one is, nothing is copied.
    """
    copied = copy_samples(folder)
    where = quote(str(folder))
    click.echo(
        _NEXT.format(
            count=len(copied), folder=where, readme=quote(str(folder / "README.md")), program=program()
        )
    )
    return ExitStatus.DONE
