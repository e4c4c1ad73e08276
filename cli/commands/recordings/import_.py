"""``bufferstand import``: foreign records into run files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import click

from bufferstand.cli.options import EXISTING, FILE, FiniteRange, key_values, out_option, warn
from bufferstand.foundation import LOGGER_HZ, BadInput, ExitStatus, Kind


@click.command(
    "import",
    epilog='Example:  bufferstand import test.csv --out runs --column stroke="Displacement [in]"',
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=EXISTING)
@out_option("Folder for the run files.")
@click.option("--kind", type=click.Choice(get_args(Kind)), help="Kind of the test.")
@click.option("--mapping", metavar="FILE.toml", type=FILE, help="What a laboratory's export looks like.")
@click.option(
    "--column", "columns", multiple=True, metavar="NAME=HEADER", help="Which column is time, stroke, force, …"
)
@click.option("--unit", "units", multiple=True, metavar="NAME=UNIT", help="Unit of a column, e.g. force=kip.")
@click.option("--invert", "inverted", multiple=True, metavar="NAME", help="Turn a column's sign.")
@click.option("--specimen", metavar="FILE.toml", type=FILE, help="Facts of specimen and test.")
@click.option(
    "--sample-rate", metavar="HZ", type=FiniteRange(*LOGGER_HZ), help="For a record without a time column."
)
@click.option("--sheet", metavar="NAME", help="Sheet of a workbook.")
@click.option("--group", "groups", multiple=True, metavar="NAME", help="Group of channels (TDMS, MDF4).")
@click.option("--block", metavar="N", type=int, help="Which one, where a file holds several records.")
@click.option(
    "--salvage", is_flag=True, help="Keep what is sound: bad cells are no value, bad lines are left out."
)
def command(
    *,
    files: tuple[Path, ...],
    out: Path,
    kind: str | None,
    mapping: Path | None,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    inverted: tuple[str, ...],
    specimen: Path | None,
    sample_rate: float | None,
    sheet: str | None,
    groups: tuple[str, ...],
    block: int | None,
    salvage: bool,
) -> int:
    """Turn foreign records into run files. Nothing is guessed in silence.

    CSV and TSV, National Instruments TDMS, ASAM MDF4, Excel. A CSV needs no options if its header reads
    time [s],stroke [mm],force [kN]  or has other known units in the brackets; separators are , ; and tab.
    """
    from bufferstand.recording.foreign import ImportOptions, import_file

    options = ImportOptions(
        kind=kind,
        column=key_values(columns, "--column", "NAME=HEADER"),
        unit=key_values(units, "--unit", "NAME=UNIT"),
        invert=inverted,
        specimen=specimen,
        sample_rate_hz=sample_rate,
        mapping=mapping,
        sheet=sheet,
        groups=groups,
        block=block,
        salvage=salvage,
    )
    refused = 0
    for file in files:
        try:
            imported = import_file(file, out, options)
        except BadInput as error:
            if len(files) == 1:
                raise
            click.echo(f"bufferstand: {error}", err=True)
            refused += 1
            continue
        _show_decisions(file, imported.decisions)
        for text in imported.warnings:
            warn(f"{file}: {text}")
        click.echo(f"{file} -> {imported.path}")
    if refused:
        click.echo(f"bufferstand: {refused} of {len(files)} files could not be imported", err=True)
        return ExitStatus.BAD_INPUT
    return ExitStatus.DONE


def _show_decisions(file: Path, decided: Mapping[str, Any]) -> None:
    """Say on standard error how the record was read."""
    click.echo(f"{file}: {', '.join(_form(decided))}", err=True)
    width = max(len(name) for name in decided["columns"])
    for name, column in decided["columns"].items():
        group = f"{column['group']}/" if column.get("group") else ""
        turned = ", sign turned" if column["inverted"] else ""
        unit = f"{column['unit']} (unit: {column['unit_from']})"
        click.echo(f"  {name:<{width}} <- “{group}{column['header']}” in {unit}{turned}", err=True)
    if decided["ignored"]:
        click.echo(f"  not used: {', '.join(f'“{header}”' for header in decided['ignored'])}", err=True)


def _form(decided: Mapping[str, Any]) -> list[str]:
    """Return how a record is written, in words."""
    version = decided.get("mdf_version") or ""
    parts = [f"{decided['format']} {version}".strip()]
    words = {
        "encoding": "{}",
        "separator": "separator “{}”",
        "decimal": "decimal sign “{}”",
        "sheet": "sheet “{}”",
        "header_line": "headers in line {}",
        "units_line": "units in line {}",
        "block": "block {}",
    }
    parts += [form.format(decided[key]) for key, form in words.items() if decided.get(key)]
    if decided.get("groups"):
        parts.append("groups " + ", ".join(f"“{group}”" for group in decided["groups"]))
    if decided.get("mapping"):
        parts.append(f"mapping {decided['mapping']['file']}")
    clocks = dict.fromkeys(decided["time_from"].values())
    return [*parts, f"time from {', '.join(clocks)}", f"{decided['rows']} rows"]
