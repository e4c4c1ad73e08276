"""The guided beginning: a first stand, specimen and campaign, made by ``bufferstand init``."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.shell import Desk, Tab, text_of
from bufferstand.foundation import BadInput

OPTIONS = (
    "laboratory",
    "stand",
    "controller",
    "host",
    "port",
    "force-max",
    "stroke-max",
    "draw-wires",
    "thermometers",
    "specimen",
    "kind",
    "category",
    "elastic-system",
    "max-stroke",
    "campaign",
    "operator",
)
"""What the page asks, by the command's options; what is left empty is as the command has it."""
CALIBRATED = (("force", "kN"), ("stroke_1", "mm"), ("stroke_2", "mm"))
"""Channels whose certificates and coefficients are asked for, and their units."""
FURTHER = ("pressure", "acceleration")
"""Further channels that a controller can sample."""
RECORDED = "none"
"""Kind of controller of a stand that is recorded only: it has no campaign."""
FIRST_CAMPAIGNS = ("en15551", "sweeps", "warm-up")


class Beginning:
    """The page of the first files.

    Parameters
    ----------
    desk : Desk
    """

    tab = Tab("/new", "New")

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [self._desk.look("/new", self.show), self._desk.act("/new", self.make)]

    async def show(self, request: Request) -> Response:
        """Ask the questions."""
        here = not (self._desk.folder.root / "stand.toml").exists()
        command = self._desk.commands.shown("init", "." if here else "FOLDER")
        return self._desk.page(
            request,
            "new.html",
            title="New stand, specimen and campaign",
            where="." if here else "",
            calibrated=CALIBRATED,
            further=FURTHER,
            command=command,
        )

    async def make(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Have the files made."""
        where = text_of(content, "where") or "."
        self._desk.folder.within(where)
        words = ["init", word_of(where), "--yes"]
        words += [f"--{option}={said}" for option in OPTIONS if (said := text_of(content, option))]
        choices = [key for key in ("model", "second-force") if key in content]
        words += [f"--{key}" if content[key] is True else f"--no-{key}" for key in choices]
        words += [f"--further={name}" for name in FURTHER if content.get(f"further-{name}") is True]
        for channel, _ in CALIBRATED:
            number, until = text_of(content, f"certificate-{channel}"), text_of(content, f"until-{channel}")
            if number:
                words.append(f"--certificate={channel}={number}" + (f"@{until}" if until else ""))
            zero, slope = text_of(content, f"zero-{channel}"), text_of(content, f"slope-{channel}")
            if zero or slope:
                pair = (zero or "0", slope or "0")
                words.append(f"--coefficients={channel}=" + ",".join(one.replace(",", ".") for one in pair))
        answer = await self._desk.commands.ask(*words)
        if answer.status:
            raise BadInput(answer.problem)
        campaign = text_of(content, "campaign")
        name = campaign if campaign in FIRST_CAMPAIGNS else FIRST_CAMPAIGNS[0]
        place = "" if where == "." else f"{where.rstrip('/')}/"
        if text_of(content, "controller") == RECORDED:
            return JSONResponse({"stand": f"{place}stand.toml", "command": answer.command})
        return JSONResponse({"campaign": f"{place}{name}.toml", "command": answer.command})
