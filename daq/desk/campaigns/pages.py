"""The page of a campaign: how far it is, its live page, stop, resume, notes, report."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.campaign_folder import CampaignRecord, load_record
from bufferstand.daq.desk.campaigns.launching import LOG_NAME, launch, note_of_start
from bufferstand.daq.desk.chosen import Chosen
from bufferstand.daq.desk.commands import tail_of, word_of
from bufferstand.daq.desk.jobs import Job, Jobs
from bufferstand.daq.desk.reports import Reports
from bufferstand.daq.desk.shell import Desk, Tab, text_of
from bufferstand.daq.desk.stand import checklist_of, demand_id, demand_ticked
from bufferstand.daq.monitor import note_words, page_words
from bufferstand.daq.operator import read_notes
from bufferstand.foundation import BadInput

AFTER = ("now", "cycle", "step")
LINK_S = 20.0
"""Longest wait for the live page's link [s]."""
SHOWN_NOTES = 30
MOST_SHOWN = 4000
"""So many characters of what the command has written are shown."""
_LINK = re.compile(r"https?://\S+:(\d+)/(#\S+)?")


class Campaigns:
    """The page of a campaign's folder.

    Parameters
    ----------
    desk : Desk
    jobs : Jobs
    reports : Reports
        Of a campaign.
    host : str
        Where the desk is served: the live page is served there, too.
    encryption : sequence of str
        Options of how.
    """

    tab = Tab("/campaign", "Campaigns")

    def __init__(
        self, desk: Desk, jobs: Jobs, reports: Reports, host: str, encryption: Sequence[str] = ()
    ) -> None:
        self._encryption = tuple(encryption)
        self._desk = desk
        self._jobs = jobs
        self._reports = reports
        self._host = f"[{host}]" if ":" in host else host
        self._pages: dict[Path, Job] = {}
        self._opening = asyncio.Lock()

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/campaign", self.show),
            self._desk.look("/campaign/state", self.state),
            self._desk.act("/campaign/live", self.live),
            self._desk.act("/campaign/stop", self.stop),
            self._desk.act("/campaign/note", self.note),
            self._desk.act("/campaign/resume", self.resume, moves=True),
        ]

    async def show(self, request: Request) -> Response:
        """Show a campaign, or all."""
        name = request.query_params.get("folder", "")
        if not name:
            contents = await asyncio.to_thread(self._desk.folder.contents)
            return self._desk.page(
                request, "campaigns.html", title="Campaigns that were started", runs=contents.runs
            )
        folder, record = await asyncio.to_thread(self._known, name)
        shown = self._desk.commands.shown
        items, problem = await asyncio.to_thread(_checklist_shown, record)
        return self._desk.page(
            request,
            "campaign.html",
            title=str(record.plan.get("campaign", {}).get("title") or name),
            name=name,
            pieces=await self._pieces(folder, record),
            items=items,
            checklist_problem=problem,
            operator=str(record.plan.get("campaign", {}).get("operator") or ""),
            report=await asyncio.to_thread(self._reports.form, Chosen((name,), (folder,))),
            commands={
                "live": shown("monitor", word_of(name)),
                "stop": shown("stop", word_of(name), "--after", "cycle"),
                "resume": shown("resume", word_of(name), "--yes-move", "SPECIMEN"),
            },
        )

    async def state(self, request: Request) -> Response:
        """Give what changes on the page."""
        name = request.query_params.get("folder", "")
        folder, record = await asyncio.to_thread(self._known, name)
        run = await asyncio.to_thread(self._desk.folder.run, folder)
        return JSONResponse({**await self._pieces(folder, record), "status": run.status})

    async def live(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Serve the live page of the campaign, if it is not there yet; return its link."""
        folder, _ = await asyncio.to_thread(self._known, text_of(content, "folder"))
        name = word_of(self._desk.folder.name(folder))
        async with self._opening:
            page = self._pages.get(folder)
            if page is None or not page.running:
                words = ("monitor", name, "--address", f"{self._host}:0", *self._encryption)
                page = self._pages[folder] = self._jobs.begin(*words, ends_with_desk=True)
            loop = asyncio.get_running_loop()
            end_s = loop.time() + LINK_S
            while not (links := [found for found in _LINK.finditer(page.text) if found[2]]):
                if not page.running or loop.time() > end_s:
                    raise BadInput(f"the live page cannot be served: {page.text}")
                await asyncio.sleep(0.1)
        return JSONResponse({"link": links[-1][0], "command": page.command})

    async def stop(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Ask the campaign to stop: now, after the cycle, after the step."""
        folder, after = self._folder(content), text_of(content, "after")
        if after not in AFTER:
            raise BadInput("there is no such stop", remedy=f"give one of {', '.join(AFTER)}")
        words = ("stop", word_of(self._desk.folder.name(folder)))
        answer = await self._desk.commands.ask(*words, *(() if after == "now" else ("--after", after)))
        if answer.status:
            raise BadInput(answer.problem)
        return JSONResponse({"said": f"Asked: {answer.out.strip()}.", "command": answer.command})

    async def note(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Add a note."""
        folder, text = self._folder(content), text_of(content, "text", 2000)
        who = text_of(content, "who", 60)
        words = ("note", "--", word_of(self._desk.folder.name(folder)), f"{text} ({who})" if who else text)
        answer = await self._desk.commands.ask(*words)
        if answer.status:
            raise BadInput(answer.problem)
        return JSONResponse({"said": "noted"})

    async def resume(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Go on with the campaign, from this computer, with the specimen's id and the checklist ticked."""
        folder, record = await asyncio.to_thread(self._known, text_of(content, "folder"))
        specimen, edits = text_of(content, "specimen"), text_of(content, "edits")
        if not specimen:
            raise BadInput(
                "the specimen's id was not typed: nothing was moved", remedy="read it off the specimen"
            )
        items = await asyncio.to_thread(_checklist, record)
        demand_ticked(items, content.get("ticked"))
        meant = str(record.plan.get("specimen", {}).get("id", ""))
        if meant and edits != "take":  # the edits may name another one: the command looks
            demand_id(specimen, meant, "specimen", "put in the specimen of this campaign")
        name = self._desk.folder.name(folder)
        words = ["resume", word_of(name), "--yes-move", specimen]
        words += {"take": ["--take-edits"], "keep": ["--keep"]}.get(edits, [])
        await launch(self._desk, folder, *words, add=True)
        await note_of_start(self._desk, name, items, text_of(content, "operator", 80))
        return JSONResponse({"said": "it goes on"})

    def _folder(self, content: dict[str, Any]) -> Path:
        return self._known(text_of(content, "folder"))[0]

    def _known(self, name: str) -> tuple[Path, CampaignRecord]:
        folder = self._desk.folder.inside(name)
        record = load_record(folder) if folder.is_dir() else None
        if record is None:
            raise BadInput("there is no campaign in this folder", file=name[:200])
        return folder, record

    async def _pieces(self, folder: Path, record: CampaignRecord) -> dict[str, str]:
        """Return what changes on the page as HTML: how far it is, and what was written down."""
        run = await asyncio.to_thread(self._desk.folder.run, folder)
        state = self._desk.fragment(
            "campaign_state.html",
            run=run,
            simulated=record.simulated,
            steps=[replace(step, reason=page_words(step.reason)) for step in record.steps],
        )
        written = tail_of(folder / LOG_NAME)[-MOST_SHOWN:]
        return {
            "state": state,
            "record": self._desk.fragment("campaign_record.html", notes=_notes(folder), log=written),
        }


def _checklist(record: CampaignRecord) -> tuple[str, ...]:
    """Return the checklist of the stand that the campaign was started on."""
    return checklist_of(Path(record.stand_folder) / "stand.toml") if record.stand_folder else ()


def _checklist_shown(record: CampaignRecord) -> tuple[tuple[str, ...], str]:
    """Return the checklist and what is wrong with it: the page comes all the same, it has the stop on it."""
    try:
        return _checklist(record), ""
    except BadInput as error:
        return (), str(error)


def _notes(folder: Path) -> list[tuple[str, str]]:
    """Return the last notes, with when they were written in the time of this computer."""
    try:
        notes = read_notes(folder)[-SHOWN_NOTES:]
    except (OSError, BadInput):
        return []
    return [(note.utc, note_words(note.text)) for note in notes]
