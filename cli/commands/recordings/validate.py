"""``bufferstand validate``: is this installation's evaluation right?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import FILE, FOLDER, out_option, warn
from bufferstand.foundation import ExitStatus
from bufferstand.foundation.files import json_object

if TYPE_CHECKING:
    from bufferstand.evaluation.validation import SetResult


@click.command("validate", epilog="Example:  bufferstand validate --out validation --by 'J. Novak'")
@out_option("Folder for the record (validation.json and validation.pdf).")
@click.option("--by", default="", metavar="NAME", help="Who validates.")
@click.option("--sets", metavar="DIR", type=FOLDER, help="Other sets than those that are shipped.")
@click.option(
    "--results",
    metavar="FILE.json",
    type=FILE,
    help="Judge these results of another program instead: runs of an evaluation by id of the set.",
)
def command(out: Path, by: str, sets: Path | None, results: Path | None) -> int:
    """Evaluate standard data sets with agreed values, and write the dated record of it.

    A laboratory files the record (ISO/IEC 17025, 7.11.2) and names it in report.toml: validation =
    "validation.json". The sets and what is agreed of them: docs/validation.md.

    Exit status 0 if every value is as agreed; 2 if one is not: the installation must not be used then.
    """
    from bufferstand.evaluation.report import write_validation
    from bufferstand.evaluation.validation import load_sets, shipped_sets, validate

    chosen = shipped_sets() if sets is None else load_sets(sets)
    other = None if results is None else _results(results)
    validation = validate(
        chosen, by=by, results=other, judged="" if results is None else results.stem, report=_tell
    )
    written = write_validation(validation, out)
    if len(written) == 2 and written[1].suffix != ".pdf":
        warn("no PDF: typst is not installed; the record is written as HTML")
    found = validation.checks - validation.missed
    click.echo(f"{found} of {validation.checks} agreed values found in {len(validation.results)} sets")
    for file in written:
        click.echo(file)
    if not validation.good:
        click.echo(f"bufferstand: {validation.missed} values are not as agreed; do not use it", err=True)
        return ExitStatus.BAD_INPUT
    return ExitStatus.DONE


def _tell(result: SetResult) -> None:
    """Say how a set came out."""
    click.echo(f"{result.standard.id}: {'as agreed' if result.good else 'NOT AS AGREED'}", err=True)
    if result.problem:
        click.echo(f"    {result.problem}", err=True)
        return
    for check in result.missed:
        agreed, unit = check.agreed, f" {check.agreed.unit}" if check.agreed.unit not in ("", "1") else ""
        within = "" if agreed.tolerance is None else f" ± {agreed.tolerance:.2g}"
        found = "nothing" if check.found is None else _shown(check.found)
        text = f"agreed {_shown(agreed.value)}{within}{unit}, found {found}"
        click.echo(f"    {agreed.of.text}: {agreed.what}: {text}", err=True)


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def _results(path: Path) -> Mapping[str, Any]:
    from bufferstand.foundation.settings import read_text

    return json_object(read_text(path), path, remedy="it holds results by the id of the set")
