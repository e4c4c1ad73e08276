"""The desk's web server."""

from __future__ import annotations

import socket
from pathlib import Path

from bufferstand.daq.desk.app import desk_app
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, Tokens, is_loopback, web_server


async def serve_desk(root: Path, listener: socket.socket, tokens: Tokens) -> None:
    """Serve the desk over a folder until a signal ends it; what it has started goes on.

    Parameters
    ----------
    root : Path
        The folder.
    listener : socket
        Bound.
    tokens : Tokens
        What opens its pages.
    """
    host, port = listener.getsockname()[:2]
    access = Access(tokens, loopback=is_loopback(host))
    app, jobs = desk_app(Folder(root), access, str(host), f"bufferstand-desk-{port}")
    with jobs.ending():
        await web_server(app).serve(sockets=[listener])
