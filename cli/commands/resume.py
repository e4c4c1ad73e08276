"""``bufferstand resume``: go on where a campaign ended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.options import EXISTING, monitor_option
from foundation.errors import BadInput

if TYPE_CHECKING:
    from daq.monitor.process import Address


@click.command("resume", epilog="Example:  bufferstand resume campaign --simulate --speed 10")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option("--simulate", is_flag=True, help="On a simulated stand, started for this campaign.")
@click.option(
    "--speed",
    type=click.FloatRange(min=0.01, max=100.0),
    default=1.0,
    help="Stand time in multiples of real time, for a simulated stand (default 1).",
)
@monitor_option
def command(folder: Path, simulate: bool, speed: float, monitor: Address | None) -> int:
    """Go on with a stopped, crashed or too hot campaign; DIR is its folder.

    Steps that are complete are not repeated. After a temperature stop the specimen must have cooled to the
    resume temperature of the campaign file.
    """
    from cli.campaigns import prepare
    from cli.commands.run import finish
    from cli.running import perform
    from daq.folder import load_record

    record = load_record(folder)
    if record is None:
        raise BadInput(
            "no campaign.json in this folder",
            file=folder,
            remedy="give the --out folder of a run",
        )
    devices_from = Path(record.stand_folder) if record.stand_folder else None
    prepared = prepare(folder / record.campaign_file, devices_from=devices_from)
    return finish(perform(prepared, folder, simulate=simulate, speed=speed, monitor=monitor), folder)
