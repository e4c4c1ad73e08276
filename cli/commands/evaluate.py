"""``bufferstand evaluate``: what recorded runs mean."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click

from cli.evaluation_view import show_evaluation
from cli.options import EXISTING, FILE, write_json
from evaluation.document import evaluate_paths
from evaluation.inertia import ForceCell
from evaluation.requirements.checklist import asked_items
from evaluation.requirements.inspection import load_inspection
from evaluation.requirements.limit_set import find_limit_set, shipped_limit_set
from evaluation.results import DecisionRule
from evaluation.table import write_table
from foundation.errors import ExitStatus


@click.command("evaluate", epilog="Example:  bufferstand evaluate campaign --json - --table cycles.csv")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the evaluation as JSON; - is standard output."
)
@click.option("--table", metavar="FILE", type=FILE, help="Write a row a cycle as .csv or .parquet.")
@click.option(
    "--decision-rule",
    type=click.Choice(get_args(DecisionRule)),
    default="simple",
    help="How a value near a limit is judged (default simple acceptance).",
)
@click.option(
    "--moving-mass",
    metavar="KG",
    type=float,
    help="Correct for the inertia of this mass between load cell and specimen (default: the stand file's).",
)
@click.option(
    "--moving-mass-accuracy",
    metavar="PERCENT",
    type=float,
    help="Limit of the error of that mass (default: the stand file's, else 5).",
)
@click.option(
    "--force-cell",
    type=click.Choice(get_args(ForceCell)),
    help="Where the load cell is: it pushes the moving mass, or stands behind the specimen "
    "(default: the stand file's, else moving-side).",
)
@click.option(
    "--limits",
    metavar="FILE.toml",
    help="Judge every run by this limit set: a file, or the name of a shipped one (default en15551-105mm).",
)
@click.option(
    "--inspection",
    "inspections",
    metavar="FILE.toml",
    type=FILE,
    multiple=True,
    help="What an inspector saw and measured by hand; goes with the runs of its specimen.",
)
@click.option("--strict", is_flag=True, help="End with status 1 if a specimen failed.")
def command(
    paths: tuple[Path, ...],
    json_file: str | None,
    table: Path | None,
    decision_rule: DecisionRule,
    moving_mass: float | None,
    moving_mass_accuracy: float | None,
    force_cell: ForceCell | None,
    limits: str | None,
    inspections: tuple[Path, ...],
    strict: bool,
) -> int:
    """Evaluate runs, campaigns or whole archives; PATH is a run file or a folder of them.

    Energies, damping, stiffness and speeds a cycle with their uncertainty, trends over frequency, and the
    requirements of EN 15551 or of another limit set. Exit status 0 whatever the verdict, unless --strict.
    """
    limit_set = shipped_limit_set() if limits is None else find_limit_set(limits)
    document = evaluate_paths(
        paths,
        decision_rule=decision_rule,
        limit_set=limit_set,
        moving_mass_kg=moving_mass,
        moving_mass_accuracy_percent=moving_mass_accuracy,
        force_cell=force_cell,
        inspections=[load_inspection(file, asked_items(limit_set)) for file in inspections],
    )
    if json_file is not None:
        write_json(document, json_file)
    if table is not None:
        write_table(document, table)
    if json_file != "-":
        show_evaluation(document)
    failed = any(entry["verdict"] in ("fail", "conditional-fail") for entry in document["runs"])
    return ExitStatus.SPECIMEN_FAILED if strict and failed else ExitStatus.DONE
