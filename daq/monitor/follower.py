"""Keeps the view up to date: from the campaign's own words where it can be heard, else from its files."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bufferstand.daq.monitor.campaign_view import (
    FolderWatch,
    campaign_section,
    line_words,
    page_words,
    steps_section,
    windows_section,
)
from bufferstand.daq.monitor.journal_tail import JournalTail, News, newest_journal
from bufferstand.daq.monitor.live_cycles import LiveCycles
from bufferstand.daq.monitor.past import BACK_S, KeptHistory
from bufferstand.daq.monitor.publisher import BUFFER_BYTES, LIVE_NAME
from bufferstand.daq.monitor.showing_results import show_results
from bufferstand.daq.monitor.temperatures import Temperatures, heat_of
from bufferstand.daq.monitor.view import View
from bufferstand.foundation import BadInput, short_address

if TYPE_CHECKING:
    from bufferstand.daq.campaign_folder import CampaignRecord

LOOK_S = 0.5
"""The folder is looked at this often [s]."""
SLOW_S = 2.0
"""Temperatures, forecast and guards of a page are renewed this often [s], guards four times as often."""
TAIL_S = 0.1
CYCLES_S = 0.5
"""Cycles of the run under way are evaluated this often at most [s]."""
SILENT_S = 15.0
"""A campaign that says it runs, but shows no sign of it for so long, has probably been killed [s]."""
LINES_KEPT = 200

Source = Literal["waiting", "live", "journal", "silent", "finished"]
"""Where the data come from: nothing there yet, told by the campaign, read from its journal, none of them."""


class Follower:
    """Follows one campaign's folder.

    Parameters
    ----------
    folder : Path
        It need not be there yet.
    view : View
        Is kept up to date.
    results : bool
        Evaluate the runs of a campaign that has ended.
    """

    def __init__(self, folder: Path, view: View, *, results: bool) -> None:
        self.folder = self._folder = folder
        self.view = self._view = view
        self.results = results
        self._past = KeptHistory(folder, view)
        self.history = self._past.history
        self._cycles = LiveCycles()
        self._watch = FolderWatch(folder)
        self._record: CampaignRecord | None = None
        self._temperatures = Temperatures()
        self._margins: list[dict[str, Any]] = []
        self._progress: dict[str, Any] = {}
        self._lines: deque[dict[str, Any]] = deque(maxlen=LINES_KEPT)
        self._pace: deque[tuple[float, float]] = deque(maxlen=600)
        self._at_s = -math.inf
        self._heard_s = time.monotonic()
        self._tail: JournalTail | None = None
        self._heard_at: dict[str, float] = {}
        self.source: Source = "waiting"
        self._was_recording = False
        self._looking = asyncio.Lock()
        self._stopping = False
        """Whether it ends before its plan does: nothing is foretold then."""
        self.ended = asyncio.Event()
        """The campaign has said that it is over, and its record how it ended has been read."""

    async def run(self) -> None:
        """Follow until cancelled."""
        await asyncio.gather(
            self._follow_folder(),
            self._follow_data(),
            self._renew(),
            self._evaluate_cycles(),
            self._past.run(),
        )

    @property
    def has_campaign(self) -> bool:
        """Return whether there is a campaign in the folder at all."""
        return self._record is not None

    # --- the folder --------------------------------------------------------------------------------

    async def _follow_folder(self) -> None:
        evaluated = ""
        while True:
            await self.look()
            record = self._record
            ended = record is not None and record.status != "running" and self.source == "finished"
            if record is not None and ended and self.results and evaluated != record.updated_utc:
                evaluated = record.updated_utc
                await show_results(self._folder, self._view)
            await asyncio.sleep(LOOK_S)

    async def look(self) -> None:
        """Show what has changed in the folder; whoever asks meanwhile waits until that is shown."""
        async with self._looking:
            await self._look_now()

    async def _look_now(self) -> None:
        news = await asyncio.to_thread(self._watch.look)
        if news.problem:
            self._view.put("problem", news.problem)
        if news.notes is not None:
            self._view.put("notes", news.notes)
        if news.twin is not None:
            self._view.put("twin", news.twin)
        if news.record is None:
            return
        if self._record is None or self._record.campaign_file != news.record.campaign_file:
            self._temperatures.heat = await asyncio.to_thread(
                heat_of, self._folder, news.record.campaign_file
            )
        self._record = news.record
        if news.zone is not None:
            self._view.put("zone", news.zone)
        try:
            self._view.put("campaign", campaign_section(news.record, self._folder))
            self._view.put("steps", steps_section(news.record))
            self._view.put("windows", await asyncio.to_thread(windows_section, news.record))
        except BadInput as error:
            self._view.put("problem", str(error))

    # --- data --------------------------------------------------------------------------------------

    async def _follow_data(self) -> None:
        while True:
            if await self._listen():
                continue
            if self._record is None:
                self._say_source("waiting")
            elif self._record.status != "running":
                self._let_go()
                self._say_source("finished")
                if self.history.first_s is None:
                    self._past.want(len(self._record.starts))
            elif await self._read_journal():
                self._say_source("journal")
                await asyncio.sleep(TAIL_S)
                continue
            elif time.monotonic() - self._heard_s > SILENT_S:
                self._say_source("silent")
            await asyncio.sleep(LOOK_S)

    async def _listen(self) -> bool:
        """Take what the campaign says until it says no more; return False if it cannot be heard."""
        path = self._folder / LIVE_NAME
        if not path.exists():
            return False
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as wire:
            wire.setblocking(False)
            try:
                with short_address(path) as address:
                    wire.connect(address)
            except OSError:
                return False
            packet = await _packet(wire)
            if not packet:
                return False  # a campaign that ends takes nobody on any more
            self._let_go()
            self._view.clear_rows()
            self._view.put("end", None)
            self._say_source("live")
            over = False
            while packet:
                said = json.loads(packet)
                self._heard(said)
                over = over or "end" in said
                packet = await _packet(wire)
        await self.look()
        if over:
            self.ended.set()
        return True

    def _heard(self, packet: dict[str, Any]) -> None:
        self._heard_s = time.monotonic()
        for stream, new in packet.get("readings", {}).items():
            self._temperatures.take(stream, new)
        if "guards" in packet:
            self._temperatures.guards = packet["guards"] or {}
        self._margins = packet.get("margins", self._margins)
        if packet.get("lines"):
            self._lines.extend(map(_in_page_words, packet["lines"]))
            self._view.put("events", list(self._lines))
        self._progress = packet.get("progress") or self._progress
        if "channels" in packet:
            self._name(packet["channels"])
        if "at_s" in packet:
            self._remember(packet["at_s"], packet["extremes"], packet.get("values", {}))
            if packet.get("recording"):
                self._collect(packet["rows"])
            elif self._was_recording:
                self._cycles.end()
            self._was_recording = bool(packet.get("recording"))
            self._pace.append((packet["wall_s"], packet["at_s"]))
            self._view.add_rows(packet["rows"])
        self._stopping = bool(packet.get("trip") or self._progress.get("stop_asked"))
        self._put_now(packet)
        if "end" in packet:
            end = packet["end"]
            self._view.put("end", {**end, "reason": page_words(end["reason"])})
            self._stopping = True
            self._put_temperature()

    def _name(self, channels: list[dict[str, Any]]) -> None:
        self.history.name(channels)
        self._cycles.name(channels)
        self._view.put("channels", [{"name": one["name"], "unit": one["unit"]} for one in channels])

    def _remember(
        self, at_s: float, extremes: Mapping[str, list[float | None]], values: Mapping[str, float | None]
    ) -> None:
        """Keep the extremes of what is sampled, and the newest value of what is read now and then."""
        if at_s < self._at_s - BACK_S:  # another start of the campaign
            self._cycles.restart()
            self._pace.clear()
        self._at_s = at_s
        read = {name: [value, value] for name, value in values.items() if name not in extremes}
        self._past.add(at_s, {**read, **extremes}, len(self._record.starts) if self._record else None)

    def _collect(self, rows: dict[str, Any]) -> None:
        """Collect samples of strokes that are part of a test."""
        self._cycles.begin(self._progress.get("step", 0))
        if self._progress.get("phase") != "touch":
            self._cycles.add(rows, str(self._progress.get("part") or ""))

    async def _evaluate_cycles(self) -> None:
        """Have the cycles of the run under way evaluated as they come, beside the loop."""
        while True:
            stretch, epoch = self._cycles.due(), self._cycles.epoch
            if stretch is not None:
                found = await asyncio.to_thread(self._cycles.evaluate, stretch)
                if epoch == self._cycles.epoch:
                    known = self._progress.get("temperatures_C") or {}
                    self._cycles.take(found, self._temperatures.warmest_C(known))
            if self._cycles.changed:
                self._cycles.changed = False
                for name, content in self._cycles.sections().items():
                    self._view.put(name, content)
            await asyncio.sleep(CYCLES_S)

    def _put_now(self, packet: dict[str, Any]) -> None:
        shown = {key: value for key, value in self._progress.items() if key != "warnings"}
        values = packet.get("values", {})
        self._view.put(
            "now",
            {
                **shown,
                "speed": self._speed(),
                "force_2_kN": values.get("force_2"),
                "tilt_mm": values.get("tilt"),
                "further": packet.get("further", []),
                "at_s": packet.get("at_s"),
                "recording": packet.get("recording", False),
                "trip": _shown_trip(packet.get("trip")),
                "stop_asked": page_words(str(self._progress.get("stop_asked") or "")),
                "dropped": packet.get("dropped", 0),
                "silent_s": packet.get("silent_s", {}),
            },
        )

    def _speed(self) -> float:
        """Return how many seconds of the stand pass in one of the wall, to one decimal."""
        if len(self._pace) < 2 or self._pace[-1][0] - self._pace[0][0] < 2.0:
            return 1.0
        (wall_0, at_0), (wall_1, at_1) = self._pace[0], self._pace[-1]
        return round((at_1 - at_0) / (wall_1 - wall_0), 1) or 1.0

    # --- the journal -------------------------------------------------------------------------------

    async def _read_journal(self) -> bool:
        """Take what the journal of the run under way has got; return whether there is any sign of life."""
        try:
            path = await asyncio.to_thread(newest_journal, self._folder / "runs")
            if path is None:
                self._let_go()
                return time.monotonic() - self._heard_s < SILENT_S
            if self._tail is None or self._tail.path != path:
                self._let_go()
                self._tail = JournalTail(path)
                self._view.clear_rows()
            self._take_news(await asyncio.to_thread(self._tail.poll))
        except (BadInput, OSError) as error:  # a journal of newer software, or a network drive that is gone
            self._view.put("problem", str(error))
            return False
        return time.monotonic() - self._heard_s < SILENT_S

    def _take_news(self, news: News) -> None:
        now_s = time.monotonic()
        self._margins = news.margins
        if news.guards is not None:
            self._temperatures.guards = news.guards
            self._name(news.channels)
        if news.lines:
            self._lines.extend(map(_in_page_words, news.lines))
            self._view.put("events", list(self._lines))
        for stream, new in news.readings.items():
            self._temperatures.take(stream, new)
        self._heard_at.update(dict.fromkeys(news.heard, now_s))
        if not news.samples:
            return
        self._heard_s = now_s
        self._view.add_rows(news.rows)
        step = next((s for s in self._record.steps if s.status == "running"), None) if self._record else None
        self._progress = {
            "step": step.index if step else 0,
            "steps": len(self._record.steps) if self._record else 0,
            "name": step.name if step else "",
            "phase": "motion",
            "cycle": step.cycles_done if step else 0,
            "cycles": 0,
            "force_kN": news.values.get("force"),
            "stroke_mm": news.values.get("stroke"),
            "temperatures_C": self._temperatures.newest_C(),
            "temperature_limit_C": None,
            "elapsed_s": None,
            "remaining_s": None,
            "lost": self._progress.get("lost", 0) + news.lost,
            "written": self._progress.get("written", 0) + news.samples,
            "durable": None,
        }
        self._remember(news.at_s, news.extremes, news.values)
        self._collect(news.rows)
        silent_s = {stream: round(now_s - at, 1) for stream, at in self._heard_at.items()}
        self._put_now({"values": news.values, "silent_s": silent_s, "recording": True})

    def _let_go(self) -> None:
        if self._tail is not None:
            self._tail.close()
            self._tail = None
            self._progress = {}

    # --- what changes slowly -----------------------------------------------------------------------

    def _say_source(self, source: Source) -> None:
        self.source = source
        self._view.put("source", {"kind": source})

    def _put_temperature(self) -> None:
        section = self._temperatures.section(self._record, self._progress, stopping=self._stopping)
        self._view.put("temperature", section)

    async def _renew(self) -> None:
        turn = 0
        while True:
            if self._temperatures.guards and self.source in ("live", "journal"):
                self._view.put("guards", self._margins)
                if turn % 4 == 0:
                    self._put_temperature()
            turn += 1
            await asyncio.sleep(SLOW_S / 4.0)


def _in_page_words(line: Mapping[str, Any]) -> dict[str, Any]:
    return {**line, "text": line_words(str(line["text"]))}


def _shown_trip(trip: dict[str, Any] | None) -> dict[str, Any] | None:
    return None if trip is None else {**trip, "reason": page_words(str(trip["reason"]))}


async def _packet(wire: socket.socket) -> bytes:
    """Return what a campaign says next; nothing where it says no more."""
    try:
        return await asyncio.get_running_loop().sock_recv(wire, BUFFER_BYTES)
    except ConnectionResetError:  # it ended, or died, before it had taken this listener on
        return b""
