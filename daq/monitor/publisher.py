"""The acquiring side of the live monitor: it tells whoever listens at the campaign's folder, and never waits.

A packet is one message of a non-blocking UNIX socket (``SOCK_SEQPACKET``), a JSON object, at most every
50 ms. A listener whose buffer is full loses rows, which are counted; lines and readings wait for the next
packet. Nothing that a listener does or leaves undone can delay a pass of the acquisition, and nothing that
it sends is read.
"""

from __future__ import annotations

import json
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.guards import CONTROLLER_STREAM, FORCE_2_STREAM, GuardSet
from bufferstand.daq.monitor.sample_rows import RowBuffer, channels_of, finite
from bufferstand.daq.motions import SafeStopReport
from bufferstand.daq.operator import CampaignProgress
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.foundation import bind_for_oneself

LIVE_NAME = "live"
"""Name of the socket in the campaign's folder."""
SCHEMA = "bufferstand/live/1"
INTERVAL_S = 0.05
"""Least time between two packets [s of the wall]."""
LISTENERS = 4
"""So many may listen at once: each is a web process that serves any number of pages."""
LINES_KEPT = 200
READINGS_KEPT = 600
"""Of each temperature sensor; when there are more, every second one is forgotten."""
MARGINS_S = 0.5
"""Guards say how far they are from their trips this often [s of the wall]."""
BUFFER_BYTES = 1 << 20
LAST_WORD_S = 4.0
"""How the campaign ended waits so long, in all, for listeners that are behind [s]; it is safe by then."""


@dataclass
class _Listener:
    """One who listens, and what it has still to be told."""

    wire: socket.socket
    lines: deque[dict[str, Any]]
    readings: dict[str, list[tuple[float, float]]]
    guards: GuardSet | None = None
    dropped: int = 0
    begun: bool = field(default=False)


