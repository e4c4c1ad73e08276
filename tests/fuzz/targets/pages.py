"""Requests to the pages of monitor and desk, asked in this process: nothing is started, nothing moves."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Iterator, MutableMapping
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch
from urllib.parse import quote, unquote

from starlette.types import ASGIApp

from bufferstand.daq.desk import app as desk_module
from bufferstand.daq.desk.commands import Answer, Commands
from bufferstand.daq.monitor import app as monitor_module
from bufferstand.daq.monitor.access import Access, Tokens
from bufferstand.daq.monitor.actions import Actions
from bufferstand.daq.monitor.app import Pages
from bufferstand.daq.monitor.follower import Follower
from bufferstand.daq.monitor.view import View
from bufferstand.foundation.errors import BadInput
from tests.asgi import ADDRESS
from tests.desk.in_process import DeskInProcess
from tests.fuzz.mutators import either, of_json, of_text
from tests.fuzz.target import Case, Mutate, Target
from tests.fuzz.targets.from_files import SAMPLES
from tests.hostile.mutations import mutated

FOLDER = Path(__file__).parent.parent / "samples" / "campaign"
TOKENS = Tokens(view="look", control="act", free_view=True)
RUN = "runs/005-harmonic-20mm-20mm-1.27Hz.h5"
LOOKS = (
    ("/", ""),
    ("/new", ""),
    ("/prepare", "campaign=demo.toml"),
    ("/check", "stand=stand.toml"),
    ("/start", "campaign=demo.toml"),
    ("/campaign", "folder=run"),
    ("/campaign/state", "folder=run"),
    ("/results", "folder=runs"),
    ("/results", f"run={RUN}"),
    ("/results/evaluation", f"run={RUN}"),
    ("/results/curves", f"run={RUN}&cycle=1"),
    ("/archive", ""),
    ("/archive/runs", "where=force_kN>1"),
    ("/archive/run", f"path={RUN}"),
    ("/archive/table", "where=kind=='static'"),
    ("/report/made", "folder=runs"),
    ("/report/file", "path=runs/report.html"),
    ("/job/1", ""),
    ("/static/desk.css", ""),
)
"""Pages of the desk that are looked at, and queries of theirs."""
ACTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("/session", {"token": "x"}),
    ("/prepare/edit", {"campaign": "demo.toml", "edits": [{"path": ["step", 0, "cycles"], "value": 3}]}),
    ("/prepare/plan", {"campaign": "demo.toml"}),
    ("/prepare/save", {"campaign": "demo.toml", "text": "[campaign]\nid = 'a'\n"}),
    ("/new", {"folder": "lab", "specimen": "b", "stand": "s"}),
    ("/campaign/note", {"folder": "run", "text": "a note", "name": "A"}),
    ("/campaign/stop", {"folder": "run", "after": "cycle"}),
    ("/campaign/live", {"folder": "run"}),
    ("/campaign/resume", {"folder": "run", "confirm": "A-105"}),
    ("/check/run", {"stand": "stand.toml"}),
    ("/check/jog", {"stand": "stand.toml", "to_mm": 5.0, "speed_mm_per_s": 1.0}),
    ("/results/again", {"folder": "runs", "limits": "en15551-105mm"}),
    ("/report", {"folder": "runs", "language": "en"}),
    ("/report/verify", {"path": "report.pdf"}),
    ("/start", {"campaign": "demo.toml", "confirm": "A-105", "out": "out"}),
)
"""What the desk does, and what its pages send."""
OF_MONITOR = (
    ("GET", "/", "", ""),
    ("GET", "/static/monitor.js", "", ""),
    ("GET", "/session", "", ""),
    ("GET", "/history", "from=0&to=10.5&channels=force,stroke_1", ""),
    ("POST", "/session", "", '{"token": "act"}'),
    ("POST", "/stop", "", '{"after": "cycle", "name": "A"}'),
    ("POST", "/note", "", '{"text": "a", "name": "A"}'),
    ("POST", "/close", "", '{"name": "A"}'),
    ("WS", "/live", "", '{"a": 1}'),
)
LONGEST = 16_000
"""Bytes of a request's head that the server takes."""
HEADERS = ("host", "origin", "cookie", "content-type", "content-length", "x")


def request(method: str, path: str, query: str, body: str, cookie: str) -> bytes:
    """Return a request as a sample."""
    headers = [["host", ADDRESS], ["origin", f"http://{ADDRESS}"], ["content-type", "application/json"]]
    headers.append(["cookie", cookie])
    return json.dumps([method, path, query, headers, body, "127.0.0.1"]).encode()


