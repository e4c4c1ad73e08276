"""A plan against what happened: the table, the totals, and what was learned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from bufferstand.cli.terminal_tables import show_table
from bufferstand.daq.campaign_folder import (
    AS_RUN_NAME,
    REPORT_HEADER,
    AsRun,
    load_record,
    read_as_run,
    replaced_sentence,
    report_rows,
    rows_in_force,
    totals,
)
from bufferstand.foundation import BadInput, duration_text
from bufferstand.protocols.planning import Plan


def rows_against(plan: Plan, folder: Path) -> tuple[AsRun, ...]:
    """Return the steps of a campaign's folder as they were run; those that edits have replaced are left out.

    That is said on standard error.

    Raises
    ------
    BadInput
        If nothing was run there, or another campaign.
    """
    rows = read_as_run(folder)
    if not rows:
        raise BadInput(
            f"no step was run here ({AS_RUN_NAME} is not there or empty)",
            file=folder,
            remedy="give the --out folder of a run",
        )
    record, planned = load_record(folder), {step.plan_hash for step in plan.steps}
    steps = () if record is None else record.steps
    known = planned.union(*(step.hashes for step in steps if step.plan_hash in planned))
    replaced = () if record is None else [row for row in rows if row.plan_hash not in record.hashes]
    strange = [row for row in rows if not (row.pause or row.plan_hash in known or row in replaced)]
    if strange:
        raise BadInput(
            f"“{strange[0].name}”, which was run here, is no step of {plan.campaign.path}",
            file=folder,
            place=AS_RUN_NAME,
            remedy=f"plan the campaign that was run: {folder / 'inputs'} holds a copy of its file",
        )
    kept = rows_in_force(rows, known)
    if not kept:
        raise BadInput(
            f"of what was run here nothing is a step of {plan.campaign.path}",
            file=folder,
            place=AS_RUN_NAME,
            remedy="edits have replaced it: plan the files that it was run by (inputs-before)",
        )
    if gone := replaced_sentence(rows, kept):
        click.echo(gone, err=True)
    return kept


def as_run_document(rows: Sequence[AsRun]) -> dict[str, Any]:
    """Return it as JSON-ready data."""
    last = rows[-1]
    return {
        "steps": [asdict(row) for row in rows],
        "totals": asdict(totals(rows)),
        "learned": {"heating": last.heating, "cooling": last.cooling},
        "left_s": last.left_s,
        "planned_left_s": last.planned_left_s,
    }


def show_as_run(rows: Sequence[AsRun]) -> None:
    """Print planned against measured, step by step, and the totals."""
    columns = [(head, "left" if head == "name" else "right") for head in REPORT_HEADER]
    show_table(columns, report_rows(rows), title="planned against measured")
    last = rows[-1]
    click.echo()
    for row in rows:
        if row.warmed is not None:
            click.echo(f"step {row.index}: {row.warmed.sentence()}")
    click.echo(totals(rows).sentence())
    click.echo(
        f"learned: heating × {last.heating:.2f}, cooling × {last.cooling:.2f} of the model; left: "
        f"{duration_text(last.left_s)} as learned, {duration_text(last.planned_left_s)} by the first plan"
    )
