"""The page of the start: what will happen, the laboratory's checklist, and the specimen's id typed."""

from __future__ import annotations

import asyncio
from datetime import datetime
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.campaigns.launching import launch, note_of_start
from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.prepare import plan_view
from bufferstand.daq.desk.shell import Desk, Tab, text_of
from bufferstand.daq.desk.stand import checklist_of, demand_id, demand_ticked
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from bufferstand.protocols.campaign_file import Campaign, load_campaign

SPEEDS = ("1", "2", "5", "10", "20", "50")
RUNS_FOLDER = "campaigns"
"""Where a new campaign's folder is proposed."""
OTHER_SPECIMEN = (
    "put in the specimen that the campaign names, or name in the campaign (Prepare) the one that is in"
)


class Start:
    """The page of the start.

    Parameters
    ----------
    desk : Desk
    """

    tab = Tab("/start", "Start")

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/start", self.show),
            self._desk.act("/start/plan", self.plan),
            self._desk.act("/start/command", self.command),
            self._desk.act("/start", self.start, moves=True),
        ]

    async def show(self, request: Request) -> Response:
        """Show what a start would do, or the choice of a campaign."""
        name = request.query_params.get("campaign", "")
        if not name:
            contents = await asyncio.to_thread(self._desk.folder.contents)
            found = contents.of_kind("campaign")
            return self._desk.page(request, "start_choice.html", title="Start a campaign", campaigns=found)
        path = self._desk.folder.inside(name, ".toml")
        campaign = await asyncio.to_thread(load_campaign, path)
        stand = await asyncio.to_thread(load_stand, campaign.stand_path)
        out = self._free_name(campaign.id)
        return self._desk.page(
            request,
            "start.html",
            title=f"Start {campaign.content.campaign.title or campaign.id}",
            name=name,
            stand=stand,
            simulated=stand.simulation is not None,
            items=checklist_of(campaign.stand_path),
            out=out,
            speeds=SPEEDS,
            operator=campaign.content.campaign.operator,
            command=self._desk.commands.shown(*_words(name, {"out": out, "specimen": ""})),
        )

    async def plan(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Plan the campaign as it lies on the disk; what breaks a limit is refused here already."""
        name = self._desk.folder.name(self._desk.folder.inside(text_of(content, "campaign"), ".toml"))
        answer = await self._desk.commands.ask("plan", word_of(name), "--json")
        plan = answer.json()
        if answer.status or not isinstance(plan, dict):
            raise BadInput(answer.problem)
        return JSONResponse({"html": self._desk.fragment("start_plan.html", **plan_view(plan))})

    async def start(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Start it, from this computer, with the specimen's id and the checklist ticked."""
        path = self._desk.folder.inside(text_of(content, "campaign"), ".toml")
        specimen, operator = text_of(content, "specimen"), text_of(content, "operator", 80)
        if not specimen:
            raise BadInput(
                "the specimen's id was not typed: nothing was moved", remedy="read it off the specimen"
            )
        campaign = await asyncio.to_thread(load_campaign, path)
        items = checklist_of(campaign.stand_path)
        demand_ticked(items, content.get("ticked"))
        demand_id(specimen, await asyncio.to_thread(_specimen_of, campaign), "specimen", OTHER_SPECIMEN)
        out = self._desk.folder.new(text_of(content, "out"))
        name = self._desk.folder.name(out)
        await launch(self._desk, out, *_words(self._desk.folder.name(path), {**content, "out": name}))
        await note_of_start(self._desk, name, items, operator)
        return JSONResponse({"folder": name})

    async def command(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Return the command that does what the form says."""
        words = _words(text_of(content, "campaign"), content)
        return JSONResponse({"command": self._desk.commands.shown(*words)})

    def _free_name(self, campaign: str) -> str:
        """Return a name for the campaign's folder that nothing has yet."""
        day = datetime.now().astimezone().strftime("%Y-%m-%d")
        stem, number = f"{RUNS_FOLDER}/{campaign}-{day}", 1
        while (self._desk.folder.root / (name := stem if number == 1 else f"{stem}-{number}")).exists():
            number += 1
        return name


def _words(campaign: str, content: dict[str, Any]) -> list[str]:
    """Return the words of the command of a start, or of a rehearsal."""
    out, specimen = text_of(content, "out"), text_of(content, "specimen") or "SPECIMEN"
    words = ["run", word_of(campaign), "--out", word_of(out), "--yes-move", specimen]
    if content.get("simulate") is True:
        speed = text_of(content, "speed") or "1"
        if speed not in SPEEDS:
            raise BadInput("there is no such speed", remedy=f"give one of {', '.join(SPEEDS)}")
        words += ["--simulate", "--speed", speed]
    return words


def _specimen_of(campaign: Campaign) -> str:
    return load_specimen(campaign.specimen_path).specimen.id
