"""``bufferstand report``: what a customer or an authority gets."""

from __future__ import annotations

from pathlib import Path

import click

from cli.judging import Judging, judging_options
from cli.options import EXISTING, out_option, warn
from evaluation.report.writing import pdf_available, write_report


@click.command("report", epilog="Example:  bufferstand report campaign --out campaign/report")
@click.argument("path", metavar="PATH", type=EXISTING)
@out_option("Folder for the report.")
@judging_options
def command(path: Path, out: Path, judging: Judging) -> None:
    """Write the test report (HTML and PDF) of a run or a campaign; PATH is a run file or a campaign's folder.

    What only the laboratory knows (address, customer, who authorises) is read from report.toml in the folder;
    a report is marked as a draft until all of it is there. What runs are judged by is as in evaluate.
    """
    formats = ["html", "pdf"] if pdf_available() else ["html"]
    if "pdf" not in formats:
        warn("no PDF: typst is not installed; pip install 'bufferstand[pdf]' adds it")
    written = write_report(
        path,
        out,
        formats=formats,
        decision_rule=judging.decision_rule,
        limit_set=judging.limit_set,
        moving_mass_kg=judging.moving_mass_kg,
        moving_mass_accuracy_percent=judging.moving_mass_accuracy_percent,
        force_cell=judging.force_cell,
        inspections=judging.inspections,
    )
    for file in written:
        click.echo(file)
