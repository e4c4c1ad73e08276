"""``bufferstand note``: what the operator saw, before, during or after a campaign."""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.options import FOLDER
from bufferstand.daq.operator import ask
from bufferstand.foundation import BadInput


@click.command("note", epilog='Example:  bufferstand note campaign "rubber dust below the spring, plate 3"')
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.argument("text", metavar="TEXT")
def command(folder: Path, text: str) -> None:
    """Add a note to a campaign: DIR is its --out folder, made if it is not there yet.

    While the campaign runs, the note becomes an event of the run under way, too. All are in DIR/notes.jsonl.
    """
    from bufferstand.daq.operator import add_note
    from bufferstand.foundation.files import make_folder

    if (answer := ask(folder, {"note": text})) is not None:
        click.echo(answer)
        return
    try:
        make_folder(folder)
        add_note(folder, text)
    except OSError as error:
        raise BadInput(f"the note could not be written: {error.strerror}", file=folder) from None
    click.echo("noted")
