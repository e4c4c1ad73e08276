"""``bufferstand check``: does every device of the stand answer, and can what it says be true?"""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, FiniteRange, write_json
from bufferstand.drivers.check import WATCH_S, Verdict
from bufferstand.foundation import BadInput, ExitStatus, WallClock

if TYPE_CHECKING:
    from bufferstand.drivers.check import CheckRow
    from bufferstand.drivers.stand_file import RecordingStand, StandFile

_MARKS = {Verdict.OK: ("ok", None), Verdict.NOTE: ("note", "yellow"), Verdict.FAULT: ("FAULT", "red")}
_WIDE = 200


@click.command("check", epilog="Example:  bufferstand check stand.toml")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option("--json", "as_json", is_flag=True, help="Findings as JSON on standard output.")
@click.option(
    "--watch",
    metavar="SECONDS",
    type=FiniteRange(min=0.0, max=3600.0),
    default=WATCH_S,
    show_default=True,
    help="How long rate and clock of the controller are watched.",
)
@click.option("--transcript", metavar="FILE", type=FILE, help="Keep all bytes on the wires there, as text.")
def command(stand: Path, as_json: bool, watch: float, transcript: Path | None) -> int:
    """Read every device: identity, state, values, rates, round trip, clock drift, calibrations.

    Nothing is moved or set. Exit status 0 if all is well, 4 if a device does not answer or says what cannot
    be true, or a calibration has expired; the remarks say where to look.
    """
    from bufferstand.drivers.check import check_recording, check_stand
    from bufferstand.drivers.stand_file import has_controller, load_recording_stand, load_stand
    from bufferstand.drivers.transcripts import record_wires

    stand_file: RecordingStand | StandFile
    if not has_controller(stand):
        if transcript is not None:
            raise BadInput(
                "the wires of a stand without a controller are not kept",
                file="--transcript",
                remedy="leave it out, or use the network's own tools",
            )
        stand_file = load_recording_stand(stand)
        rows = check_recording(stand_file, WallClock(), watch_s=watch)
    elif transcript is None:
        stand_file = load_stand(stand)
        rows = check_stand(stand_file, WallClock(), watch_s=watch)
    else:
        stand_file = load_stand(stand)
        with record_wires(stand_file, transcript) as tapped:
            rows = check_stand(tapped, WallClock(), watch_s=watch)
    faults = sum(row.verdict is Verdict.FAULT for row in rows)
    if as_json:
        content = {
            "schema": "bufferstand/check/1",
            "stand": stand_file.stand.id,
            "faults": faults,
            "findings": [asdict(row) for row in rows],
        }
        write_json(content, "-")
    else:
        _show(rows)
    if faults:
        some = "1 fault; its remark says" if faults == 1 else f"{faults} faults; their remarks say"
        click.echo(f"bufferstand: {some} where to look", err=True)
        return ExitStatus.DEVICE_FAULT
    return ExitStatus.DONE


def _show(rows: Sequence[CheckRow]) -> None:
    """Print the findings device by device; a remark stands below what it is about."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else _WIDE
    order = {device: number for number, device in reversed(list(enumerate(row.device for row in rows)))}
    widest = min(26, max((len(row.item) for row in rows), default=0))
    for device, found in groupby(sorted(rows, key=lambda row: order[row.device]), lambda row: row.device):
        click.secho(device, bold=True)
        for row in found:
            word, colour = _MARKS[row.verdict]
            mark = click.style(f"{word:5}", fg=colour) if colour else f"{word:5}"
            click.echo(f"  {mark}  ", nl=False)
            indent = " " * (11 + widest)
            value = row.value if row.age_s is None else f"{row.value}, {_age(row.age_s)}"
            click.echo(_wrapped(f"{row.item:{widest}}  {value}", width - 1, 9, indent))
            if row.remark:
                click.secho(_wrapped(row.remark, width - 1, 0, " " * 9, first=" " * 9), fg=colour)


def _wrapped(text: str, width: int, used: int, indent: str, *, first: str = "") -> str:
    """Return text in lines of a width, of which the first has ``used`` columns taken already."""
    lead = first or " " * used
    lines = textwrap.wrap(
        text,
        max(width, 40),
        initial_indent=lead,
        subsequent_indent=indent,
        break_long_words=True,
        break_on_hyphens=False,
        drop_whitespace=True,
    )
    shown = "\n".join(lines)
    return shown if first else shown[used:]


def _age(age_s: float) -> str:
    return f"{max(age_s, 0.0) * 1e3:.0f} ms old" if age_s < 1.0 else f"{age_s:.1f} s old"
