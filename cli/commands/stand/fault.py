"""``bufferstand fault``: let a device of a served simulated stand fail."""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.options import EXISTING, FOLDER, FiniteRange
from bufferstand.foundation import BadInput


@click.command(
    "fault", epilog="Example:  bufferstand fault sample_runs/stand.toml temperature_1=crc --for 30"
)
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.argument("faults", metavar="[TARGET=KIND[@START[:END]][,KEY=VALUE]…]…", nargs=-1)
@click.option("--for", "for_s", metavar="SECONDS", type=FiniteRange(min=0.001), help="Of stand time.")
@click.option("--clear", is_flag=True, help="Take faults away: all, or those of the targets named.")
@click.option("--list", "show", is_flag=True, help="Show the faults that were given, and the stand time.")
@click.option("--wires", metavar="DIR", type=FOLDER, help="As simulate-stand was given it.")
def command(
    stand: Path, faults: tuple[str, ...], for_s: float | None, clear: bool, show: bool, wires: Path | None
) -> None:
    """Let a device of the simulated stand fail that `bufferstand simulate-stand STAND.toml` serves.

    A fault without @START begins now and lasts until it is cleared, or for --for seconds. Kinds of faults,
    and what is seen of each: docs/simulated-stand.md.
    """
    from bufferstand.drivers.simulated.faults import SOCKET, ask

    path = (stand.parent / "wires" if wires is None else wires).absolute() / SOCKET
    if clear:
        for target in faults or (None,):
            click.echo(ask(path, {"clear": target}))
    elif not faults and not show:
        raise BadInput(
            "no fault is given", file="fault", remedy="e.g. temperature_1=crc, or --list, or --clear"
        )
    else:
        for text in faults:
            click.echo(ask(path, {"add": text, "for_s": for_s}))
    if show:
        click.echo(ask(path, {"list": True}))
