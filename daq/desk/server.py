"""The desk's web server."""

from __future__ import annotations

import socket
from pathlib import Path

from bufferstand.daq.desk.app import desk_app
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, Address, Tokens, is_loopback, web_server


async def serve_desk(
    root: Path, listener: socket.socket, tokens: Tokens, address: Address | None = None
) -> None:
    """Serve the desk over a folder until a signal ends it; what it has started goes on.

    Parameters
    ----------
    root : Path
        The folder.
    listener : socket
        Bound.
    tokens : Tokens
        What opens its pages.
    address : Address, optional
        As it was asked for; without it the desk is not encrypted.
    """
    address = address or Address()
    host, port = listener.getsockname()[:2]
    encrypted = address.certificate is not None
    access = Access(tokens, loopback=is_loopback(host), names=address.names, encrypted=encrypted)
    place = address.names[0] if address.names else str(host)
    cookie = f"bufferstand-desk-{port}"
    app, jobs = desk_app(Folder(root), access, place, cookie, encryption=address.encryption_words())
    with jobs.ending():
        await web_server(app, address.certificate).serve(sockets=[listener])
