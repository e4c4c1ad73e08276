"""``bufferstand publish``: a campaign for others."""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.evaluation import JudgingOptions, judging_options
from bufferstand.cli.options import EXISTING, FILE, warn


@click.command("publish", epilog="Example:  bufferstand publish campaign --out campaign.zip")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option(
    "--out",
    metavar="FILE.zip|FOLDER",
    type=click.Path(path_type=Path),
    required=True,
    help="The crate: one file, or a new folder.",
)
@click.option(
    "--fields",
    "fields_file",
    metavar="FILE.toml",
    type=FILE,
    help="What only the laboratory knows (default publication.toml in DIR).",
)
@click.option(
    "--as-recorded",
    is_flag=True,
    help="Publish run files byte by byte, with the addresses, paths and logins that they name.",
)
@judging_options
def command(
    folder: Path, out: Path, fields_file: Path | None, as_recorded: bool, judging: JudgingOptions
) -> None:
    """Make an RO-Crate of a campaign: its runs, evaluation and report, described for archives as Zenodo.

    Title, description, licence and authors are read from publication.toml, report fields from report.toml.
    Runs that verify refuses are not published. What run files say of the machine is left out and said.
    The same folder gives the same bytes each time.
    """
    from bufferstand.evaluation.publication import Judging, publish

    published = publish(
        folder,
        out,
        fields=fields_file,
        judging=Judging(judging.options, judging.limit_set, judging.conformity, jobs=None),
        as_recorded=as_recorded,
    )
    for remark in published.remarks:
        warn(remark)
    if as_recorded:
        click.echo(
            f"{published.runs} run(s), as recorded: with the addresses, paths and logins that they name"
        )
    else:
        click.echo(f"{published.runs} run(s), without {', '.join(published.withheld) or 'anything left out'}")
    if published.names:
        click.echo(f"names in the run files: {', '.join(published.names)}")
    click.echo(out)
