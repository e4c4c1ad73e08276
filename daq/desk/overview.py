"""The first page: what lies in the folder, what runs, and what cannot be read, with the reason."""

from __future__ import annotations

import asyncio

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from bufferstand.daq.desk.shell import Desk, Tab


class Overview:
    """The page of the folder.

    Parameters
    ----------
    desk : Desk
    """

    tab = Tab("/", "Folder")

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [self._desk.look("/", self.show)]

    async def show(self, request: Request) -> Response:
        """Show what was found."""
        contents = await asyncio.to_thread(self._desk.folder.contents)
        return self._desk.page(
            request,
            "overview.html",
            title="What is here",
            campaigns=contents.of_kind("campaign"),
            stands=contents.of_kind("stand"),
            specimens=contents.of_kind("specimen"),
            runs=contents.runs,
            cut=contents.cut,
            init=self._desk.commands.shown("init", "."),
        )
