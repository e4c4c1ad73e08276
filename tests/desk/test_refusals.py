"""Nothing moves for whoever is elsewhere, may only look on, or is another page: whatever else is right."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.desk.app import desk_app
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, Tokens
from tests.desk.served import Served, laboratory, served

MOVES = {
    "/start": {"campaign": "demo.toml", "specimen": "A-105-E-01", "out": "out", "simulate": True},
    "/campaign/resume": {"folder": "out", "specimen": "A-105-E-01"},
    "/check/zero": {"stand": "stand.toml", "id": "simulated-630kN"},
    "/check/tare": {"stand": "stand.toml"},
    "/check/jog": {"stand": "stand.toml", "id": "simulated-630kN", "by": "1"},
    "/check/twin": {"stand": "stand.toml", "what": "serve"},
    "/check/record": {"stand": "stand.toml", "lasting": "30s"},
}
"""What can set a stand in motion, with everything right that the page sends."""
ACTS = {
    **MOVES,
    "/prepare/plan": {"name": "demo.toml", "text": ""},
    "/prepare/save": {"name": "demo.toml", "text": "", "as": "x"},
    "/prepare/edit": {"name": "demo.toml", "text": ""},
    "/new": {"where": "x"},
    "/new/command": {"where": "x"},
    "/check/run": {"stand": "stand.toml"},
    "/campaign/stop": {"folder": "out", "after": "now"},
    "/campaign/note": {"folder": "out", "text": "x"},
    "/report": {"folder": ["out"]},
    "/report/verify": {"path": "out/report/report.pdf"},
    "/campaign/live": {"folder": "out"},
    "/start/plan": {"campaign": "demo.toml"},
    "/start/command": {"campaign": "demo.toml", "out": "out"},
}
TOKEN = "act-" + "c" * 20


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(laboratory(tmp_path_factory.mktemp("laboratory"))) as it:
        yield it


def files(folder: Path) -> set[str]:
    """Return everything that lies in a folder."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


def routes_that_act(folder: Path) -> set[str]:
    """Return the paths of the application that take a POST."""
    gate, _ = desk_app(Folder(folder), Access(Tokens(control=TOKEN), loopback=True), "127.0.0.1", "c")
    return {
        route.path
        for route in gate._app.routes  # type: ignore[attr-defined]
        if "POST" in route.methods
    }


def test_everything_that_acts_is_tried_here(desk: Served) -> None:
    ours = {path for path in routes_that_act(desk.folder) if not path.startswith(("/results", "/archive"))}
    assert ours == {*ACTS, "/session", "/job/{key}/stop"}


@pytest.mark.parametrize("path", ACTS)
def test_without_the_token_nothing_is_done(desk: Served, path: str) -> None:
    desk.cookie, before = "", files(desk.folder)
    status, said = desk.post(path, ACTS[path])
    assert status == 403
    assert "may only look on" in said["problem"]
    assert files(desk.folder) == before


@pytest.mark.parametrize("path", ACTS)
@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": ""},
        {"Content_Type": "text/plain"},
        {"Host": "evil.example"},
    ],
    ids=["foreign origin", "null", "no origin", "a form's type", "foreign host"],
)
def test_across_sites_nothing_is_done(desk: Served, path: str, headers: dict[str, str]) -> None:
    desk.cookie = ""
    desk.enter()
    before = files(desk.folder)
    assert desk.request("POST", path, ACTS[path], **headers)[0] in (403, 415, 421)
    assert desk.request("GET", path)[0] in (200, 404, 405), "a link does nothing"
    assert files(desk.folder) == before


@pytest.mark.parametrize("path", MOVES)
@pytest.mark.parametrize("address", ["192.168.1.7", "10.0.0.1", "fe80::1", "::ffff:192.168.1.7"])
def test_from_another_address_nothing_moves_whatever_the_token(
    tmp_path: Path, path: str, address: str
) -> None:
    laboratory(tmp_path)
    before = files(tmp_path)
    status, said = asyncio.run(asked(tmp_path, path, MOVES[path], address))
    assert status == 403
    assert "at the stand's own computer only" in said["problem"]
    assert files(tmp_path) == before


def test_from_another_address_one_may_still_plan_with_the_token(tmp_path: Path) -> None:
    laboratory(tmp_path)
    status, said = asyncio.run(asked(tmp_path, "/start/plan", {"campaign": "demo.toml"}, "192.168.1.7"))
    assert status == 200
    assert "Peak force" in said["html"]


async def asked(folder: Path, path: str, content: Any, address: str) -> tuple[int, Any]:
    """Ask the application as a browser at another address would, with the token for control."""
    access = Access(Tokens(view="look", control=TOKEN), loopback=False)
    app, _ = desk_app(Folder(folder), access, "0.0.0.0", "c")
    admitted = access.admit(TOKEN)
    assert admitted is not None
    host = b"192.168.1.2:8420"
    headers = [
        (b"host", host),
        (b"origin", b"http://" + host),
        (b"content-type", b"application/json"),
        (b"cookie", b"c=" + admitted[0].encode()),
    ]
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": "POST",
        "scheme": "http",
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "root_path": "",
        "headers": headers,
        "client": (address, 50000),
        "server": ("192.168.1.2", 8420),
    }
    body, sent = json.dumps(content).encode(), []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message: Any) -> None:
        sent.append(message)

    await app(scope, receive, send)
    text = b"".join(message.get("body", b"") for message in sent)
    return sent[0]["status"], json.loads(text)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"specimen": ""}, "was not typed"),
        ({"specimen": "other"}, "“other” was given, and the specimen is “A-105-E-01”"),
        ({"campaign": "none.toml"}, "no such file"),
        ({"campaign": "stand.toml"}, "campaign"),
        ({"out": "../out"}, "outside the desk's folder"),
        ({"out": "specimens"}, "is there already"),
        ({"out": " "}, "the name is empty"),
        ({"speed": "1000"}, "no such speed"),
    ],
    ids=str,
)
def test_a_start_with_something_wrong_leaves_nothing_behind(desk: Served, change: Any, said: str) -> None:
    desk.cookie = ""
    desk.enter()
    before = files(desk.folder)
    status, answer = desk.post("/start", {**MOVES["/start"], **change})
    assert status == 409
    assert said in answer["problem"]
    assert files(desk.folder) == before


def test_a_checklist_has_to_be_ticked_item_by_item(tmp_path: Path) -> None:
    laboratory(tmp_path)
    (tmp_path / "checklist.toml").write_text('items = ["hall clear", "hoses tight"]\n')
    with served(tmp_path) as it:
        it.enter()
        for ticked in ([], ["hall clear"], ["hall clear", "hoses"], "hall clear", None, [1, {"a": 2}]):
            status, said = it.post("/start", {**MOVES["/start"], "ticked": ticked})
            assert (status, "hoses tight" in said["problem"]) == (409, True), ticked
        (tmp_path / "checklist.toml").write_text("item = 3\n")
        status, said = it.post("/start", {**MOVES["/start"], "ticked": []})
        assert (status, "checklist.toml" in said["problem"]) == (409, True)
    assert not (tmp_path / "out").exists()
