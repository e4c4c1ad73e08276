"""One request and one reply over a UNIX socket, each a line of JSON."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bufferstand.foundation.files import json_content

_LONGEST = 100


@contextmanager
def short_address(path: Path) -> Iterator[str]:
    """Give an address of a socket that fits into the 108 bytes that the system has for it.

    Parameters
    ----------
    path : Path
        Of the socket, however deep; its folder must exist.

    Raises
    ------
    OSError
        If the folder of a long path cannot be opened.
    """
    if len(str(path)) <= _LONGEST:
        yield str(path)
        return
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def bind_for_oneself(server: socket.socket, path: Path) -> None:
    """Bind a socket to a path, however deep, so that nobody but this user can connect.

    Raises
    ------
    OSError
        If the folder takes no sockets, or something is there already.
    """
    with short_address(path) as address:
        before = os.umask(0o177)
        try:
            server.bind(address)
        finally:
            os.umask(before)


@contextmanager
def connected(path: Path, timeout_s: float) -> Iterator[socket.socket]:
    """Give a connection to a socket; it is closed behind.

    Parameters
    ----------
    path : Path
    timeout_s : float
        Longest wait for the other side [s].

    Raises
    ------
    OSError
        If nobody listens there.
    """
    with short_address(path) as address, socket.socket(socket.AF_UNIX) as wire:
        wire.settimeout(timeout_s)
        wire.connect(address)
        yield wire


def exchange(path: Path, request: Mapping[str, object], *, timeout_s: float, longest: int) -> Any:
    """Send a request; return the reply.

    Parameters
    ----------
    path : Path
        The socket.
    request : mapping
        What JSON can hold.
    timeout_s : float
        Longest wait for the other side [s].
    longest : int
        Most bytes of a reply.

    Raises
    ------
    OSError
        If nobody listens there, or does not answer in time.
    ValueError
        If what comes is no JSON.
    """
    with connected(path, timeout_s) as wire:
        wire.sendall(json.dumps(request).encode() + b"\n")
        with wire.makefile("rb") as lines:
            return json_content(lines.readline(longest))
