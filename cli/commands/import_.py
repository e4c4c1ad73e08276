"""``bufferstand import``: foreign records into run files."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click

from cli.options import EXISTING, FILE, key_values, out_option, warn
from foundation.errors import BadInput, ExitStatus
from foundation.specimen import Kind
from recording.importing import ImportOptions, import_csv


@click.command(
    "import",
    epilog='Example:  bufferstand import test.csv --out runs --column stroke="Displacement [in]"',
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=EXISTING)
@out_option("Folder for the run files.")
@click.option("--kind", type=click.Choice(get_args(Kind)), help="Kind of the test.")
@click.option(
    "--column", "columns", multiple=True, metavar="NAME=HEADER", help="Which column is time, stroke, force, …"
)
@click.option("--unit", "units", multiple=True, metavar="NAME=UNIT", help="Unit of a column, e.g. force=kip.")
@click.option("--invert", "inverted", multiple=True, metavar="NAME", help="Turn a column's sign.")
@click.option("--specimen", metavar="FILE.toml", type=FILE, help="Facts of specimen and test.")
@click.option("--sample-rate", metavar="HZ", type=float, help="For a record without a time column.")
def command(
    files: tuple[Path, ...],
    out: Path,
    kind: str | None,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    inverted: tuple[str, ...],
    specimen: Path | None,
    sample_rate: float | None,
) -> int:
    """Turn foreign records into run files. Nothing is guessed in silence.

    A CSV needs no options if its header reads  time [s],stroke [mm],force [kN]  or has other known units in
    the brackets; separators are , ; and tab.
    """
    options = ImportOptions(
        kind=kind,
        column=key_values(columns, "--column", "NAME=HEADER"),
        unit=key_values(units, "--unit", "NAME=UNIT"),
        invert=inverted,
        specimen=specimen,
        sample_rate_hz=sample_rate,
    )
    refused = 0
    for file in files:
        try:
            imported = import_csv(file, out, options)
        except BadInput as error:
            if len(files) == 1:
                raise
            click.echo(f"bufferstand: {error}", err=True)
            refused += 1
            continue
        for text in imported.warnings:
            warn(f"{file}: {text}")
        click.echo(f"{file} -> {imported.path}")
    if refused:
        click.echo(f"bufferstand: {refused} of {len(files)} files could not be imported", err=True)
        return ExitStatus.BAD_INPUT
    return ExitStatus.DONE
