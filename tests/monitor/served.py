"""A campaign on a fake stand in a thread, slowed to the wall, and its page served by a real web process."""

from __future__ import annotations

import http.client
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome
from bufferstand.daq.monitor.access import Tokens
from bufferstand.daq.monitor.process import Address, WebProcess, web_process
from bufferstand.foundation.specimen.file import Specimen
from tests.daq.cases import Lines
from tests.daq.test_runner import Case

HACK = '<img src=x onerror="window.hacked=1"><script>window.hacked=1</script>'
"""What a specimen might be called by somebody with bad intentions."""
STEPS = f"""
[[step]]
kind = "harmonic"
name = '{HACK}'
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 400

[[step]]
kind = "harmonic"
prestress_mm = 10.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 3
"""
TOKENS = Tokens(view="look-" + "v" * 20, control="act-" + "c" * 20, free_view=False)
PATIENCE_S = 120.0


class Slow(Lines):
    """Lets a campaign in virtual time run about as fast as the wall: a snapshot comes every 0.1 s of it."""

    def __init__(self, pause_s: float = 0.05) -> None:
        super().__init__()
        self.pause_s = pause_s

    def update(self, progress: Any) -> None:
        super().update(progress)
        time.sleep(self.pause_s)


@dataclass
class Running:
    """A campaign under way."""

    case: Case
    thread: threading.Thread
    outcomes: list[CampaignOutcome] = field(default_factory=list)

    def perform(self) -> None:
        """Run the campaign; in its thread."""
        self.outcomes.append(self.case.run())

    def end(self) -> CampaignOutcome:
        """Let it end at its own pace, from now on as fast as it can."""
        self.case.shown.pause_s = 0.0  # type: ignore[attr-defined]
        self.thread.join(120.0)
        assert not self.thread.is_alive()
        return self.outcomes[0]


@contextmanager
def running(folder: Path, steps: str = STEPS, **options: Any) -> Iterator[Running]:
    """While inside, a campaign runs; it is stopped on the way out, if need be."""
    case = Case(folder, steps, **options)
    case.plan = replace(case.plan, specimen=Specimen(id=HACK))
    case.shown = Slow()
    going = Running(case, threading.Thread())
    going.thread = threading.Thread(target=going.perform)
    going.thread.start()
    try:
        until((case.out / "campaign.json").exists)
        yield going
    finally:
        from bufferstand.daq.operator.stop_request import StopLevel

        case.request.ask(StopLevel.NOW, "the test is over")
        going.end()


@dataclass
class Page:
    """A page that is served."""

    process: WebProcess
    links: list[str]
    cookie: str = ""

    @property
    def port(self) -> int:
        return int(self.links[0].split("http://127.0.0.1:")[1].split("/")[0])

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def request(
        self, method: str, path: str, content: Any = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """Make a request as our own page would, unless headers say otherwise (an empty one is left out)."""
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        sent = {"Host": f"127.0.0.1:{self.port}"}
        if method == "POST":
            sent |= {"Origin": self.origin, "Content-Type": "application/json"}
        if self.cookie:
            sent["Cookie"] = self.cookie
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        try:
            wire.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in sent.items():
                if value:
                    wire.putheader(name, value)
            if method == "POST":
                wire.putheader("Content-Length", str(len(body)))
            wire.endheaders(body if method == "POST" else None)
            answer = wire.getresponse()
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
        finally:
            wire.close()

    def enter(self, token: str) -> int:
        """Show a token; keep the cookie."""
        status, headers, _ = self.request("POST", "/session", {"token": token})
        if status == 200:
            self.cookie = headers["set-cookie"].split(";")[0]
        return status

    def live(self, **options: Any) -> ClientConnection:
        """Open the WebSocket."""
        given = {"origin": self.origin, "open_timeout": PATIENCE_S, "max_size": 1 << 24} | options
        headers = given.pop("additional_headers", {}) | ({"Cookie": self.cookie} if self.cookie else {})
        return connect(f"ws://127.0.0.1:{self.port}/live", additional_headers=headers, proxy=None, **given)


@contextmanager
def served(folder: Path, tokens: Tokens | None = TOKENS) -> Iterator[Page]:
    """While inside, a web process serves a folder's page on loopback."""
    links: list[str] = []
    with web_process(folder, Address(port=0), links.append, tokens) as process:
        yield Page(process, links)


def hear(wire: ClientConnection, enough: Any) -> dict[str, Any]:
    """Take messages until the sections (with ``rows`` and ``age_s``) satisfy; return them."""
    known: dict[str, Any] = {"rows": []}
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        message = json.loads(wire.recv(timeout=PATIENCE_S))
        known["rows"] += message.get("rows", [])
        known["age_s"] = message["age_s"]
        known |= message.get("sections", {})
        if enough(known):
            return known
    raise AssertionError(f"not within {PATIENCE_S} s; heard {sorted(known)}")


def until(what: Any, patience_s: float = PATIENCE_S) -> None:
    """Wait until something is true."""
    end_s = time.monotonic() + patience_s
    while not what():
        assert time.monotonic() < end_s, "not in time"
        time.sleep(0.02)
