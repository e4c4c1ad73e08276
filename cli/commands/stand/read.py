"""``bufferstand stand read``: live readings of every channel."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FiniteRange, write_json

if TYPE_CHECKING:
    from bufferstand.daq.stand import ChannelReading, StandReader
    from bufferstand.foundation import Clock
    from bufferstand.foundation.channels import Zero

WINDOW_S = 1.0
HEADER = ("channel", "counts", "noise", "value", "noise", "unit", "from zero", "age s", "place")
_LEFT = (0, 5, 8)


@click.command("read", epilog="Example:  bufferstand stand read stand.toml --for 10")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option("--once", is_flag=True, help="One table, over a second, and the end.")
@click.option("--json", "as_json", is_flag=True, help="One reading as JSON on standard output.")
@click.option(
    "--for",
    "seconds",
    metavar="S",
    type=FiniteRange(min=0.1, max=86400.0),
    help="So long, a table a second; with --once or --json: over which it is averaged.",
)
def command(stand: Path, once: bool, as_json: bool, seconds: float | None) -> int:
    """Show every channel live: mean and noise, in counts or V as delivered and in its unit, and its age.

    Nothing is moved or set. In a terminal it goes on until Ctrl-C. “From zero” is the value from the zero
    that “bufferstand stand zero” or “tare” has stored. A sensor that another program holds is named, and so
    is a controller that another program commands: its samples are that one's. The rest is read. Of a stand
    file without [controller] (record-only mode) it shows what that lists.
    """
    from bufferstand.cli.closed_terminal import say
    from bufferstand.cli.stand_by_hand import opened_to_read, zero_of
    from bufferstand.daq.stand import StandReader
    from bufferstand.drivers.serial_line import is_held
    from bufferstand.foundation import ExitStatus

    with opened_to_read(stand) as (stand_file, devices, clock):
        zero = zero_of(stand)
        reader = StandReader(devices, clock)
        unopened = reader.begin()
        for text in unopened:
            say(f"note: {text}{_held_text(text)}")
        if as_json:
            readings = reader.read(seconds or WINDOW_S, zero)
            content = {
                "schema": "bufferstand/stand-read/1",
                "stand": stand_file.stand.id,
                "zero": None if zero is None else zero.document(),
                "channels": [one.as_dict() for one in readings],
                "faults": [*unopened, *reader.faults],
            }
            write_json(content, "-")
        elif once or (seconds is None and not sys.stdout.isatty()):
            _show_once(reader, seconds or WINDOW_S, zero)
        else:
            _show_live(reader, zero, None if seconds is None else clock.now_s() + seconds, clock)
    missing = any(not is_held(text) for text in unopened)
    return ExitStatus.DEVICE_FAULT if missing else ExitStatus.DONE


def _held_text(text: str) -> str:
    """Return who has a sensor that could not be opened, where it is another program."""
    from bufferstand.drivers.serial_line import is_held

    return "; another program holds it, and only that one reads it" if is_held(text) else ""


def _show_live(reader: StandReader, zero: Zero | None, until_s: float | None, clock: Clock) -> None:
    """Print a table a second, until then or until the operator ends it."""
    while until_s is None or clock.now_s() < until_s:
        _show_once(reader, WINDOW_S, zero, live=sys.stdout.isatty())


def _show_once(reader: StandReader, duration_s: float, zero: Zero | None, *, live: bool = False) -> None:
    """Print one table; ``live``: in place of the one before."""
    readings = reader.read(duration_s, zero)
    if live:
        click.clear()
    _show(readings)
    for text in dict.fromkeys(reader.faults):
        click.echo(f"note: {text}", err=True)


def _show(readings: Sequence[ChannelReading]) -> None:
    rows = [HEADER, *(_row(one) for one in readings)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADER))]
    for row in rows:
        cells = [
            text.ljust(width) if column in _LEFT else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        click.echo("  ".join(cells).rstrip())


def _raw(one: ChannelReading) -> tuple[str, str]:
    """Return mean and noise as delivered; of volts with as many digits as their noise leaves."""
    if one.counts is None or one.noise_counts is None:
        return "–", "–"
    digits = 1
    if one.raw_unit != "counts":
        digits = min(6, max(1, 1 - math.floor(math.log10(max(one.noise_counts, 1e-5)))))
    unit = "" if one.raw_unit == "counts" else f" {one.raw_unit}"
    return f"{one.counts:.{digits}f}{unit}", f"{one.noise_counts:.{digits}f}"


def _row(one: ChannelReading) -> tuple[str, ...]:
    def number(value: float | None, form: str) -> str:
        return "–" if value is None else format(value, form)

    return (
        one.name,
        *_raw(one),
        number(one.value, ".4f"),
        number(one.noise, ".4f"),
        one.unit,
        number(one.from_zero, "+.4f"),
        number(one.age_s, ".2f"),
        one.place,
    )
