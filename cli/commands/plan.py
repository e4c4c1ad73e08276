"""``bufferstand plan``: what a campaign would do."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import click

from cli.campaigns import prepare
from cli.model_pictures import save_picture
from cli.options import EXISTING, FILE, show_table, write_json
from cli.plan_picture import picture_plan
from foundation.durations import duration_text
from protocols.plan import HEADER, Plan
from protocols.standard_conditions import missed_conditions

LEFT_ALIGNED = {"name", "duration"}


@click.command("plan", epilog="Example:  bufferstand plan sample_runs/demo.toml")
@click.argument("campaign", metavar="CAMPAIGN.toml", type=EXISTING)
@click.option(
    "--picture",
    metavar="FILE.svg|png",
    type=FILE,
    help="Draw the required stroke over time, as the paper's Fig. 4, and the expected temperature.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the plan as JSON and nothing else.")
def command(campaign: Path, picture: Path | None, as_json: bool) -> None:
    """Dry run: every step with prestress, amplitude, frequency, force, heat, temperature, duration, disk.

    A step that breaks a limit is refused with its name, the limit and the nearest admissible value.
    """
    plan = prepare(campaign).plan
    missed = missed_conditions(plan.steps, plan.specimen, datetime.now(UTC))
    if picture is not None:
        save_picture(picture_plan(plan), picture)
    if as_json:
        write_json(plan.as_dict() | {"warnings": missed}, "-")
        return
    show_plan(plan)
    for text in missed:
        click.echo(f"warning: {text}")
    if picture is not None:
        click.echo(f"{picture} written")


def show_plan(plan: Plan) -> None:
    """Print the plan as a table, its totals and its notes."""
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
