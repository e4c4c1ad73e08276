"""``bufferstand run``: do what the campaign file says."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import EXISTING, monitor_option, out_option
from foundation.errors import BadInput

if TYPE_CHECKING:
    from daq.monitor.process import Address
    from daq.runner import CampaignOutcome


@click.command(
    "run",
    epilog="Example:  bufferstand run sample_runs/en15551.toml --out campaign --simulate --speed 10",
)
@click.argument("campaign", metavar="CAMPAIGN.toml", type=EXISTING)
@out_option("Folder of the campaign: one HDF5 file a run in DIR/runs, and what is needed to resume.")
@click.option("--simulate", is_flag=True, help="On a simulated stand, started for this campaign.")
@click.option(
    "--speed",
    type=click.FloatRange(min=0.01, max=100.0),
    default=1.0,
    help="Stand time in multiples of real time, for a simulated stand (default 1).",
)
@monitor_option
def command(campaign: Path, out: Path, simulate: bool, speed: float, monitor: Address | None) -> int:
    """Run a campaign with live progress; record one HDF5 file a run.

    Ctrl-C, SIGTERM and SIGHUP stop it: zero force, valve off, files whole. Exit status 0 when complete, 3
    when a limit or the operator stopped it, 4 on a fault of a device.
    """
    from cli.campaigns import prepare
    from cli.running import perform
    from daq.folder import load_record

    prepared = prepare(campaign)
    if load_record(out) is not None:
        raise BadInput("this folder holds a campaign already", file=out, remedy="resume it or choose another")
    outcome = perform(prepared, out, simulate=simulate, speed=speed, monitor=monitor)
    return finish(outcome, out)


def finish(outcome: CampaignOutcome, out: Path) -> int:
    """Say in one line how it ended and what comes next; return the exit status."""
    from daq.as_run import read_as_run, totals

    kept = f"{len(outcome.runs)} run file{'' if len(outcome.runs) == 1 else 's'} in {out / 'runs'}"
    if outcome.status == "complete":
        click.echo(f"campaign complete: {kept}; next: bufferstand report {out} --out {out / 'report'}")
        if outcome.exit_status:
            click.echo(f"bufferstand: {outcome.reason}", err=True)
        if rows := read_as_run(out):
            click.echo(f"{totals(rows).sentence()}; step by step: bufferstand plan … --against {out}")
    else:
        safe = outcome.safe_stop.line if outcome.safe_stop is not None else "the stand was not touched"
        told = (
            outcome.reason
            if outcome.reason.startswith(outcome.status)
            else f"{outcome.status}: {outcome.reason}"
        )
        click.echo(f"bufferstand: {told}; {safe}; {kept}", err=True)
    return int(outcome.exit_status)
