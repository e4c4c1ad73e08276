"""``bufferstand model fit``: which spring is it?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import (
    EXISTING,
    FILE,
    SPRING_C,
    FiniteRange,
    ambient_option,
    in_a_row_option,
    warn,
    write_json,
)
from bufferstand.foundation import BadInput, ExitStatus, program
from bufferstand.foundation.files import write_text
from bufferstand.model.identification import NAMES

if TYPE_CHECKING:
    from bufferstand.model.identification import Identification


@click.command("fit", epilog="Example:  bufferstand model fit campaign/runs --out spring.toml")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option("--out", metavar="MODEL.toml", type=FILE, required=True, help="The model file to write.")
@click.option(
    "--missing-runs",
    "missing",
    metavar="FILE.toml",
    type=FILE,
    help="Write a campaign of the runs that would tell the rest: the same for every spring and stand. What "
    "tells most for a minute on this one: model next.",
)
@click.option(
    "--stand",
    metavar="STAND.toml",
    type=FILE,
    help="Stand file that the campaign names (default stand.toml beside it).",
)
@click.option(
    "--specimen",
    metavar="FILE.toml",
    type=FILE,
    help="Specimen file: full stroke, and the catalogue's curve beyond the runs. The campaign names it "
    "(default specimen.toml beside it).",
)
@click.option("--name", help="Name of the model (default the specimen's).")
@click.option("--knots", type=click.IntRange(3, 60), help="Points of the curves (default one every 5 mm).")
@click.option(
    "--reference",
    "reference_C",
    metavar="C",
    type=SPRING_C,
    help="Reference temperature of the curves (default 25, if the runs were that warm).",
)
@ambient_option("Temperature of the air (default: the run's own sensor).")
@click.option(
    "--without",
    multiple=True,
    type=click.Choice(NAMES),
    help="A parameter that is not to be identified; may be repeated.",
)
@in_a_row_option
@click.option(
    "--stop-stiffness",
    "stop_kN_per_mm",
    metavar="KN_PER_MM",
    type=FiniteRange(min=1e-6, max=1e6),
    help="Of the stop beyond the full stroke (default 500, which is assumed).",
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE|-",
    help="Write parameters, intervals (null where the runs do not tell one, and why) and cycles as JSON; "
    "- is standard output.",
)
@click.option("--no-validation", is_flag=True, help="Leave out the fit without every fifth cycle.")
def command(
    *,
    paths: tuple[Path, ...],
    out: Path,
    missing: Path | None,
    stand: Path | None,
    specimen: Path | None,
    name: str | None,
    knots: int | None,
    reference_C: float | None,
    ambient_C: float | None,
    without: tuple[str, ...],
    in_a_row: bool,
    stop_kN_per_mm: float | None,
    json_file: str | None,
    no_validation: bool,
) -> int:
    """Identify a spring model from recorded static and harmonic runs of one specimen.

    Prints every parameter with its 95 % interval, how well the model follows the runs (also cycles that it
    was not fitted to), and which parameters the runs do not tell, and why. Curves of runs that end short of
    the specimen's full stroke are continued to it (docs/identification.md).
    """
    from bufferstand.cli.model import (
        beyond_the_runs,
        document_of,
        read_runs,
        settings_of,
        show_identification,
        sittings,
    )
    from bufferstand.model import save_model
    from bufferstand.model.identification import identify

    if out.suffix.lower() != ".toml":
        raise BadInput("a model file ends with .toml", file="--out", remedy=f"write {out.stem}.toml")
    runs = read_runs(paths, ambient_C)
    drives = sittings(runs, chain=in_a_row)
    found = identify(
        drives,
        replace(
            beyond_the_runs(settings_of(runs, name), runs, specimen),
            knots=knots,
            reference_C=reference_C,
            without=without,
            stop_stiffness_kN_per_mm=stop_kN_per_mm,
            hold_out=not no_validation,
        ),
    )
    save_model(found.model, out)
    if json_file is not None:
        write_json(document_of(found), json_file)
    if json_file == "-":
        for note in found.notes:
            warn(note)
    else:
        show_identification(found)
        click.echo(f"written: {out}")
    if missing is not None:
        _write_missing(found, missing, stand, specimen, err=json_file == "-")
    return ExitStatus.DONE


def _write_missing(
    found: Identification, missing: Path, stand: Path | None, specimen: Path | None, *, err: bool
) -> None:
    """Write the campaign of the runs that would tell the rest, if there are any; say so."""
    from bufferstand.cli.model import seen_from
    from bufferstand.model.identification import missing_runs, needed

    if not needed(found):
        click.echo("no campaign written: these runs tell every parameter", err=err)
        return
    write_text(
        missing,
        missing_runs(
            found,
            stand=seen_from(missing, stand, "stand.toml"),
            specimen=seen_from(missing, specimen, "specimen.toml"),
        ),
    )
    click.echo(f"written: {missing} (see it with: {program()} plan {missing})", err=err)
    if stand is None or specimen is None:
        warn("the campaign names stand.toml and specimen.toml beside it, unless given as options")
