"""The web server: uvicorn on a socket that is bound already, with limits on what strangers make it hold."""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, TextIO, TypeGuard

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from bufferstand.daq.monitor.access import Access, Tokens, is_loopback
from bufferstand.daq.monitor.actions import Actions
from bufferstand.daq.monitor.app import Pages
from bufferstand.daq.monitor.encryption import Certificate
from bufferstand.daq.monitor.follower import Follower
from bufferstand.daq.monitor.staying import IDLE_S, MOST_S, announced
from bufferstand.daq.monitor.view import View

MOST_CONNECTIONS = 96
MOST_OF_ONE = 40
"""Connections of one address."""
MOST_LOG_BYTES = 65536
"""What is noted of faults while a page is served; strangers can make it write, and the disk is for runs."""
FIRST_REQUEST_S = 10.0
"""A connection that has asked nothing whole for so long is closed [s]."""
MOST_HEAD_BYTES = 16384
HEAR_OUT_S = 5.0
"""So long a campaign's own last words are waited for [s]."""
LAST_WORD_S = 3.0
"""So long, at most, pages have to be told that it is over [s]."""
_ASK_AGAIN_S = 0.02
_LOOK_S = 0.25


class ImpatientProtocol(H11Protocol):
    """HTTP/1.1 that bounds connections, and closes those that dawdle over their first request.

    Where there are too many, the one that has been there longest goes for the one that comes: whoever holds
    many and says nothing keeps nobody out, for an honest request is answered in no time. A page that is being
    told things (a WebSocket) stays.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection, in the place of the oldest of those that are too many."""
        super().connection_made(transport)
        self.since_s = self.loop.time()
        hosts = Counter(map(_host, self.connections))
        crowd = _host(self) if hosts[_host(self)] > MOST_OF_ONE else hosts.most_common(1)[0][0]
        if hosts[crowd] > MOST_OF_ONE or len(self.connections) > MOST_CONNECTIONS:
            waiting = [one for one in self.connections if _may_go(one) and _host(one) == crowd]
            min(waiting, key=lambda one: one.since_s, default=self).leave()
        self.loop.call_later(FIRST_REQUEST_S, self._demand_request)

    def leave(self) -> None:
        """Close the connection at once, and count it no more."""
        self.connections.discard(self)
        self.transport.abort()

    def _demand_request(self) -> None:
        if self.cycle is None and self in self.connections:
            self.transport.abort()


def _may_go(connection: Any) -> TypeGuard[ImpatientProtocol]:
    return isinstance(connection, ImpatientProtocol)


class BoundedLog(logging.StreamHandler[TextIO]):
    """Writes what is logged to standard error, until there is enough of it."""

    def __init__(self, most_bytes: int = MOST_LOG_BYTES) -> None:
        super().__init__(sys.stderr)
        self._left = most_bytes

    def emit(self, record: logging.LogRecord) -> None:
        """Write one entry, if there is still room."""
        if self._left > 0:
            self._left -= len(self.format(record).encode())
            if self._left <= 0:
                record = logging.LogRecord(
                    record.name, record.levelno, "", 0, "further faults are not noted", None, None
                )
            super().emit(record)


def _host(connection: Any) -> str:
    client = getattr(connection, "client", None)
    return str(client[0]) if client else ""


class _Server(uvicorn.Server):
    """Gives a stranger's TLS handshake no more time than a first request."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen."""
        loop = asyncio.get_running_loop()
        if self.config.ssl is not None:
            plain = loop.create_server
            loop.create_server = partial(  # type: ignore[method-assign]
                plain, ssl_handshake_timeout=FIRST_REQUEST_S
            )
        await super().startup(sockets)


