"""The desk's application: its pages in the order of the work, and how a token becomes a session."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from bufferstand.daq.desk.beginning import Beginning
from bufferstand.daq.desk.campaigns import Campaigns, Start
from bufferstand.daq.desk.commands import Commands
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.desk.jobs import Jobs
from bufferstand.daq.desk.overview import Overview
from bufferstand.daq.desk.prepare import Prepare
from bufferstand.daq.desk.reports import Reports
from bufferstand.daq.desk.results import Archive, Results
from bufferstand.daq.desk.shell import Desk, refusal, text_of
from bufferstand.daq.desk.stand import Check
from bufferstand.daq.monitor import Access, Gate

WRONG_TOKEN_S = 0.5
"""A wrong token is answered so late [s]."""
PARTS: tuple[str, ...] = ("bufferstand.daq.desk.reports", "bufferstand.daq.desk.results")
"""Packages with pages of their own, and their ``templates`` and ``static``."""


def desk_app(
    folder: Folder, access: Access, host: str, cookie: str, *, encryption: Sequence[str] = ()
) -> tuple[ASGIApp, Jobs]:
    """Return the application, and the jobs that end with it.

    Parameters
    ----------
    folder : Folder
        What it is about.
    access : Access
        Who may what.
    host : str
        Where it is served.
    cookie : str
        Name of the session's cookie.
    encryption : sequence of str
        Options of how pages are served there, for the live page of a campaign.
    """
    desk = Desk(folder, access, Commands(folder.root), cookie, PARTS)
    routes = [*_door(desk)]
    jobs = Jobs(desk)
    reports = Reports(desk, jobs)
    routes += [*jobs.routes(), *reports.routes()]
    pages = (
        Overview(desk),
        Beginning(desk),
        Prepare(desk),
        Check(desk, jobs),
        Start(desk),
        Campaigns(desk, jobs, reports, host, encryption),
        Results(desk, reports),
        Archive(desk),
    )
    for page in pages:
        desk.tabs.append(page.tab)
        routes += page.routes()
    return Gate(Starlette(routes=routes), access), jobs


def _door(desk: Desk) -> list[Route]:
    """Return the routes that anybody may use: the files of the pages, and showing a token."""

    async def static(request: Request) -> Response:
        return desk.file(request.path_params["name"])

    async def enter(request: Request) -> Response:
        content = await desk.content(request)
        if isinstance(content, Response):
            return content
        admitted = desk.access.admit(text_of(content, "token"))
        if admitted is None:
            await asyncio.sleep(WRONG_TOKEN_S)
            return refusal(403, "this token opens nothing here")
        session, rights = admitted
        response = JSONResponse({"rights": rights})
        desk.keep_session(response, session)
        return response

    return [
        Route("/static/{name}", static, methods=["GET"]),
        Route("/session", enter, methods=["POST"]),
    ]
