"""``bufferstand instruments``: what can be connected, what it is made from, what hardware has confirmed."""

from __future__ import annotations

import textwrap
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from bufferstand.cli.options import write_json
from bufferstand.foundation import BadInput, ExitStatus

if TYPE_CHECKING:
    from bufferstand.drivers.modbus import Wire

Parity = Literal["none", "even", "odd"]

_WIDTH = 110
_TABLES = {
    "controller": "controllers: [controller] kind",
    "acquisition": "acquisition devices: [[acquisition]] kind",
    "amplifier": "amplifiers: [[amplifier]] protocol",
    "sensor": "other sensors: [[sensor]] kind",
    "temperature": "thermometers: [[temperature]] kind",
    "description": 'descriptions of Modbus devices: [[acquisition]] kind = "modbus-io", description',
    "line": 'descriptions of amplifiers that speak lines: line.description of protocol "ascii-line"',
    "profile": "register profiles: [controller] profile",
    "map": "register maps: modbus.map of an amplifier or sensor",
}


@click.command("instruments", epilog="Example:  bufferstand instruments")
@click.option("--json", "as_json", is_flag=True, help="The list as JSON on standard output.")
@click.option(
    "--program", metavar="KIND", help="Print the program that a laboratory loads into such a device instead."
)
@click.option(
    "--probe",
    metavar="WHERE",
    help="Ask the Modbus device at HOST[:PORT], or on a serial line (/dev/…), what it could be instead. "
    "Only read, nothing is written.",
)
@click.option("--unit", type=click.IntRange(0, 255), default=1, show_default=True, help="Its unit (--probe).")
@click.option(
    "--baud", type=click.IntRange(300, 4_000_000), default=19200, show_default=True, help="Of a serial line."
)
@click.option(
    "--parity",
    type=click.Choice(["none", "even", "odd"]),
    default="even",
    show_default=True,
    help="Of a serial line.",
)
@click.option(
    "--stop-bits", type=click.IntRange(1, 2), default=1, show_default=True, help="Of a serial line."
)
def command(
    as_json: bool,
    program: str | None,
    probe: str | None,
    unit: int,
    baud: int,
    parity: Parity,
    stop_bits: int,
) -> int:
    """List the kinds of device that a stand file can name, the shipped register maps, and their sources.

    Each names the documents that it is made from. “not confirmed on hardware” means that it was tried on
    simulated devices and emulators only: try it without a specimen first, with `bufferstand check`.
    """
    from bufferstand.drivers import known_instruments, lab_program

    if probe is not None:
        from bufferstand.drivers.modbus import RtuWire

        if probe.startswith(("/", "./", "../")):
            wire: Wire = RtuWire(Path(probe), baud=baud, parity=parity, stop_bits=stop_bits)
        else:
            wire = _network(probe)
        return _probe(wire, unit, as_json=as_json)
    if program is not None:
        click.echo(lab_program(program), nl=False)
        return ExitStatus.DONE
    found = known_instruments()
    if as_json:
        content = {"schema": "bufferstand/instruments/1", "instruments": [asdict(one) for one in found]}
        write_json(content, "-")
        return ExitStatus.DONE
    for table, heading in _TABLES.items():
        click.secho(heading, bold=True)
        for one in (one for one in found if one.table == table):
            confirmed = "confirmed on hardware" if one.confirmed else "not confirmed on hardware"
            _say(f"  {one.name:12}  ", f"{one.title}; {confirmed}")
            for source in one.sources:
                _say(" " * 14, source)
    return ExitStatus.DONE


def _network(where: str) -> Wire:
    """Return the wire to HOST[:PORT].

    Raises
    ------
    BadInput
        If it is none.
    """
    from bufferstand.drivers.modbus import TcpWire

    host, colon, port = where.rpartition(":")
    if not colon:
        host, port = where, "502"
    if not host or not port.isdigit() or not 1 <= int(port) <= 65535:
        raise BadInput(
            f"“{where}” is no address",
            file="--probe",
            remedy="write HOST, HOST:PORT, or the path of a serial line",
        )
    return TcpWire(host, int(port))


def _probe(wire: Wire, unit: int, *, as_json: bool) -> int:
    """Say what a foreign device could be: fits, may fit, does not fit, each with why."""
    from bufferstand.drivers.check import probe

    found = probe(wire, device_id=unit)
    where = f"{wire.address} unit {unit}"
    if as_json:
        likenesses = [
            {
                "table": one.candidate.table,
                "name": one.candidate.name,
                "title": one.candidate.title,
                "verdict": one.likeness.verdict,
                "why": one.likeness.why,
            }
            for one in found
        ]
        write_json({"schema": "bufferstand/probe/1", "device": where, "candidates": likenesses}, "-")
        return ExitStatus.DONE
    click.echo(f"{where} answers; only read, nothing was written")
    for verdict in ("fits", "may fit", "does not fit"):
        of_it = [one for one in found if one.likeness.verdict == verdict]
        click.secho(f"{verdict}: {len(of_it) or 'none'}", bold=True)
        for one in of_it:
            _say(f"  {one.candidate.name:12}  ", f"{one.candidate.title} ({one.candidate.table})")
            _say(" " * 14, one.likeness.why)
    return ExitStatus.DONE


def _say(lead: str, text: str) -> None:
    click.echo(textwrap.fill(text, _WIDTH, initial_indent=lead, subsequent_indent=" " * 16))
