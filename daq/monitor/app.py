"""The web application: the page, its data over a WebSocket, and what can be asked of the campaign.

Everything that comes in is checked before anything is done with it: host, origin, rights, size, time.
"""

from __future__ import annotations

import asyncio
import math
import time
from contextlib import suppress
from importlib.resources import files
from typing import Any

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from bufferstand.daq.monitor.access import Access, Rights
from bufferstand.daq.monitor.actions import Actions, who_asks
from bufferstand.daq.monitor.follower import Follower
from bufferstand.daq.monitor.past import RunSpans
from bufferstand.daq.monitor.posted import posted_object
from bufferstand.daq.monitor.view import Cursor
from bufferstand.foundation import BadInput

MOST_PAGES = 24
"""Pages that are served at once."""
KEPT_FOR_CONTROL = 4
"""Of them so many are for those who may act: who only looks on cannot keep the operator out."""
SEND_S = 0.05
"""Least time between two messages to a page [s]."""
SIGN_OF_LIFE_S = 0.5
PATIENCE_S = 10.0
"""A page that takes no message for so long is let go [s]."""
MOST_BYTES = 8192
"""Of what a page sends."""
BODY_S = 5.0
"""Longest wait for it [s]."""
WRONG_TOKEN_S = 0.5
"""A wrong token is answered so late [s]."""
MOST_CHANNELS = 4
"""Channels that are asked for at once."""
CONTENT_TYPES = {
    "index.html": "text/html; charset=utf-8",
    "monitor.css": "text/css; charset=utf-8",
    "monitor.js": "text/javascript; charset=utf-8",
    "charts.js": "text/javascript; charset=utf-8",
    "counted.js": "text/javascript; charset=utf-8",
    "cycles.js": "text/javascript; charset=utf-8",
    "results.js": "text/javascript; charset=utf-8",
    "times.js": "text/javascript; charset=utf-8",
    "rows.js": "text/javascript; charset=utf-8",
    "traces.js": "text/javascript; charset=utf-8",
    "uplot.min.js": "text/javascript; charset=utf-8",
    "uplot.min.css": "text/css; charset=utf-8",
    "uplot.LICENSE": "text/plain; charset=utf-8",
    "icon.svg": "image/svg+xml",
}
"""Every file of the page; nothing else is ever served."""


def static_files() -> dict[str, bytes]:
    """Return the files of the page, as they are shipped."""
    root = files("bufferstand.daq.monitor") / "static"
    return {name: (root / name).read_bytes() for name in CONTENT_TYPES}


def security_headers(host: str, *, encrypted: bool) -> dict[str, str]:
    """Return the headers of every answer: nothing foreign is loaded, framed, or told where it came from."""
    policy = (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        f"connect-src 'self' {'wss' if encrypted else 'ws'}://{host}; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "Content-Security-Policy": policy,
        "X-Frame-Options": "DENY",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
        "Cache-Control": "no-store",
    }


