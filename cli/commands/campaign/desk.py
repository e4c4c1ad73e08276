"""``bufferstand desk``: the whole job in the browser."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import FOLDER, encryption_options, monitor_address
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.monitor import Address


@click.command("desk", epilog="Example:  bufferstand desk laboratory")
@click.argument("folder", metavar="[DIR]", type=FOLDER, default=".")
@click.option(
    "--address",
    metavar="HOST:PORT",
    default="",
    callback=monitor_address,
    help="Where it is served (default 127.0.0.1:8420, or a free port if that is taken).",
)
@encryption_options("address")
def command(folder: Path, address: Address) -> None:
    """Serve the desk over DIR (default: here), a folder of stands, specimens, campaigns and runs: prepare,
    check, start, watch and judge in the browser.

    Everything it does is done by the other commands, which it shows. Ctrl-C ends the desk, never a campaign
    that was started there: a desk that is started later finds it. Nothing is ever moved from another
    computer, whatever the link.
    """
    from bufferstand.daq.monitor import bind, demand_libraries, is_loopback, links, new_tokens

    if not folder.is_dir():
        raise BadInput("there is no such folder", file=folder, remedy="give the folder with your files")
    demand_libraries()
    from bufferstand.daq.desk import serve_desk

    with bind(address) as listener:
        tokens = new_tokens(loopback=is_loopback(listener.getsockname()[0]))
        for line in links(listener, tokens, what="desk", acting="to work", address=address):
            click.echo(line, err=True)
        click.echo("Ctrl-C ends the desk; campaigns that it started go on.", err=True)
        with suppress(KeyboardInterrupt):  # uvicorn raises it again, once the pages are let go
            asyncio.run(serve_desk(folder.absolute(), listener, tokens, address))
        click.echo("the desk is closed", err=True)