class Publisher:
    """Tells listeners what a campaign does: samples, progress, readings, guards, lines.

    Parameters
    ----------
    server : socket
        Listens without blocking; None tells nobody.
    say : callable
        Shows a line to the operator.
    wall_s : callable
        Time of the wall [s].
    """

    def __init__(
        self,
        server: socket.socket | None,
        say: Callable[[str], object],
        wall_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._server = server
        self._say = say
        self._wall_s = wall_s
        self._listeners: list[_Listener] = []
        self._rows = RowBuffer()
        self._lines: deque[dict[str, Any]] = deque(maxlen=LINES_KEPT)
        self._readings: dict[str, list[tuple[float, float]]] = {}
        self._heard_s: dict[str, float] = {}
        self._progress: CampaignProgress | None = None
        self._guards: GuardSet | None = None
        self._guards_text: Any = None
        self._channels: list[dict[str, Any]] = []
        self._at_s = 0.0
        self._due_s = self._margins_due_s = wall_s()

    # --- what happens ------------------------------------------------------------------------------

    def update(self, progress: CampaignProgress) -> None:
        """Keep a snapshot for the next packet."""
        self._progress = progress

    def message(self, text: str) -> None:
        """Tell a line that must not be missed."""
        line = {"utc": _now(), "at_s": finite(self._at_s, 3), "text": text}
        self._lines.append(line)
        for listener in self._listeners:
            listener.lines.append(line)

    def take(self, block: ScaledBlock) -> None:
        """Take a block of any stream."""
        if not len(block):
            return
        self._heard_s[block.stream] = self._wall_s()
        if block.stream == CONTROLLER_STREAM:
            if self._listeners:
                self._rows.add(block)
        elif block.stream != FORCE_2_STREAM and block.stream in block.values:
            self._keep_reading(block)

    def _keep_reading(self, block: ScaledBlock) -> None:
        value = finite(float(block.values[block.stream][-1]), 3)
        if value is None:
            return
        reading = (round(block.received_s, 1), value)
        kept = self._readings.setdefault(block.stream, [])
        kept.append(reading)
        if len(kept) > READINGS_KEPT:
            del kept[1::2]
        for listener in self._listeners:
            listener.readings.setdefault(block.stream, []).append(reading)

    def look(self, acquisition: Acquisition) -> None:
        """Send a packet if it is time for one; called in every pass of the acquisition."""
        now_s = self._wall_s()
        if self._server is None or now_s < self._due_s:
            return
        self._due_s = now_s + INTERVAL_S
        try:
            self._at_s = acquisition.clock.now_s()
            self._accept()
            if self._listeners:
                self._send_all(self._packet(acquisition, now_s))
            else:
                self._rows.drop()
        except Exception as error:  # noqa: BLE001 - whatever is wrong with showing it, the campaign goes on
            self._give_up(error)

    def end(self, status: str, reason: str, stop: SafeStopReport | None = None) -> None:
        """Tell how the campaign ended, also those that are behind, and let everybody go.

        For after the safe stop: it may take :data:`LAST_WORD_S`.

        Parameters
        ----------
        status, reason : str
            Of the campaign.
        stop : SafeStopReport, optional
            What the stand was seen to be; None where it was not touched.
        """
        if self._server is None:
            return
        try:
            self._accept()
            for listener in self._listeners:
                listener.wire.settimeout(LAST_WORD_S / len(self._listeners))
            seen = None if stop is None else {"safe": stop.safe, "line": stop.line}
            self._send_all({"end": {"status": status, "reason": reason, "stand": seen}, **self._shown()})
        except Exception as error:  # noqa: BLE001 - as above
            self._give_up(error)
        self.close()

    def close(self) -> None:
        """Let everybody go."""
        if self._server is not None:
            self._server.close()  # first: nobody that is let go shall come back and find nothing
            self._server = None
        for listener in self._listeners:
            listener.wire.close()
        self._listeners.clear()

    def _give_up(self, error: Exception) -> None:
        self.close()
        self._say(f"the live monitor is told nothing more ({error!r}); the campaign goes on")

    # --- packets -----------------------------------------------------------------------------------

    def _shown(self) -> dict[str, Any]:
        if self._progress is None:
            return {}
        content = asdict(self._progress)
        for name in ("force_kN", "stroke_mm"):
            content[name] = finite(content[name], 3)
        return {"progress": content}

    def _packet(self, acquisition: Acquisition, now_s: float) -> dict[str, Any]:
        if not self._channels:
            stand = acquisition.stand
            self._channels = channels_of((stand.controller.facts, *(one.facts for one in stand.sensors)))
        rows, extremes = self._rows.take()
        latest, trip = acquisition.latest, acquisition.panel.trip
        if acquisition.panel.guards is not self._guards:
            self._guards = acquisition.panel.guards
            self._guards_text = self._guards.as_dict()
        return {
            "at_s": round(self._at_s, 3),
            "wall_s": round(now_s, 3),
            "utc": _now(),
            "rows": rows,
            "extremes": extremes,
            "values": {name: finite(value) for name, value in latest.values.items()},
            "further": further_channels(acquisition),
            "silent_s": {name: round(now_s - heard_s, 2) for name, heard_s in self._heard_s.items()},
            "samples": latest.samples,
            "lost": latest.lost,
            "trip": None if trip is None else {"reason": trip.reason, **trip.facts()},
            "recording": acquisition.log.recorder is not None,
            **self._margins(acquisition, now_s),
            **self._shown(),
        }

    def _margins(self, acquisition: Acquisition, now_s: float) -> dict[str, Any]:
        """Return how far every guard is from its trip, where that is due."""
        if now_s < self._margins_due_s:
            return {}
        self._margins_due_s = now_s + MARGINS_S
        margins = acquisition.panel.margins(acquisition.clock.wall_s())
        return {"margins": [margin.as_dict() for margin in margins]}

    def _send_all(self, packet: dict[str, Any]) -> None:
        samples = len((packet.get("rows") or {}).get("t", ()))
        common = json.dumps(packet, allow_nan=False, separators=(",", ":"))
        self._listeners = [one for one in self._listeners if self._send(one, common, samples)]

    def _send(self, listener: _Listener, common: str, samples: int) -> bool:
        """Send a packet with what only this listener lacks; return whether it is still there."""
        own: dict[str, Any] = {"dropped": listener.dropped}
        if not listener.begun:
            own |= {"schema": SCHEMA, "channels": self._channels}
        if listener.lines:
            own["lines"] = list(listener.lines)
        if listener.readings:
            own["readings"] = listener.readings
        if listener.guards is not self._guards:
            own["guards"] = self._guards_text
        text = f"{common[:-1]},{json.dumps(own, allow_nan=False, separators=(',', ':'))[1:]}"
        try:
            listener.wire.send(text.encode(), socket.MSG_NOSIGNAL)
        except BlockingIOError:
            listener.dropped += samples
            for kept in listener.readings.values():
                del kept[:-READINGS_KEPT]
            return True
        except OSError:
            listener.wire.close()
            return False
        listener.begun, listener.guards = True, self._guards
        listener.lines.clear()
        listener.readings = {}
        return True

    def _accept(self) -> None:
        if self._server is None:
            return
        with suppress(OSError):
            while len(self._listeners) < LISTENERS:
                wire, _ = self._server.accept()
                wire.setblocking(False)
                wire.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
                history = {name: list(kept) for name, kept in self._readings.items()}
                lines = deque(self._lines, maxlen=LINES_KEPT)
                self._listeners.append(_Listener(wire, lines, history))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@contextmanager
def publishing(folder: Path, say: Callable[[str], object]) -> Iterator[Publisher]:
    """While inside, tell whoever listens at ``live`` in a campaign's folder.

    A folder that takes no sockets is no reason not to run: nobody is told then.
    """
    path, server = folder / LIVE_NAME, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    bound = False
    try:
        path.unlink(missing_ok=True)
        bind_for_oneself(server, path)
        server.listen(LISTENERS)
        server.setblocking(False)
        bound = True
    except OSError:
        pass
    publisher = Publisher(server if bound else None, say)
    try:
        yield publisher
    finally:
        publisher.close()
        server.close()
        if bound:
            with suppress(OSError):
                path.unlink()


def further_channels(acquisition: Acquisition) -> list[dict[str, Any]]:
    """Return name, newest value and unit of the stand's channels that have no place of their own."""
    latest, stand = acquisition.latest, acquisition.stand
    thermometers = {one.facts.name for one in stand.sensors if one.facts.name == one.facts.channels[0].name}
    streams = (stand.controller.facts, *(one.facts for one in stand.sensors))
    return [
        {"name": one.name, "value": finite(latest.values[one.name]), "unit": one.unit}
        for facts in streams
        for one in facts.channels
        if facts.name not in thermometers
        and one.quantity not in ("stroke", "position", "command")
        and one.name not in ("force", "force_2")
        and one.name in latest.values
    ]