def of_request(content: bytes, pick: Random) -> bytes:
    """Return a request of which one part or two are odd: path, query, a header, the body."""
    method, path, query, headers, body, client = json.loads(content)
    for _ in range(pick.randint(1, 2)):
        kind = pick.randrange(8)
        if kind == 0:
            path = _text(path, pick)
        elif kind in (1, 2):
            query = _text(query, pick, of_text)
        elif kind == 3:
            one = pick.choice(headers)
            one[1] = _text(one[1], pick)
        elif kind == 4:
            headers.append([pick.choice(HEADERS), _text(ADDRESS, pick)])
        elif kind == 5:
            method = pick.choice(("GET", "POST", "HEAD", "PUT", "OPTIONS", "WS", "é"))
        elif body.startswith("{"):
            body = either(of_json, of_json, of_text)(body.encode("latin-1"), pick).decode("latin-1")
        else:
            body = _text(body, pick)
    return json.dumps([method, path, query, headers, body, client]).encode()


def _text(text: str, pick: Random, mutate: Mutate = mutated) -> str:
    return mutate(text.encode("latin-1", "replace") or b"a", pick).decode("latin-1")


async def given(app: ASGIApp, content: bytes) -> int:
    """Ask an application, as a web server would; return its status."""
    method, path, query, headers, body, client = json.loads(content)
    raw = quote(path.encode("latin-1"), safe="/%")[:LONGEST]  # what is no ASCII, the server refuses
    query = quote(query.encode("latin-1"), safe="=&%+;/")[:LONGEST]
    socket = method == "WS"
    status, told = 0, iter([{"type": "websocket.connect"}, {"type": "websocket.receive", "text": body}])
    once = iter([{"type": "http.request", "body": body.encode("latin-1"), "more_body": False}])

    async def receive() -> dict[str, Any]:
        if socket:
            return next(told, {"type": "websocket.disconnect", "code": 1005})
        return next(once, {"type": "http.disconnect"})

    async def send(message: MutableMapping[str, Any]) -> None:
        nonlocal status
        status = message.get("status", status)

    scope = {
        "type": "websocket" if socket else "http",
        "method": method,
        "path": unquote(raw),
        "root_path": "",
        "raw_path": raw.encode(),
        "query_string": query.encode(),
        "server": ("127.0.0.1", 8420),
        "headers": [(name.encode("latin-1"), value.encode("latin-1")) for name, value in headers],
        "client": (client, 50000),
        "scheme": "ws" if socket else "http",
        "http_version": "1.1",
        "subprotocols": [],
    }
    await app(scope, receive, send)
    assert status < 500 or status == 503, f"status {status}"
    return status


@contextmanager
def monitor(folder: Path) -> Iterator[Case]:
    """Give requests to the page of a campaign."""
    shutil.copytree(FOLDER, folder / "run")
    access = Access(TOKENS, loopback=True)
    pages = Pages(Follower(folder / "run", View(), results=False), access, Actions(folder / "run"), 8420)
    admitted = access.admit("act")
    assert admitted is not None
    app, cookie = pages.app(), f"bufferstand-8420={admitted[0]}"
    corpus = [request(*one, cookie) for one in OF_MONITOR]
    with patch.object(monitor_module, "WRONG_TOKEN_S", 0.0):
        yield Case(corpus, lambda content: asyncio.run(given(app, content)), of_request)


async def _not_asked(self: Commands, *words: str, patience_s: float = 0.0) -> Answer:
    del patience_s
    return Answer(self.shown(*words), 2, "", "bufferstand: not run here")


def _not_begun(*_: object, **__: object) -> None:
    raise BadInput("nothing is started here")


@contextmanager
def desk(folder: Path) -> Iterator[Case]:
    """Give requests to the desk over a folder with samples; commands are not run."""
    root = folder / "laboratory"
    shutil.copytree(SAMPLES, root)
    shutil.copytree(FOLDER, root / "run")
    it = DeskInProcess(root)
    cookie = f"desk={it.session}"
    corpus = [request("GET", path, query, "", cookie) for path, query in LOOKS]
    corpus += [request("POST", path, "", json.dumps(content), cookie) for path, content in ACTS]
    with (
        it.jobs.ending(),
        patch.object(desk_module, "WRONG_TOKEN_S", 0.0),
        patch.object(Commands, "ask", _not_asked),
        patch.object(Commands, "begin", _not_begun),
    ):
        yield Case(corpus, lambda content: asyncio.run(given(it.app, content)), of_request)


PAGES = (
    Target("monitor", "requests to the live page, HTTP and WebSocket", monitor),
    Target("desk", "requests to the desk", desk, dose=15),
)
"""What comes over the web."""
