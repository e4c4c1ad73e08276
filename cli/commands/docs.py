"""``bufferstand docs``: the documentation, on this computer."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import monitor_address
from bufferstand.foundation import BadInput, ExitStatus, program

if TYPE_CHECKING:
    from bufferstand.daq.monitor import Address

_MOST_HITS = 12


@click.command("docs", epilog="Example:  bufferstand docs calibrate force")
@click.argument("words", nargs=-1, metavar="[WORD]...")
@click.option(
    "--address",
    metavar="HOST:PORT",
    default="",
    callback=monitor_address,
    help="Where the pages are served (default 127.0.0.1:8420, or a free port if that is taken).",
)
@click.option("--open", "opened", is_flag=True, help="Open them in the browser at once.")
def command(words: tuple[str, ...], address: Address, opened: bool) -> int:
    """Find WORDs in the documentation; without any, serve its pages to the browser, with a search.

    The pages came with this program: no internet is needed. A word is found where another begins with it.
    """
    if words:
        return _search(" ".join(words))
    _serve(address, opened=opened)
    return ExitStatus.DONE


def _search(query: str) -> int:
    from bufferstand.cli.documentation import find, read_pages

    hits = find(read_pages().values(), query)
    if not hits:
        raise BadInput(
            f"nothing found for “{query}”",
            remedy="try fewer or shorter words; each must occur in one section",
        )
    for hit in hits[:_MOST_HITS]:
        beside = "" if hit.section.heading == hit.page.title else f": {hit.section.heading}"
        click.echo(f"{hit.page.title}{beside}  (docs/{hit.page.name}.md)\n    {hit.excerpt}")
    left = len(hits) - _MOST_HITS
    if left > 0:
        click.echo(f"and {left} more; another word narrows them down", err=True)
    click.echo(f"The pages: {program()} docs", err=True)
    return ExitStatus.DONE


def _serve(address: Address, *, opened: bool) -> None:
    import uvicorn

    from bufferstand.cli.documentation import documentation_site
    from bufferstand.daq.monitor import bind

    site = documentation_site()
    with bind(address) as listener:
        host, port = listener.getsockname()[:2]
        place = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
        click.echo(f"documentation: {place}", err=True)
        click.echo("Ctrl-C ends it.", err=True)
        if opened:
            click.launch(place)
        settings = uvicorn.Config(site, log_level="error", access_log=False, server_header=False)
        with suppress(KeyboardInterrupt):  # uvicorn raises it again, once the pages are let go
            uvicorn.Server(settings).run(sockets=[listener])
