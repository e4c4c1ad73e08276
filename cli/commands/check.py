"""``bufferstand check``: does every device of the stand answer, and can what it says be true?"""

from __future__ import annotations

from pathlib import Path

import click

from cli.options import EXISTING, show_table
from drivers.check import check_stand
from drivers.check_rows import Verdict
from drivers.stand_file import load_stand
from foundation.clock import WallClock
from foundation.errors import ExitStatus


@click.command("check", epilog="Example:  bufferstand check stand.toml")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
def command(stand: Path) -> int:
    """Read every device once: identity, value, age, round trip, calibration. Nothing is moved.

    Exit status 0 if all is well, 4 if a device does not answer or says what cannot be true.
    """
    rows = check_stand(load_stand(stand), WallClock())
    show_table(
        [("device", "left"), ("what", "left"), ("found", "left"), ("", "left"), ("remark", "left")],
        [(row.device, row.item, row.value, row.verdict.value, row.remark) for row in rows],
    )
    faults = sum(row.verdict is Verdict.FAULT for row in rows)
    if faults:
        click.echo(f"bufferstand: {faults} faults; the remarks say where to look", err=True)
        return ExitStatus.DEVICE_FAULT
    return ExitStatus.DONE
