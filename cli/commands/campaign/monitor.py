"""``bufferstand monitor``: a running or finished campaign in the browser."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, encryption_options, monitor_address
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.monitor import Address


@click.command("monitor", epilog="Example:  bufferstand monitor campaign")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option(
    "--address",
    metavar="HOST:PORT",
    default="",
    callback=monitor_address,
    help="Where the page is served (default 127.0.0.1:8420, or a free port if that is taken).",
)
@encryption_options("address")
@click.option("--view-only", is_flag=True, help="Nobody can stop it or write notes through this page.")
@click.option("--end", is_flag=True, help="End the page that has stayed open behind a campaign in DIR.")
def command(folder: Path, address: Address, view_only: bool, end: bool) -> None:
    """Show a campaign in the browser: one that runs, live; one that has ended, with its results.

    Ctrl-C ends the page, never the campaign. Away from loopback only the links that are printed open it. The
    page of run --monitor stays behind its campaign while somebody has it open, and ten minutes longer.
    """
    from bufferstand.daq.campaign_folder import load_record
    from bufferstand.daq.monitor import bind, demand_libraries, end_page, is_loopback, links, new_tokens

    if load_record(folder) is None:
        raise BadInput(
            "no campaign.json in this folder", file=folder, remedy="give the --out folder of a run"
        )
    if end:
        click.echo("the page is closed" if end_page(folder) else "no page has stayed open here", err=True)
        return
    demand_libraries()
    from bufferstand.daq.monitor import serve

    with bind(address) as listener:
        tokens = new_tokens(loopback=is_loopback(listener.getsockname()[0]), view_only=view_only)
        for line in links(listener, tokens, address=address):
            click.echo(line, err=True)
        click.echo("Ctrl-C ends the page.", err=True)
        with suppress(KeyboardInterrupt):  # uvicorn raises it again, once the pages are let go
            asyncio.run(
                serve(
                    folder.absolute(),
                    listener,
                    tokens,
                    results=True,
                    names=address.names,
                    certificate=address.certificate,
                )
            )
        click.echo("the page is closed", err=True)
