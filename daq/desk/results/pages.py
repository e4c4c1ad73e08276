"""The page of results: runs, loops, requirements, trends, other settings, a model, and the report."""

from __future__ import annotations

import asyncio
import json
import sys
from asyncio.subprocess import DEVNULL, PIPE
from collections.abc import Awaitable
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.chosen import RUN_SUFFIX, chosen_of
from bufferstand.daq.desk.reports import MODEL_MARK, Reports, head_of, toml_files
from bufferstand.daq.desk.results.evaluations import (
    OtherSettings,
    evaluated,
    evaluated_beside,
    settings_of,
)
from bufferstand.daq.desk.shell import Desk, Tab, refusal, unless_closed
from bufferstand.foundation import BadInput

TAB = Tab("/results", "Results")
MOST_LOOPS = 24
"""Loops that are drawn over each other at once: of more nobody tells one from the other."""
CURVES_S = 180.0
"""Longest wait for loops, and a model's answer [s]."""


class Results:
    """Its routes.

    Parameters
    ----------
    desk : Desk
    reports : Reports
        Of what is shown.
    """

    tab = TAB

    def __init__(self, desk: Desk, reports: Reports) -> None:
        self._desk = desk
        self._reports = reports
        self._free = asyncio.Semaphore(1)

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/results", self.page),
            self._desk.look("/results/evaluation", self.evaluation),
            self._desk.act("/results/again", self.again),
            self._desk.look("/results/curves", self.curves),
        ]

    async def page(self, request: Request) -> Response:
        """Show the page; what is on it is asked for by it."""
        if not request.query_params:
            contents = await asyncio.to_thread(self._desk.folder.contents)
            begun = [run for run in contents.runs if run.done or run.status != "running"]
            return self._desk.page(request, "results-choose.html", title="Results", campaigns=begun)
        chosen = chosen_of(self._desk.folder, request.query_params)
        limits = await asyncio.to_thread(self._limit_sets)
        report = await asyncio.to_thread(self._reports.form, chosen)
        return self._desk.page(
            request,
            "results.html",
            title="Results",
            chosen=chosen.paths,
            query=chosen.query,
            report=report,
            limits=limits,
        )

    async def evaluation(self, request: Request) -> Response:
        """Give the evaluation of what was chosen, with the settings that are the default."""
        return await _told(self._evaluated(request))

    async def _evaluated(self, request: Request) -> dict[str, Any]:
        chosen = chosen_of(self._desk.folder, request.query_params)
        return await evaluated(self._desk.commands, chosen, OtherSettings())

    async def again(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002
        """Evaluate with other settings, and say what has moved."""
        chosen, settings = chosen_of(self._desk.folder, content), settings_of(content)
        if settings == OtherSettings():
            raise BadInput("nothing is set otherwise than by default", remedy="change a setting first")
        return JSONResponse(await unless_closed(evaluated_beside(self._desk.commands, chosen, settings)))

    async def curves(self, request: Request) -> Response:
        """Give the loops of some runs, with a model's answer where one is named."""
        return await _told(self._curves(request.query_params.get("ask", "")))

    async def _curves(self, text: str) -> dict[str, Any]:
        """Return the loops that a page asks for, in JSON."""
        try:
            content = json.loads(text)
        except (ValueError, RecursionError):
            content = None
        asked = content.get("runs") if isinstance(content, dict) else None
        if not isinstance(asked, list) or not all(isinstance(one, dict) for one in asked):
            raise BadInput("a list of runs is expected")
        if not 0 < len(asked) <= MOST_LOOPS:
            raise BadInput(f"from 1 to {MOST_LOOPS} runs are drawn over each other", remedy="choose fewer")
        folder = self._desk.folder
        places = [folder.inside(str(one.get("path", "")), RUN_SUFFIX) for one in asked]
        names = list(map(folder.name, places))
        runs = [{"path": str(place), **_span(one)} for place, one in zip(places, asked, strict=True)]
        model = str(content.get("model") or "").strip()
        found = await self._computed(
            {"runs": runs, "model": str(folder.inside(model, ".toml")) if model else ""}
        )
        if "problem" in found:
            raise BadInput(found["problem"])
        for name, curve in zip(names, found["curves"], strict=True):
            curve["path"] = name
        shown = self._desk.commands.shown("model", "compare", model, *names)
        return {**found, "command": shown if model else ""}

    async def _computed(self, asked: dict[str, Any]) -> dict[str, Any]:
        async with self._free:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-P", "-m", "bufferstand.daq.desk.results.curves",
                stdin=PIPE, stdout=PIPE, stderr=DEVNULL,
            )  # fmt: skip
            try:
                async with asyncio.timeout(CURVES_S):
                    out, _ = await process.communicate(json.dumps(asked).encode())
            except TimeoutError:
                raise BadInput("this took too long and was ended", remedy="choose fewer runs") from None
            finally:
                if process.returncode is None:
                    process.kill()
                    await process.wait()
        try:
            found: dict[str, Any] = json.loads(out)
        except ValueError:
            raise BadInput("the loops could not be read: the process that reads them has ended") from None
        return found

    def _limit_sets(self) -> list[str]:
        """Return the limit sets that are shipped, and the files of others in the desk's folder."""
        from bufferstand.evaluation.requirements import shipped_names  # noqa: PLC0415 - takes a moment

        folder = self._desk.folder
        limits = list(shipped_names())
        for path in toml_files(folder.root):
            text = head_of(path)
            if MODEL_MARK not in text and "[applies]" in text and "standard" in text:
                limits.append(folder.name(path))
        return limits


async def _told(answer: Awaitable[dict[str, Any]]) -> Response:
    """Return an answer as JSON, or why there is none, so that the page can say it."""
    try:
        return JSONResponse(await unless_closed(answer))
    except BadInput as error:
        return refusal(409, str(error))


def _span(one: dict[str, Any]) -> dict[str, Any]:
    """Return the stretch of a run that is asked for: of a cycle, or None for all of it."""
    found = {}
    for key in ("from_s", "to_s"):
        value = one.get(key)
        found[key] = float(value) if isinstance(value, int | float) and abs(value) < 1e9 else None
    return found
