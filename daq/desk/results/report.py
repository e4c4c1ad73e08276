"""The test report: made by ``bufferstand report``, shown, and signed where a key is given."""

from __future__ import annotations

import asyncio
import os
import tempfile
from collections.abc import Awaitable
from pathlib import Path
from typing import Any, TypeVar

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.results.chosen import Chosen, chosen_of
from bufferstand.daq.desk.shell import Desk, text_of
from bufferstand.foundation import BadInput

REPORT_S = 1200.0
"""Longest wait for a report [s]."""
T = TypeVar("T")
OUT = "report"
"""Folder of a campaign's report, in the campaign's folder."""
SHOWN = {
    ".html": "text/html; charset=utf-8",
    ".pdf": "application/pdf",
    ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    ".xml": "application/xml",
    ".json": "application/json",
    ".csv": "text/csv; charset=utf-8",
}
"""Files of a report that are given out."""
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'; sandbox allow-same-origin allow-popups"
)
"""What a report may do when it is shown: it is a text with pictures in it, and runs nothing."""
LANGUAGES = ("", "en", "de", "cs", "fr")
ANNEXES = ("", "short", "full")


class Reports:
    """Its routes.

    Parameters
    ----------
    desk : Desk
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.act("/results/report", self.make),
            self._desk.look("/results/file", self.show),
        ]

    def place(self, chosen: Chosen) -> str:
        """Return the folder of a report, from the desk's folder: that of its campaign, or beside its runs."""
        first = chosen.places[0]
        home = first if first.is_dir() else first.parent
        name = (
            OUT if len(chosen.places) == 1 and first.is_dir() else f"{OUT}-{len(chosen.places)}-{first.stem}"
        )
        return self._desk.folder.name(home / name)

    def made(self, chosen: Chosen) -> list[str]:
        """Return the files of the report that was made last, from the desk's folder; blocking."""
        place = self._desk.folder.root / self.place(chosen)
        try:
            found = sorted(one for one in place.iterdir() if one.suffix in SHOWN and one.is_file())
        except OSError:
            return []
        return [self._desk.folder.name(one) for one in found]

    async def make(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002
        """Make the report of what was chosen."""
        chosen = chosen_of(self._desk.folder, content)
        words = ["report", *chosen.words, "--out", word_of(self.place(chosen))]
        for option, value, known in (
            ("--language", text_of(content, "language"), LANGUAGES),
            ("--annex", text_of(content, "annex"), ANNEXES),
        ):
            if value not in known:
                raise BadInput(f"{option} is one of {', '.join(filter(None, known))}")
            if value:
                words += [option, value]
        if model := text_of(content, "model"):
            words += ["--model", word_of(self._desk.folder.name(self._desk.folder.inside(model, ".toml")))]
        key, password = text_of(content, "key", 1000), str(content.get("password") or "")[:4096]
        if key:
            words += ["--sign", key if key.startswith("pkcs11:") else word_of(self._key(key))]
        answer = await unless_closed(self._asked(words, password if key else ""))
        files = await asyncio.to_thread(self.made, chosen)
        if answer.status not in (0, 1) or not files:
            raise BadInput(answer.problem or f"the report ended with status {answer.status}")
        shown = self._desk.commands.shown(*words)
        return JSONResponse({"files": files, "command": shown, "said": answer.problem})

    def _key(self, relative: str) -> str:
        return self._desk.folder.name(self._desk.folder.inside(relative))

    async def _asked(self, words: list[str], password: str) -> Any:
        """Run the command; a password goes by a file that only this user can read, and is gone then."""
        if not password:
            return await self._desk.commands.ask(*words, patience_s=REPORT_S)
        handle, name = tempfile.mkstemp(prefix="bufferstand-desk-")  # mode 0600
        try:
            os.write(handle, password.partition("\n")[0].encode() + b"\n")
            os.close(handle)
            asked = (*words, "--sign-password-file", name)
            return await self._desk.commands.ask(*asked, patience_s=REPORT_S)
        finally:
            Path(name).unlink(missing_ok=True)

    async def show(self, request: Request) -> Response:
        """Give a file of a report."""
        path = self._desk.folder.inside(request.query_params.get("path", ""))
        if path.suffix not in SHOWN or not path.is_file() or not path.parent.name.startswith(OUT):
            raise BadInput("this is no file of a report", file=path.name)
        content = await asyncio.to_thread(path.read_bytes)
        headers = {"Content-Type": SHOWN[path.suffix]}
        if path.suffix == ".html":
            headers["Content-Security-Policy"] = POLICY
        elif path.suffix != ".pdf":
            headers["Content-Disposition"] = f'attachment; filename="{_plain(path.name)}"'
        return Response(content, headers=headers)


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


def _plain(name: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "_" for c in name)
