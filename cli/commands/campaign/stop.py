"""``bufferstand stop``: end a running campaign from another terminal."""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.options import EXISTING
from bufferstand.daq.operator import ask
from bufferstand.foundation import BadInput


@click.command("stop", epilog="Example:  bufferstand stop campaign --after step")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option("--after", type=click.Choice(["cycle", "step"]), help="End what is under way first.")
def command(folder: Path, after: str | None) -> None:
    """Stop the campaign that runs in DIR: now (safe stop at once), after the cycle, or after the step.

    The same as Ctrl-C, c and s in its own terminal, and as the signals SIGINT, SIGUSR1 and SIGUSR2.
    """
    answer = ask(folder, {"stop": after or "now"})
    if answer is None:
        raise BadInput("no campaign runs in this folder", file=folder, remedy="give a run's --out folder")
    click.echo(answer)
