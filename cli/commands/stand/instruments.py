"""``bufferstand instruments``: what can be connected, what it is made from, what hardware has confirmed."""

from __future__ import annotations

import textwrap
from dataclasses import asdict

import click

from bufferstand.cli.options import write_json
from bufferstand.foundation import ExitStatus

_WIDTH = 110
_TABLES = {
    "controller": "controllers: [controller] kind",
    "acquisition": "acquisition devices: [[acquisition]] kind",
    "amplifier": "amplifiers: [[amplifier]] protocol",
    "sensor": "other sensors: [[sensor]] kind",
    "temperature": "thermometers: [[temperature]] kind",
    "profile": "register profiles: [controller] profile",
    "map": "register maps: modbus.map of an amplifier or sensor",
}


@click.command("instruments", epilog="Example:  bufferstand instruments")
@click.option("--json", "as_json", is_flag=True, help="The list as JSON on standard output.")
@click.option(
    "--program", metavar="KIND", help="Print the program that a laboratory loads into such a device instead."
)
def command(as_json: bool, program: str | None) -> int:
    """List the kinds of device that a stand file can name, the shipped register maps, and their sources.

    Each names the documents that it is made from. “not confirmed on hardware” means that it was tried on
    simulated devices and emulators only: try it without a specimen first, with `bufferstand check`.
    """
    from bufferstand.drivers import known_instruments, lab_program

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
            _say(f"  {one.name:12}", f"{one.title}; {confirmed}")
            for source in one.sources:
                _say(" " * 14, source)
    return ExitStatus.DONE


def _say(lead: str, text: str) -> None:
    click.echo(textwrap.fill(text, _WIDTH, initial_indent=lead, subsequent_indent=" " * 16))
