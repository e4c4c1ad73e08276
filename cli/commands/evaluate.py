"""``bufferstand evaluate``: what recorded runs mean."""

from __future__ import annotations

from pathlib import Path

import click

from cli.evaluation_view import show_evaluation
from cli.judging import Judging, judging_options
from cli.options import EXISTING, FILE, write_json
from evaluation.document import evaluate_paths
from evaluation.table import write_table
from foundation.errors import ExitStatus


@click.command("evaluate", epilog="Example:  bufferstand evaluate campaign --json - --table cycles.csv")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the evaluation as JSON; - is standard output."
)
@click.option("--table", metavar="FILE", type=FILE, help="Write a row a cycle as .csv or .parquet.")
@judging_options
@click.option("--strict", is_flag=True, help="End with status 1 if a specimen failed.")
def command(
    paths: tuple[Path, ...],
    json_file: str | None,
    table: Path | None,
    judging: Judging,
    strict: bool,
) -> int:
    """Evaluate runs, campaigns or whole archives; PATH is a run file or a folder of them.

    Energies, damping, stiffness and speeds a cycle with their uncertainty, trends over frequency, and the
    requirements of EN 15551 or of another limit set. Exit status 0 whatever the verdict, unless --strict.
    """
    document = evaluate_paths(
        paths,
        decision_rule=judging.decision_rule,
        limit_set=judging.limit_set,
        moving_mass_kg=judging.moving_mass_kg,
        moving_mass_accuracy_percent=judging.moving_mass_accuracy_percent,
        force_cell=judging.force_cell,
        inspections=judging.inspections,
    )
    judging.warn_of_unused([entry["run"] for entry in document["runs"]])
    if json_file is not None:
        write_json(document, json_file)
    if table is not None:
        write_table(document, table)
    if json_file != "-":
        show_evaluation(document)
    failed = any(entry["verdict"] in ("fail", "conditional-fail") for entry in document["runs"])
    return ExitStatus.SPECIMEN_FAILED if strict and failed else ExitStatus.DONE
