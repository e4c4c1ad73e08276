"""``bufferstand simulate-stand``: the simulated stand for others to talk to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, FOLDER, JUDGED_TO_SPEED, FiniteRange
from bufferstand.foundation import program

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.serving import Served


@click.command("simulate-stand", epilog="Example:  bufferstand simulate-stand sample_runs/stand.toml")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option(
    "--speed",
    type=FiniteRange(min=0.01, max=100.0),
    default=1.0,
    help=f"Times real time; {JUDGED_TO_SPEED}.",
)
@click.option("--port", type=click.IntRange(0, 65535), help="TCP port instead of the stand file's; 0: free.")
@click.option("--model", metavar="MODEL.toml", type=EXISTING, help="Spring model of the specimen in it.")
@click.option("--wires", metavar="DIR", type=FOLDER, help="Folder for the serial device and the 1-Wire tree.")
@click.option("--endpoints", metavar="FILE", type=FILE, help="Write there where it can be reached (JSON).")
@click.option("--truth", metavar="FILE", type=FILE, help="Write there at the end what really happened.")
@click.option(
    "--wait-for-reader",
    is_flag=True,
    help="Wait for whoever reads the samples, at any speed; above 1 it always does.",
)
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help="e.g. temperature_1=silent@30:60")
@click.option("--faults", "schedule", metavar="FAULTS.toml", type=EXISTING, help="Schedule of faults.")
def command(
    stand: Path,
    speed: float,
    port: int | None,
    model: Path | None,
    wires: Path | None,
    endpoints: Path | None,
    truth: Path | None,
    faults: tuple[str, ...],
    schedule: Path | None,
    wait_for_reader: bool,
) -> None:
    """Serve the simulated stand on loopback until Ctrl-C: Modbus, serial devices, a 1-Wire folder.

    A stand file without [controller] is served, too: it moves by itself, for `bufferstand record`.
    While it is served, `bufferstand fault` lets a device of it fail.
    """
    from bufferstand.drivers.simulated.faults import load_faults, parse_fault
    from bufferstand.drivers.simulated.serving import ServerOptions, serve, write_endpoints

    scheduled, seed = ((), 0) if schedule is None else load_faults(schedule)
    options = ServerOptions(
        model=model,
        speed=speed,
        port=port,
        wires=wires,
        truth=truth,
        faults=(*scheduled, *(parse_fault(text) for text in faults)),
        fault_seed=seed,
        wait_for_reader=wait_for_reader,
    )

    def ready(served: Served) -> None:
        if endpoints is not None:
            write_endpoints(served, endpoints)
        if not served.host and served.controller_serial is None:
            click.echo("controller   the stand's own: it moves by itself, and answers nobody")
        elif served.controller_serial is None:
            click.echo(f"controller   Modbus TCP {served.host}:{served.port}")
        else:
            click.echo(f"controller   Modbus RTU {served.controller_serial}")
        for stream, place in served.instruments.items():
            shown = place if isinstance(place, str) else f"Modbus TCP {place[0]}:{place[1]}"
            click.echo(f"{stream:<12} {shown}")
        for stream, (host, ports) in served.acquisition.items():
            click.echo(f"{stream:<12} Modbus TCP {host}:{ports[0]}, stream {host}:{ports[1]}")
        click.echo(f"faults       {program()} fault {stand} FAULT  (or --list, --clear)")
        click.echo(f"serving at {served.speed:g} times real time; Ctrl-C ends it")

    serve(stand, options, ready=ready)
