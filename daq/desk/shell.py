"""What every page of the desk needs: who asks and what he may do, the frame around the page, its files."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files
from typing import Any, TypeVar

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import Commands
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, Rights, is_loopback, posted_object, static_files
from bufferstand.foundation import BadInput, counted, plain

MOST_BYTES = 512 * 1024
"""Of what a page sends: a campaign file, and its edits."""
BODY_S = 10.0
"""Longest wait for it [s]."""
TEMPLATES = "templates"
SHARED = ("uplot.min.js", "uplot.min.css", "charts.js", "counted.js", "icon.svg")
"""Files of the monitor that pages of the desk use, too."""
CONTENT_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
NOT_HERE = "this is done at the stand's own computer only: open the desk there"
CLOSING = "this was broken off: the desk is being closed"
LOOK_ONLY = "this page may only look on: open the link “to work” that the desk printed when it was started"

T = TypeVar("T")
Look = Callable[[Request], Awaitable[Response]]
Act = Callable[[Request, dict[str, Any]], Awaitable[Response]]


@dataclass(frozen=True)
class Tab:
    """An entry of the navigation."""

    path: str
    title: str


class Desk:
    """The desk as its pages see it.

    Parameters
    ----------
    folder : Folder
        What it is about.
    access : Access
        Who may what.
    commands : Commands
        What is done by them.
    cookie : str
        Name of the session's cookie.
    parts : sequence of str
        Packages with ``templates`` and ``static`` folders of pages, beside the desk's own.
    """

    def __init__(
        self, folder: Folder, access: Access, commands: Commands, cookie: str, parts: Sequence[str] = ()
    ) -> None:
        self.folder = folder
        self.commands = commands
        self.access = access
        self.tabs: list[Tab] = []
        self._cookie = cookie
        self._files = _shared_files()
        packages = ("bufferstand.daq.desk", *parts)
        loaders = [PackageLoader(package, TEMPLATES) for package in packages]
        for package in packages:
            self._files |= _static_of(package)
        self._pages = Environment(
            loader=ChoiceLoader(loaders),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )

        self._pages.filters["local"] = local_time
        self._pages.filters["counted"] = counted

    # --- who asks ------------------------------------------------------------------------------------

    def rights(self, request: Request) -> Rights:
        """Return what whoever asks may do."""
        return self.access.rights_of(request.cookies.get(self._cookie))

    def here(self, request: Request) -> bool:
        """Return whether the request comes from this computer."""
        return request.client is not None and is_loopback(request.client.host)

    def acts(self, request: Request) -> bool:
        """Return whether whoever asks may do more than look on."""
        return self.rights(request) == "control"

    def may_move(self, request: Request) -> bool:
        """Return whether whoever asks may set a stand in motion: with the right to act, and from here."""
        return self.acts(request) and self.here(request)

    # --- routes --------------------------------------------------------------------------------------

    def look(self, path: str, handler: Look) -> Route:
        """Return the route of a page that is looked at; whoever may not is shown the door."""

        async def guarded(request: Request) -> Response:
            if self.rights(request) == "none":
                return self.page(request, "door.html", 401, title="The desk")
            try:
                return await handler(request)
            except asyncio.CancelledError:
                return Response(CLOSING, 503, media_type="text/plain")
            except BadInput as error:
                return self.page(
                    request, "problem.html", 404, title="This cannot be shown", problem=str(error)
                )

        return Route(path, guarded, methods=["GET"])

    def act(self, path: str, handler: Act, *, moves: bool = False) -> Route:
        """Return the route of something that is done: only for our own pages with the right to act.

        Parameters
        ----------
        path : str
        handler : callable
            Takes the request, and the JSON object that the page has sent.
        moves : bool
            It can set a stand in motion: only from this computer, whatever the token.
        """

        async def guarded(request: Request) -> Response:
            content = await self.content(request)
            if isinstance(content, Response):
                return content
            if not self.acts(request):
                return refusal(403, LOOK_ONLY)
            if moves and not self.here(request):
                return refusal(403, NOT_HERE)
            try:
                return await handler(request, content)
            except asyncio.CancelledError:
                return refusal(503, CLOSING)
            except BadInput as error:
                return refusal(409, str(error))

        return Route(path, guarded, methods=["POST"])

    async def content(self, request: Request) -> dict[str, Any] | Response:
        """Return what a page of ours has sent, or why it is refused."""
        if not self.access.origin_is_ours(request.headers.get("origin"), request.headers["host"]):
            return refusal(403, "only the desk's own pages are heard")
        found = await posted_object(request, MOST_BYTES, BODY_S)
        return refusal(*found) if isinstance(found, tuple) else found

    def keep_session(self, response: Response, session: str) -> None:
        """Give the browser its session."""
        secure = self.access.encrypted
        response.set_cookie(self._cookie, session, httponly=True, samesite="strict", path="/", secure=secure)

    # --- pages ---------------------------------------------------------------------------------------

    def page(
        self, request: Request, template: str, status: int = 200, *, title: str, **facts: Any
    ) -> Response:
        """Return a page: a template in the frame, with what it shows.

        Every template has ``tabs``, ``path``, ``title``, ``folder``, ``acts`` and ``may_move``.
        """
        text = self.fragment(
            template,
            tabs=self.tabs,
            path=request.url.path,
            title=title,
            folder=self.folder.root.name or "/",
            acts=self.acts(request),
            may_move=self.may_move(request),
            **facts,
        )
        return Response(text, status, media_type="text/html")

    def fragment(self, template: str, **facts: Any) -> str:
        """Return a piece of a page; whatever is text in it is escaped."""
        return self._pages.get_template(template).render(**facts)

    def file(self, name: str) -> Response:
        """Return a static file; nothing else is ever served so."""
        content = self._files.get(name)
        if content is None:
            return Response("There is no such file.\n", 404, media_type="text/plain")
        return Response(content, headers={"Content-Type": CONTENT_TYPES["." + name.rpartition(".")[2]]})


def local_time(text: str) -> str:
    """Return a moment (ISO 8601) as the clock of this laboratory showed it; a text that is none as it is."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return text
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return f"{moment.astimezone():%Y-%m-%d %H:%M %Z}"