def web_server(app: ASGIApp, certificate: Certificate | None = None) -> uvicorn.Server:
    """Return a server of an application, with limits on what strangers can make it hold.

    With a certificate it speaks TLS, and nothing else.

    What it and its event loop log goes to standard error, a bounded part of it.
    """
    for name in ("uvicorn", "asyncio"):
        logging.getLogger(name).handlers = [BoundedLog()]
        logging.getLogger(name).propagate = False
    return _Server(
        uvicorn.Config(
            app,
            ssl_certfile=None if certificate is None else certificate.chain,
            ssl_keyfile=None if certificate is None else certificate.key,
            http=ImpatientProtocol,
            ws="websockets-sansio",
            ws_max_size=1024,
            ws_ping_interval=10.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=False,
            h11_max_incomplete_event_size=MOST_HEAD_BYTES,
            limit_concurrency=2 * MOST_CONNECTIONS,  # those that leave are counted until they are gone
            timeout_keep_alive=5,
            timeout_graceful_shutdown=1,
            lifespan="off",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            server_header=False,
        )
    )


async def serve(
    folder: Path,
    listener: socket.socket,
    tokens: Tokens,
    *,
    results: bool,
    until: Awaitable[Any] | None = None,
    stays: Callable[[], object] | None = None,
    names: Sequence[str] = (),
    certificate: Certificate | None = None,
) -> None:
    """Serve a campaign's page until told to end.

    Parameters
    ----------
    folder : Path
        The campaign's folder.
    listener : socket
        Bound.
    tokens : Tokens
        What opens the page.
    results : bool
        Evaluate the runs of a campaign that has ended.
    until : awaitable, optional
        Ends the server when it is done; without it, signals do.
    stays : callable, optional
        Told when it stays though that is done, because somebody has the page open
        (:mod:`bufferstand.daq.monitor.staying`); without it, it never does.
    names : sequence of str
        By which the machine is reached, beside its own.
    certificate : Certificate, optional
        What it is encrypted by.
    """
    host, port = listener.getsockname()[:2]
    view = View()
    access = Access(tokens, loopback=is_loopback(host), names=names, encrypted=certificate is not None)
    follower = Follower(folder, view, results=results)
    pages = Pages(follower, access, Actions(folder), port)
    server = web_server(pages.app(), certificate)
    following = asyncio.create_task(follower.run())
    ending = None
    if until is not None:
        ending = asyncio.create_task(_end(server, follower, pages, view, until, stays))
    closing = asyncio.create_task(_close(server, pages, view))
    following.add_done_callback(lambda task: _stop_if_failed(task, server))
    try:
        await server.serve(sockets=[listener])
    finally:
        for task in (following, ending, closing):
            if task is not None:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task


async def _end(
    server: uvicorn.Server,
    follower: Follower,
    pages: Pages,
    view: View,
    until: Awaitable[Any],
    stays: Callable[[], object] | None,
) -> None:
    await until
    if follower.source == "live":  # how it ended is on its way: no page shall be left with “connection lost”
        with suppress(TimeoutError):
            await asyncio.wait_for(follower.ended.wait(), HEAR_OUT_S)
    await follower.look()  # the record says it too, if its last words were lost
    if stays is not None and follower.has_campaign and pages.idle_s < IDLE_S:
        with announced(follower.folder, pages.port):
            stays()
            follower.results = True
            with suppress(TimeoutError):
                async with asyncio.timeout(MOST_S):
                    while pages.idle_s < IDLE_S:
                        await asyncio.sleep(_LOOK_S)
    await _tell_pages(pages, view)
    server.should_exit = True


async def _close(server: uvicorn.Server, pages: Pages, view: View) -> None:
    """End the server when somebody who may has asked for it."""
    await pages.closing.wait()
    await _tell_pages(pages, view)
    server.should_exit = True


async def _tell_pages(pages: Pages, view: View) -> None:
    view.over = True
    with suppress(TimeoutError):
        async with asyncio.timeout(LAST_WORD_S):
            while pages.are_open:  # each closes when it has been told
                await asyncio.sleep(_ASK_AGAIN_S)


def _stop_if_failed(task: asyncio.Task[None], server: uvicorn.Server) -> None:
    """A page whose data nobody renews must not stand there as if all were well."""
    if not task.cancelled() and task.exception() is not None:
        server.should_exit = True
