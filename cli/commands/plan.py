"""``bufferstand plan``: what a campaign would do."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import EXISTING, FILE, show_table, write_json
from foundation.durations import duration_text

if TYPE_CHECKING:
    from protocols.plan import Plan

LEFT_ALIGNED = {"name", "duration"}


@click.command("plan", epilog="Example:  bufferstand plan sample_runs/demo.toml")
@click.argument("campaign", metavar="CAMPAIGN.toml", type=EXISTING)
@click.option(
    "--picture",
    metavar="FILE.svg|png",
    type=FILE,
    help="Draw the required stroke over time, as the paper's Fig. 4, and the expected temperature.",
)
@click.option(
    "--against",
    metavar="DIR",
    type=EXISTING,
    help="Show the plan against what happened when it was run: DIR is the --out folder of the run.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the plan as JSON and nothing else.")
def command(campaign: Path, picture: Path | None, against: Path | None, as_json: bool) -> None:
    """Dry run: every step with prestress, amplitude, frequency, force, heat, temperature, duration, disk.

    A step that breaks a limit is refused with its name, the limit and the nearest admissible value.
    """
    from cli.as_run_view import as_run_document, rows_against, show_as_run
    from cli.campaigns import prepare
    from cli.model_pictures import save_picture
    from cli.plan_picture import picture_plan
    from protocols.standard_conditions import missed_conditions

    plan = prepare(campaign).plan
    missed = missed_conditions(plan.steps, plan.specimen, datetime.now(UTC))
    rows = () if against is None else rows_against(plan, against)
    if picture is not None:
        save_picture(picture_plan(plan), picture)
    if as_json:
        as_run = {"as_run": as_run_document(rows)} if rows else {}
        write_json(plan.as_dict() | {"warnings": missed} | as_run, "-")
        return
    if rows:
        show_as_run(rows)
        return
    show_plan(plan)
    for text in missed:
        click.echo(f"warning: {text}")
    if picture is not None:
        click.echo(f"{picture} written")


def show_plan(plan: Plan) -> None:
    """Print the plan as a table, its totals and its notes."""
    from protocols.plan import HEADER

    columns = [(head, "left" if head in LEFT_ALIGNED else "right") for head in HEADER]
    show_table(columns, plan.rows(), title=plan.campaign.content.campaign.title or plan.campaign.id)
    click.echo(
        f"\n{len(plan.steps)} steps, {duration_text(plan.duration_s)} if nothing stops them "
        f"({duration_text(plan.expected_duration_s)} expected), {plan.heat_J / 1000.0:.0f} kJ of heat, "
        f"up to {plan.max_temperature_C:.1f} °C, at most {plan.disk_bytes / 1e6:.0f} MB"
    )
    if plan.ordering is not None:
        click.echo(plan.ordering.sentence())
    for note in plan.notes:
        click.echo(f"note: {note}")