def refusal(status: int, text: str, field: str = "") -> Response:
    """Return an answer to a page that something is not done, why, and for which field of its form."""
    return JSONResponse({"problem": plain(text), **({"field": field} if field else {})}, status)


async def unless_closed(answer: Awaitable[T]) -> T:
    """Wait for an answer that takes long; a desk that is closed meanwhile says so, and nothing of its own.

    Raises
    ------
    BadInput
        If the desk is being closed.
    """
    try:
        return await answer
    except asyncio.CancelledError:
        if (task := asyncio.current_task()) is not None:
            task.uncancel()
        raise BadInput("the desk is being closed", remedy="start it again and ask again") from None


def text_of(content: dict[str, Any], key: str, longest: int = 400) -> str:
    """Return a text that a page has sent; empty where it has sent none.

    Raises
    ------
    BadInput
        If it holds what no command and no file can: a zero character, or half of one.
    """
    value = content.get(key, "")
    if not isinstance(value, str):
        return ""
    if "\0" in value or any("\ud800" <= one <= "\udfff" for one in value):
        raise BadInput(f"“{key}” holds a character that is none", remedy="type it anew")
    return value[:longest].strip()


def _shared_files() -> dict[str, bytes]:
    return {name: content for name, content in static_files().items() if name in SHARED}


def _static_of(package: str) -> dict[str, bytes]:
    """Return the static files of a package, by name."""
    root = files(package) / "static"
    if not root.is_dir():
        return {}
    return {
        one.name: one.read_bytes()
        for one in root.iterdir()
        if f".{one.name.rpartition('.')[2]}" in CONTENT_TYPES
    }
