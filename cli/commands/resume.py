"""``bufferstand resume``: go on where a campaign ended."""

from __future__ import annotations

from pathlib import Path

import click

from cli.campaigns import prepare
from cli.commands.run import finish
from cli.options import EXISTING
from cli.running import perform
from daq.folder import load_record
from foundation.errors import BadInput


@click.command("resume", epilog="Example:  bufferstand resume campaign --simulate --speed 10")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option("--simulate", is_flag=True, help="On a simulated stand, started for this campaign.")
@click.option(
    "--speed",
    type=click.FloatRange(min=0.01, max=100.0),
    default=1.0,
    help="Stand time in multiples of real time, for a simulated stand (default 1).",
)
def command(folder: Path, simulate: bool, speed: float) -> int:
    """Go on with a stopped, crashed or too hot campaign; DIR is its folder.

    Steps that are complete are not repeated. After a temperature stop the specimen must have cooled to the
    resume temperature of the campaign file.
    """
    record = load_record(folder)
    if record is None:
        raise BadInput(
            "no campaign.json in this folder",
            file=folder,
            remedy="give the --out folder of a run",
        )
    devices_from = Path(record.stand_folder) if record.stand_folder else None
    prepared = prepare(folder / record.campaign_file, devices_from=devices_from)
    return finish(perform(prepared, folder, simulate=simulate, speed=speed), folder)