class Gate:
    """Lets in only what is addressed to this machine, and gives every answer its headers."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        hosts = [value for name, value in scope["headers"] if name == b"host"]
        host = hosts[0].decode("latin-1") if len(hosts) == 1 else ""
        if not self._access.host_is_ours(host):
            if scope["type"] == "websocket":
                await WebSocket(scope, receive, send).close(1008)
            else:
                refusal = Response("This host name is not served here.\n", 421, media_type="text/plain")
                await refusal(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = list(message.get("headers", []))
                stated = {name for name, _ in given}  # a page that needs a policy of its own has stated it
                added = [
                    (k.lower().encode(), v.encode())
                    for k, v in security_headers(host, encrypted=self._access.encrypted).items()
                ]
                message["headers"] = [*given, *(one for one in added if one[0] not in stated)]
            await send(message)

        await self._app(scope, receive, with_headers)


class Pages:
    """What the routes do.

    Parameters
    ----------
    follower : Follower
        Has what is shown.
    access : Access
        Who may what.
    actions : Actions
        What can be done.
    port : int
        Where it is served: cookies know no ports, so the session's has it in its name.
    """

    def __init__(self, follower: Follower, access: Access, actions: Actions, port: int) -> None:
        self._follower = follower
        self._view = follower.view
        self._runs = RunSpans(follower.folder)
        self._access = access
        self._actions = actions
        self.port = port
        self._cookie = f"bufferstand-{port}"
        self._files = static_files()
        self._open = 0
        self._left_s = -math.inf
        self.closing = asyncio.Event()
        """Set when somebody who may has asked for the page to be closed."""

    def app(self) -> ASGIApp:
        """Return the application."""
        routes = [
            Route("/", self.page, methods=["GET"]),
            Route("/static/{name}", self.static, methods=["GET"]),
            Route("/session", self.session, methods=["GET"]),
            Route("/session", self.enter, methods=["POST"]),
            Route("/stop", self.stop, methods=["POST"]),
            Route("/note", self.note, methods=["POST"]),
            Route("/close", self.close, methods=["POST"]),
            Route("/history", self.history, methods=["GET"]),
            WebSocketRoute("/live", self.live),
        ]
        return Gate(Starlette(routes=routes), self._access)

    def rights(self, connection: HTTPConnection[Any]) -> Rights:
        """Return what whoever asks may do."""
        return self._access.rights_of(connection.cookies.get(self._cookie))

    async def page(self, request: Request) -> Response:  # noqa: ARG002 - a route's signature
        """Give the page itself: it holds no data."""
        return self._file("index.html")

    async def static(self, request: Request) -> Response:
        """Give one of its files."""
        return self._file(request.path_params["name"])

    def _file(self, name: str) -> Response:
        if name not in self._files:
            return Response("There is no such file.\n", 404, media_type="text/plain")
        return Response(self._files[name], headers={"Content-Type": CONTENT_TYPES[name]})

    async def session(self, request: Request) -> Response:
        """Say what the page may do."""
        return JSONResponse({"rights": self.rights(request), "controllable": self._access.controllable})

    async def enter(self, request: Request) -> Response:
        """Take a token; give a session for it."""
        content = await self._content(request, "session")
        if isinstance(content, Response):
            return content
        admitted = self._access.admit(_text(content, "token", 200))
        if admitted is None:
            await asyncio.sleep(WRONG_TOKEN_S)
            await asyncio.to_thread(self._actions.refused, _address(request), "wrong token")
            return _refusal(403, "this token opens nothing here")
        session, rights = admitted
        response = JSONResponse({"rights": rights, "controllable": self._access.controllable})
        secure = self._access.encrypted
        response.set_cookie(self._cookie, session, httponly=True, samesite="strict", path="/", secure=secure)
        return response

    async def stop(self, request: Request) -> Response:
        """Ask the campaign to stop."""
        return await self._act(request, "stop")

    async def note(self, request: Request) -> Response:
        """Add a note."""
        return await self._act(request, "note")

    async def close(self, request: Request) -> Response:
        """Close the page for everybody, once its campaign has ended."""
        return await self._act(request, "close")

    async def history(self, request: Request) -> Response:
        """Give what was recorded in a span of the campaign or of one of its runs, thinned out to extremes."""
        if self.rights(request) == "none":
            return _refusal(403, "this page is not open: open its link")
        asked = request.query_params
        try:
            from_s, to_s = float(asked.get("from", "-inf")), float(asked.get("to", "inf"))
        except ValueError:
            return _refusal(400, "a span of seconds is expected")
        channels = asked.get("channels", "").split(",")[:MOST_CHANNELS]
        if math.isnan(from_s) or math.isnan(to_s):
            return _refusal(400, "a span of seconds is expected")
        if "run" not in asked:
            return JSONResponse(self._follower.history.span(from_s, to_s, channels))
        try:
            return JSONResponse(
                await asyncio.to_thread(self._runs.span, asked["run"], from_s, to_s, channels)
            )
        except (BadInput, OSError) as error:
            return _refusal(404, str(error))

    async def _act(self, request: Request, what: str) -> Response:
        content = await self._content(request, what)
        if isinstance(content, Response):
            return content
        if self.rights(request) != "control":
            await asyncio.to_thread(self._actions.refused, _address(request), what)
            return _refusal(403, "this page may only look on: open the link for control")
        who = who_asks(_text(content, "name", 200), _address(request))
        if what == "close":
            if self._follower.source not in ("finished", "silent"):
                return _refusal(409, "the campaign is still running: its page stays")
            await asyncio.to_thread(self._actions.log, who, "close the page", "done", "")
            self.closing.set()
            return JSONResponse({"text": "the page is being closed"})
        try:
            if what == "stop":
                answer = await asyncio.to_thread(self._actions.stop, _text(content, "after", 20), who)
            else:
                answer = await asyncio.to_thread(self._actions.note, _text(content, "text", 4000), who)
        except BadInput as error:
            return _refusal(409, str(error))
        return JSONResponse({"text": answer})

    async def _content(self, request: Request, what: str) -> dict[str, Any] | Response:
        """Return what a page of ours has sent, or why it is refused."""
        if not self._access.origin_is_ours(request.headers.get("origin"), request.headers["host"]):
            await asyncio.to_thread(self._actions.refused, _address(request), f"{what} from a foreign page")
            return _refusal(403, "only the monitor's own page is heard")
        found = await posted_object(request, MOST_BYTES, BODY_S)
        return _refusal(*found) if isinstance(found, tuple) else found

    @property
    def are_open(self) -> bool:
        """Whether some page is being told things."""
        return self._open > 0

    @property
    def idle_s(self) -> float:
        """For how long nobody has had the page open [s]; infinite if nobody ever had."""
        return 0.0 if self._open else time.monotonic() - self._left_s

    async def live(self, page: WebSocket) -> None:
        """Tell a page everything, as it comes, as long as it keeps up."""
        ours = self._access.origin_is_ours(page.headers.get("origin"), page.headers["host"])
        rights = self.rights(page)
        most = MOST_PAGES if rights == "control" else MOST_PAGES - KEPT_FOR_CONTROL
        if not ours or rights == "none" or self._open >= most:
            await page.close(1008)
            return
        await page.accept()
        self._open += 1
        listening = asyncio.create_task(_hear_nothing(page))
        telling = asyncio.create_task(self._tell(page))
        try:
            await asyncio.wait([listening, telling], return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._open -= 1
            self._left_s = time.monotonic()
            for task in (listening, telling):
                task.cancel()
            await asyncio.gather(listening, telling, return_exceptions=True)
            with suppress(RuntimeError, WebSocketDisconnect):
                await page.close()

    async def _tell(self, page: WebSocket) -> None:
        cursor, quiet_s = Cursor(), SIGN_OF_LIFE_S
        loop = asyncio.get_running_loop()
        while True:
            over = self._view.over
            message = self._view.news(cursor)
            if message is None and quiet_s >= SIGN_OF_LIFE_S:
                message = self._view.sign_of_life()
            if message is not None:
                quiet_s = 0.0
                async with asyncio.timeout(PATIENCE_S):
                    await page.send_text(message)
            if over:
                return
            began_s = loop.time()
            await asyncio.sleep(SEND_S)
            quiet_s += loop.time() - began_s


async def _hear_nothing(page: WebSocket) -> None:
    """Wait until a page goes; whatever it says ends the conversation."""
    with suppress(WebSocketDisconnect):
        await page.receive_text()


def _refusal(status: int, text: str) -> Response:
    return JSONResponse({"problem": text}, status)


def _text(content: dict[str, Any], key: str, longest: int) -> str:
    value = content.get(key, "")
    return value[:longest] if isinstance(value, str) else ""


def _address(connection: HTTPConnection[Any]) -> str:
    return connection.client.host if connection.client else ""
