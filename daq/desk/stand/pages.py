"""The page on which a stand is checked, touched off and moved slowly."""

from __future__ import annotations

import asyncio
import shutil
from itertools import groupby
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.folder import read_stand
from bufferstand.daq.desk.jobs import Job, Jobs
from bufferstand.daq.desk.shell import Desk, Tab, text_of
from bufferstand.daq.desk.stand.checklist import CHECKLIST_NAME, checklist_of, demand_id
from bufferstand.daq.monitor import is_loopback
from bufferstand.daq.zero import stored_zero
from bufferstand.drivers.stand_file import RecordingStand, StandFile, load_stand
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from bufferstand.protocols.campaign_file import load_campaign

MARKS = {"ok": "ok", "note": "note", "fault": "FAULT"}
STEPS_MM = ("-1", "-0.1", "0.1", "1")
"""What one push of a button moves: more takes a key that is held, in a terminal."""
READY = "serving at"
"""What a simulated stand says once it can be asked."""
SPEEDS = {"1", "2", "5", "10", "20"}
RECORDED = "recorded"
"""Folder, in the desk's, for what is recorded of stands that their own controllers move."""


class Check:
    """The page of a stand.

    Parameters
    ----------
    desk : Desk
    jobs : Jobs
        What runs the longer commands.
    """

    tab = Tab("/check", "Check")

    def __init__(self, desk: Desk, jobs: Jobs) -> None:
        self._desk = desk
        self._jobs = jobs
        self._twins: dict[Path, Job] = {}
        self._speeds: dict[Path, str] = {}

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/check", self.show),
            self._desk.act("/check/run", self.run),
            self._desk.act("/check/twin", self.twin, moves=True),
            self._desk.act("/check/record", self.record, moves=True),
            self._desk.act("/check/zero", self.zero, moves=True),
            self._desk.act("/check/tare", self.tare, moves=True),
            self._desk.act("/check/jog", self.jog, moves=True),
        ]

    async def show(self, request: Request) -> Response:
        """Show a stand, or the choice of one."""
        campaign, name = (request.query_params.get(key, "") for key in ("campaign", "stand"))
        if campaign and not name:
            name = self._desk.folder.name(
                await asyncio.to_thread(stand_of, self._desk.folder.inside(campaign))
            )
        if not name:
            contents = await asyncio.to_thread(self._desk.folder.contents)
            stands = contents.of_kind("stand")
            return self._desk.page(request, "check_choice.html", title="Check a stand", stands=stands)
        path = self._desk.folder.inside(name, ".toml")
        stand = await asyncio.to_thread(read_stand, path)
        moves = isinstance(stand, StandFile)
        specimens = [] if moves else (await asyncio.to_thread(self._desk.folder.contents)).of_kind("specimen")
        shown = self._desk.commands.shown
        return self._desk.page(
            request,
            "check.html",
            title=f"Check {stand.stand.name or stand.stand.id}",
            name=name,
            campaign=campaign,
            stand=stand,
            moves=moves,
            specimens=specimens,
            zero=_zero_text(path),
            items=checklist_of(path),
            checklist_name=CHECKLIST_NAME,
            twin=_has_twin(stand),
            twin_runs=self._runs(path),
            twin_speed=self._speed(path),
            disk=_disk_text(self._desk.folder.root),
            steps=STEPS_MM,
            commands={
                "check": shown("check", word_of(name)),
                "record": shown(
                    "record", word_of(name), "--out", RECORDED, "--specimen", "SPECIMEN.toml", "--for", "30s"
                ),
                "zero": shown("stand", "zero", word_of(name), "--specimen", "ID", "--yes-move", "STAND"),
                "twin": shown("simulate-stand", word_of(name), *(["--wait-for-reader"] if moves else [])),
            },
        )

    async def run(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Check the stand; return what was found as a list."""
        path = self._path(content)
        answer = await self._desk.commands.ask("check", word_of(self._desk.folder.name(path)), "--json")
        found = answer.json()
        if not isinstance(found, dict):
            raise BadInput(answer.problem or "the check said nothing")
        shown = self._desk.fragment(
            "findings.html",
            devices=_by_device(found["findings"]),
            faults=found["faults"],
            notes=sum(one["verdict"] == "note" for one in found["findings"]),
            command=answer.command,
            twin_speed=self._speed(path),
        )
        return JSONResponse({"html": shown, "faults": found["faults"]})

    async def twin(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Serve the stand's simulated twin, or end it."""
        path = self._path(content)
        running = self._runs(path)
        if content.get("what") == "end":
            if running:
                self._twins[path].stop()
                await asyncio.to_thread(self._twins[path].process.wait, 15.0)
            return JSONResponse({"running": False, "was": running})
        stand = await asyncio.to_thread(read_stand, path)
        if not _has_twin(stand):
            raise BadInput(
                "this stand has no simulated twin on this computer", remedy="it needs [simulation]"
            )
        speed = text_of(content, "speed") or "1"
        if speed not in SPEEDS:
            raise BadInput(
                "there is no such speed", remedy=f"give one of {', '.join(sorted(SPEEDS, key=int))}"
            )
        if not running:
            name = word_of(self._desk.folder.name(path))
            # It shares this computer with whoever reads it: it waits, as a rehearsal's stand does.
            how: tuple[str, ...] = ("--speed", speed, "--wait-for-reader")
            if isinstance(stand, RecordingStand):  # it moves by itself, in real time
                how, speed = (), "1"
            self._twins[path] = self._jobs.begin("simulate-stand", name, *how, ends_with_desk=True)
            self._speeds[path] = speed
        job = self._twins[path]
        while job.running and READY not in job.text:
            await asyncio.sleep(0.2)
        if not job.running:
            raise BadInput(f"the simulated stand could not be served: {job.text}")
        return JSONResponse({"running": True})

    async def record(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Record a stand that its own controller moves, for a time that is told: by who stands beside it.

        What is recorded may set the device's output that asks for a stop.
        """
        path, lasting = self._path(content), text_of(content, "lasting")
        if not lasting:
            raise BadInput("it was not said for how long: nothing recorded", remedy="write 30s, 10min or 2h")
        words = ["record", word_of(self._desk.folder.name(path)), "--out", RECORDED, f"--for={lasting}"]
        if chosen := text_of(content, "specimen"):
            specimen = self._desk.folder.inside(chosen, ".toml")
            words += ["--specimen", word_of(self._desk.folder.name(specimen))]
        if operator := text_of(content, "operator", 80):
            words.append(f"--operator={operator}")
        return _watched(self._jobs.begin(*words))

    async def zero(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Touch off the specimen."""
        path = self._path(content)
        name = word_of(self._desk.folder.name(path))
        words = ["stand", "zero", name, "--yes-move", await self._typed(content, path)]
        if campaign := text_of(content, "campaign"):
            await asyncio.to_thread(
                _demand_specimen_of, self._desk.folder.inside(campaign, ".toml"), text_of(content, "specimen")
            )
        for option, key in (("--specimen", "specimen"), ("--operator", "operator")):
            if said := text_of(content, key):
                words += [option, said]
        return _watched(self._jobs.begin(*words))

    async def tare(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Take what the channels read at rest for zero."""
        return _watched(
            self._jobs.begin("stand", "tare", word_of(self._desk.folder.name(self._path(content))))
        )

    async def jog(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Move the piston by a small step."""
        path, step = self._path(content), text_of(content, "by")
        name = word_of(self._desk.folder.name(path))
        if step not in STEPS_MM:
            raise BadInput("one push moves by 1 mm at most")
        words = ("stand", "jog", name, f"--by={step}", "--yes-move", await self._typed(content, path))
        return _watched(self._jobs.begin(*words))

    async def _typed(self, content: dict[str, Any], path: Path) -> str:
        """Return the stand's id as it was typed; another one is refused before any command is started."""
        typed = text_of(content, "id")
        if not typed:
            raise BadInput(
                "the stand's id was not typed: nothing was moved", remedy="see that everybody is clear of it"
            )
        stand = await asyncio.to_thread(load_stand, path)
        demand_id(typed, stand.stand.id, "stand", "go to the stand that is meant, and open its page")
        return typed

    def _runs(self, path: Path) -> bool:
        return path in self._twins and self._twins[path].running

    def _speed(self, path: Path) -> str:
        """Return how fast the twin runs that this desk serves; 1 where it serves none."""
        return self._speeds[path] if self._runs(path) else "1"

    def _path(self, content: dict[str, Any]) -> Path:
        return self._desk.folder.inside(text_of(content, "stand"), ".toml")


def stand_of(campaign: Path) -> Path:
    """Return the stand file that a campaign file names.

    Raises
    ------
    BadInput
        If the campaign file cannot be used.
    """
    return load_campaign(campaign).stand_path.resolve()


def _demand_specimen_of(campaign: Path, typed: str) -> None:
    """Refuse the touch-off of another specimen than that of the campaign that is prepared.

    Raises
    ------
    BadInput
        If they differ, or none was typed.
    """
    if not typed:
        raise BadInput(
            "the specimen's id was not typed: nothing was moved", remedy="read it off the specimen"
        )
    specimen = load_specimen(load_campaign(campaign).specimen_path).specimen.id
    demand_id(
        typed,
        specimen,
        "specimen",
        "put in the specimen that the campaign names, or open the stand’s page without a campaign",
    )


def _watched(job: Job) -> Response:
    return JSONResponse({"job": job.key, "command": job.command})


def _has_twin(stand: StandFile | RecordingStand) -> bool:
    """Return whether a stand is one that this computer can simulate at the place where it is looked for."""
    devices = stand.acquisition if isinstance(stand, RecordingStand) else (stand.controller,)
    hosts = [getattr(one, "host", None) for one in devices]
    return stand.simulation is not None and all(one is None or is_loopback(str(one)) for one in hosts)


def _zero_text(path: Path) -> str:
    try:
        zero = stored_zero(path)
    except BadInput as error:
        return str(error)
    return "" if zero is None else f"{zero.sentence()} ({zero.found:%Y-%m-%d %H:%M} UTC, {zero.how})"


def _disk_text(folder: Path) -> str:
    usage = shutil.disk_usage(folder)
    return f"{usage.free / 1e9:.1f} GB free of {usage.total / 1e9:.1f} GB"


def _by_device(findings: list[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    """Return the findings device by device, those with a fault first."""
    order = {one["device"]: at for at, one in reversed(list(enumerate(findings)))}
    rows = [
        {**one, "mark": MARKS.get(str(one["verdict"]), str(one["verdict"])), "age": _age(one["age_s"])}
        for one in findings
    ]
    rows.sort(key=lambda row: order[row["device"]])
    return [(device, list(found)) for device, found in groupby(rows, key=lambda row: row["device"])]


def _age(age_s: float | None) -> str:
    if age_s is None:
        return ""
    return f"{max(age_s, 0.0) * 1e3:.0f} ms old" if age_s < 1.0 else f"{age_s:.1f} s old"
