"""``bufferstand plan``: what a campaign would do."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import duration_text

if TYPE_CHECKING:
    from bufferstand.daq.campaign_folder import CampaignRecord
    from bufferstand.protocols.planning import Plan

LEFT_ALIGNED = {"name", "duration"}
IF_ANY = {"specimen mm", "piston mm"}
"""Columns that are shown where a step has something in them."""
LONG_STEP_S = 86400.0
"""A step that is expected to take longer is pointed at [s]."""


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
@click.option(
    "--learned",
    metavar="DIR",
    type=EXISTING,
    help="Show what is commanded for each stroke by what was learned in DIR, the --out folder of a run.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the plan as JSON and nothing else.")
def command(
    campaign: Path, picture: Path | None, against: Path | None, learned: Path | None, as_json: bool
) -> None:
    """Dry run: every step with prestress, amplitude, frequency, force, heat, temperature, duration, disk.

    A step that breaks a limit is refused with its name, the limit and the nearest admissible value.
    """
    from bufferstand.cli.campaign import (
        as_run_document,
        outage_leeway,
        picture_plan,
        prepare,
        rows_against,
        show_as_run,
    )
    from bufferstand.cli.model import save_picture
    from bufferstand.daq.campaign import outlook_rows, reached_rows, stroke_outlook
    from bufferstand.protocols.planning import missed_conditions

    prepared = prepare(campaign)
    plan = prepared.plan
    missed = [*missed_conditions(plan.steps, plan.specimen, datetime.now(UTC)), *_beyond_a_lab(plan)]
    rows = () if against is None else rows_against(plan, against)
    outlook = [] if learned is None else stroke_outlook(plan, learned)
    if picture is not None:
        save_picture(picture_plan(plan), picture)
    if as_json:
        as_run = {"as_run": as_run_document(rows)} if rows else {}
        strokes = {} if learned is None else {"strokes": [one.as_dict() for one in outlook]}
        outage = {"longest_outage_s": outage_leeway(prepared)[0]}
        write_json(plan.as_dict() | outage | {"warnings": missed} | as_run | strokes, "-")
        return
    if rows:
        show_as_run(rows)
        if against is not None and (reached := reached_rows(against)):
            show_strokes(reached, "strokes, as they were run")
        return
    show_plan(plan)
    click.echo(f"note: {outage_leeway(prepared)[1]}")
    if learned is not None:
        show_strokes(outlook_rows(outlook), f"strokes, by what was learned in {learned}")
        for text in dict.fromkeys(text for one in outlook for text in one.said):
            click.echo(f"note: {text}")
    for text in missed:
        click.echo(f"warning: {text}")
    if picture is not None:
        click.echo(f"{picture} written")


def _beyond_a_lab(plan: Plan) -> list[str]:
    """Return what is admissible and cannot be meant: a step of days, more than the disk here takes."""
    said = [
        f"step {step.index} “{step.name}” takes {duration_text(step.expected_duration_s)}: "
        "look at its cycles, speed and times"
        for step in plan.steps
        if step.expected_duration_s > LONG_STEP_S
    ]
    free = shutil.disk_usage(Path.cwd()).free
    if plan.disk_bytes > free:
        said.append(
            f"at most {plan.disk_bytes / 1e6:.0f} MB are recorded, "
            f"and this folder's disk has {free / 1e6:.0f} MB free"
        )
    return said


def show_plan(plan: Plan) -> None:
    """Print the plan as a table, its totals and its notes."""
    from bufferstand.protocols.planning import HEADER

    rows = plan.rows()
    kept = [at for at, head in enumerate(HEADER) if head not in IF_ANY or any(row[at] for row in rows)]
    columns = [(HEADER[at], "left" if HEADER[at] in LEFT_ALIGNED else "right") for at in kept]
    show_table(
        columns,
        [tuple(row[at] for at in kept) for row in rows],
        title=plan.campaign.content.campaign.title or plan.campaign.id,
    )
    click.echo(
        f"\n{_counted(len(plan.steps))}, {duration_text(plan.duration_s)} if nothing stops them "
        f"({duration_text(plan.expected_duration_s)} expected), {_warmth(plan)}, "
        f"at most {plan.disk_bytes / 1e6:.0f} MB"
    )
    if plan.ordering is not None:
        click.echo(plan.ordering.sentence())
    for note in (*plan.assumptions, *plan.notes):
        click.echo(f"note: {note}")
    for text in plan.not_guarded:
        click.echo(f"not guarded: {text}")


def _counted(steps: int) -> str:
    return "1 step" if steps == 1 else f"{steps} steps"


def show_what_is_learned(plan: Plan, folder: Path, record: CampaignRecord) -> None:
    """Print what is commanded for the strokes that are left, by what the campaign has learned so far."""
    from bufferstand.daq.campaign import outlook_rows, stroke_outlook
    from bufferstand.daq.campaign_folder import left_to_do
    from bufferstand.daq.strokes import learned_in

    left = [step for step, _ in left_to_do(plan, record, folder)]
    if learned_in(folder) is None or not (rows := outlook_rows(stroke_outlook(plan, folder, left))):
        return
    show_strokes(rows, "strokes to come, by what was learned so far")


def show_strokes(rows: list[tuple[str, ...]], title: str) -> None:
    """Print what is asked, commanded and reached as a table."""
    from bufferstand.daq.campaign import HEADER

    click.echo()
    show_table([(head, "left" if head == "name" else "right") for head in HEADER], rows, title=title)


def _warmth(plan: Plan) -> str:
    heat = f"{plan.heat_J / 1000.0:.0f} kJ of heat" if plan.heat_J > 0.0 else "heat not known"
    return (
        f"{heat}, up to {plan.max_temperature_C:.1f} °C"
        if plan.knows_heat
        else f"{heat}, temperatures not known"
    )
