"""The web process spoken to as a browser, a stranger and a nuisance would, over real sockets."""

from __future__ import annotations

import json
import logging
import os
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from bufferstand.daq.monitor.app import KEPT_FOR_CONTROL, MOST_PAGES
from bufferstand.daq.monitor.server import BoundedLog
from bufferstand.daq.operator.notes import read_notes
from bufferstand.recording.runfile.file import open_run
from tests.monitor.served import HACK, TOKENS, Page, Running, hear, running, served, until


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("monitor")) as going:
        yield going


@pytest.fixture(scope="module")
def one_page(campaign: Running) -> Iterator[Page]:
    with served(campaign.case.out) as it:
        yield it


@pytest.fixture
def page(one_page: Page) -> Page:
    """The same web process for all; nobody has shown a token yet."""
    return Page(one_page.process, one_page.links)


def actions(folder: Path) -> list[dict[str, str]]:
    path = folder / "actions.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


@pytest.mark.slow
def test_a_page_is_told_everything_that_it_shows(page: Page) -> None:
    assert page.enter(TOKENS.view) == 200
    with page.live() as wire:
        known = hear(
            wire,
            lambda k: (
                len(k["rows"]) > 5
                and {"campaign", "steps", "now", "guards", "temperature", "events"} <= set(k)
            ),
        )
    assert known["campaign"]["specimen"]["id"] == HACK
    assert [step["status"] for step in known["steps"]] == ["running", "pending"]
    assert known["steps"][0]["name"] == HACK, "as it is: the page sets it as text"
    assert known["now"]["steps"] == 2
    assert known["now"]["written"] >= known["now"]["durable"] >= 0
    assert known["now"]["remaining_s"] > 0.0
    strokes = [s / 1000.0 for packet in known["rows"] for s in packet["s"]]
    assert -0.5 < min(strokes) <= max(strokes) < 15.5
    assert known["age_s"] < 5.0
    guards = {guard["name"]: guard for guard in known["guards"]}
    assert {"force", "stroke", "temperature_1", "silence controller", "disk"} <= set(guards)
    assert 0.0 <= guards["stroke"]["share"] < 1.0
    assert known["temperature"]["sensors"][0]["points"]
    assert any(line["text"].startswith("step 1 of 2") for line in known["events"])


def test_rows_come_at_most_twenty_times_a_second_and_move_on(page: Page) -> None:
    page.enter(TOKENS.view)
    with page.live() as wire:
        hear(wire, lambda k: k["rows"])
        began_s, messages, last_us = time.monotonic(), 0, 0
        while time.monotonic() - began_s < 1.5:
            message = json.loads(wire.recv(timeout=60))
            messages += 1
            for packet in message.get("rows", []):
                assert packet["t0_us"] > last_us
                last_us = packet["t0_us"] + 100 * packet["t"][-1]
                assert len(packet["t"]) <= 100
    assert messages <= 1.5 * 20 + 2


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "localhost.evil.example", "10.0.0.1"],
)
def test_a_name_that_was_bent_to_this_machine_is_not_served(page: Page, host: str) -> None:
    page.enter(TOKENS.control)
    assert page.request("GET", "/", Host=host)[0] in (400, 421)
    assert page.request("GET", "/session", Host=host)[0] in (400, 421)
    status, _, _ = page.request("POST", "/stop", {"after": "now"}, Host=host, Origin=f"http://{host}")
    assert status in (400, 421)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "", "https://127.0.0.1", "http://127.0.0.1:1"]
)
def test_a_foreign_pages_requests_are_refused(page: Page, campaign: Running, origin: str) -> None:
    page.enter(TOKENS.control)
    for path, content in (
        ("/stop", {"after": "now"}),
        ("/note", {"text": "x"}),
        ("/session", {"token": "x"}),
    ):
        assert page.request("POST", path, content, Origin=origin)[0] == 403
    with pytest.raises(InvalidStatus), page.live(origin=origin or None):
        pass
    assert campaign.thread.is_alive()
    assert campaign.case.request.level == 0
    assert any("foreign page" in line["what"] for line in actions(campaign.case.out))


def test_without_a_token_nothing_is_shown_and_nothing_done(page: Page, campaign: Running) -> None:
    assert page.enter("wrong") == 403
    assert page.enter("") == 403
    assert page.enter(TOKENS.view[:-1]) == 403
    assert json.loads(page.request("GET", "/session")[2])["rights"] == "none"
    with pytest.raises(InvalidStatus), page.live():
        pass
    page.cookie = f"bufferstand-{page.port}=made-up"
    with pytest.raises(InvalidStatus), page.live():
        pass
    assert page.request("POST", "/stop", {"after": "now"})[0] == 403
    assert campaign.case.request.level == 0


def test_whoever_may_look_may_not_act(page: Page, campaign: Running) -> None:
    assert page.enter(TOKENS.view) == 200
    assert json.loads(page.request("GET", "/session")[2])["rights"] == "view"
    for path, content in (("/stop", {"after": "now"}), ("/note", {"text": "x"})):
        status, _, body = page.request("POST", path, content)
        assert status == 403
        assert "only look on" in json.loads(body)["problem"]
    assert campaign.case.request.level == 0
    assert read_notes(campaign.case.out) == ()
    assert {"who": "someone at 127.0.0.1", "what": "stop", "outcome": "refused"}.items() <= actions(
        campaign.case.out
    )[-2].items()


@pytest.mark.slow
def test_on_loopback_looking_is_free_and_acting_is_not(campaign: Running) -> None:
    with served(campaign.case.out, None) as page:
        with page.live() as wire:
            hear(wire, lambda k: k["rows"])
        assert page.request("POST", "/stop", {"after": "now"})[0] == 403
        (control,) = [link for link in page.links if "#" in link]
        assert page.enter(control.split("#")[1]) == 200
        assert json.loads(page.request("GET", "/session")[2])["rights"] == "control"


def test_the_cookie_is_kept_from_scripts_and_from_other_sites(page: Page) -> None:
    _, headers, body = page.request("POST", "/session", {"token": TOKENS.control})
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=strict" in cookie.lower()
    assert cookie.startswith(f"bufferstand-{page.port}=")
    assert TOKENS.control not in cookie
    assert TOKENS.control.encode() not in body


def test_every_answer_forbids_what_the_page_does_not_need(page: Page) -> None:
    for path in ("/", "/static/monitor.js", "/session", "/nowhere"):
        _, headers, _ = page.request("GET", path)
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy
        assert headers["x-frame-options"] == "DENY"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cache-control"] == "no-store"
        assert "access-control-allow-origin" not in headers
    assert b"<script>" not in page.request("GET", "/")[2], "no script inline"
    assert b"style=" not in page.request("GET", "/")[2]


@pytest.mark.parametrize(
    "path",
    ["/static/../app.py", "/static/%2e%2e/app.py", "/static//etc/passwd", "/static/app.py", "/campaign.json"],
)
def test_nothing_but_the_pages_own_files_is_served(page: Page, path: str) -> None:
    assert page.request("GET", path)[0] == 404


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (b"x" * 10_000, {}, 413),
        (b"[1]", {}, 400),
        (b"{", {}, 400),
        (b"[" * 8000, {}, 400),
        (b"{}", {"Content_Type": "text/plain"}, 415),
        (b"{}", {"Content_Type": "application/x-www-form-urlencoded"}, 415),
        (b'{"after": ["now"]}', {}, 409),
        (b'{"after": "at once"}', {}, 409),
    ],
)
def test_nonsense_is_refused(
    page: Page, campaign: Running, body: bytes, headers: dict[str, str], status: int
) -> None:
    page.enter(TOKENS.control)
    assert page.request("POST", "/stop", body, **headers)[0] == status
    assert campaign.case.request.level == 0


def test_a_page_that_talks_too_much_is_let_go(page: Page) -> None:
    page.enter(TOKENS.view)
    with page.live() as wire:
        wire.send("x" * 100_000)
        with pytest.raises(ConnectionClosed):
            hear(wire, lambda _: False)
    with page.live() as wire:
        hear(wire, lambda k: k["rows"])


def test_more_pages_than_there_is_room_for_are_turned_away(page: Page) -> None:
    page.enter(TOKENS.view)
    with ExitStack() as wires:
        for _ in range(MOST_PAGES - KEPT_FOR_CONTROL):
            wires.enter_context(page.live())
        with pytest.raises(InvalidStatus), page.live():
            pass
        page.enter(TOKENS.control)  # the operator has a place whoever looks on
        for _ in range(KEPT_FOR_CONTROL):
            wires.enter_context(page.live())
        with pytest.raises(InvalidStatus), page.live():
            pass
    until(lambda: _can_open(page))


def _can_open(page: Page) -> bool:
    try:
        with page.live():
            return True
    except InvalidStatus:
        return False


def test_slow_connections_of_one_address_keep_nobody_out(page: Page) -> None:
    """The operator sits at the same computer as who holds 200 connections and says little on each."""
    page.enter(TOKENS.control)
    begun = (
        b"",
        b"GET / HTTP/1.1\r\n",
        f"POST /session HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\nContent-Length: 999\r\n\r\n{{".encode(),
    )
    with page.live() as wire, ExitStack() as held:
        for number in range(200):
            one = held.enter_context(socket.create_connection(("127.0.0.1", page.port), timeout=60))
            with suppress(OSError):  # it has been let go already
                one.sendall(begun[number % len(begun)])
        for _ in range(10):
            assert page.request("GET", "/")[0] == 200
            assert page.request("GET", "/session")[0] == 200
        with page.live() as another:
            hear(another, lambda k: k["rows"])
        hear(wire, lambda k: k["rows"])


def test_who_leaves_in_the_middle_of_a_request_leaves_nothing_in_the_log(tmp_path: Path) -> None:
    with served(tmp_path) as page:
        log = os.dup(page.process._errors.fileno())
        head = (
            f"POST /session HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\nOrigin: {page.origin}\r\n"
            "Content-Type: application/json\r\nContent-Length: 999\r\n\r\n{"
        )
        for _ in range(50):
            with socket.create_connection(("127.0.0.1", page.port), timeout=60) as one:
                one.sendall(head.encode())
                assert page.request("GET", "/session")[0] == 200  # by now it waits for the rest
        assert page.request("GET", "/")[0] == 200
    try:
        assert os.fstat(log).st_size == 0
    finally:
        os.close(log)


def test_the_log_of_faults_is_bounded(capfd: pytest.CaptureFixture[str]) -> None:
    log = BoundedLog(1000)
    for number in range(100):
        log.emit(
            logging.LogRecord("uvicorn", logging.ERROR, "", 0, f"fault {number} " + "x" * 90, None, None)
        )
    said = capfd.readouterr().err
    assert len(said) < 1200
    assert said.splitlines()[0].startswith("fault 0")
    assert said.splitlines()[-1] == "further faults are not noted"


def test_connections_of_one_stranger_are_bounded(page: Page) -> None:
    page.enter(TOKENS.view)
    held = [socket.create_connection(("127.0.0.1", page.port), timeout=60) for _ in range(60)]
    try:
        for wire in held:
            wire.sendall(b"GET / HTTP/1.1\r\n")  # and no more
        time.sleep(0.3)
        closed = 0
        for wire in held:
            wire.settimeout(0.02)
            try:
                closed += wire.recv(10) == b""
            except TimeoutError:
                pass
            except OSError:
                closed += 1
        assert closed >= 15
    finally:
        for wire in held:
            wire.close()


def test_notes_say_who_wrote_them_and_are_bounded(campaign: Running, page: Page) -> None:
    page.enter(TOKENS.control)
    status, _, body = page.request(
        "POST", "/note", {"text": f"smells of rubber {HACK}", "name": "A.\u202e\nSmith"}
    )
    assert (status, json.loads(body)["text"]) == (200, "noted")
    until(lambda: read_notes(campaign.case.out))
    note = read_notes(campaign.case.out)[-1]
    assert note.text == f"monitor: A. Smith at this computer: smells of rubber {HACK}"
    assert note.step == 1
    assert page.request("POST", "/note", {"text": "   "})[0] == 409
    statuses = [page.request("POST", "/note", {"text": f"{n}"})[0] for n in range(25)]
    assert statuses.count(200) == 19
    assert set(statuses[19:]) == {409}
    done = [line for line in actions(campaign.case.out) if line["outcome"] == "done"]
    assert done[0]["who"] == "monitor: A. Smith at this computer"
    assert len(done) == 20


@pytest.mark.slow
def test_the_stop_reaches_the_campaign_and_is_written_down(tmp_path: Path) -> None:
    with running(tmp_path) as going, served(going.case.out) as page:
        assert page.enter(TOKENS.control) == 200
        with page.live() as wire:
            hear(wire, lambda k: k["rows"] and k.get("now", {}).get("cycle", 0) >= 1)
            status, _, body = page.request("POST", "/stop", {"after": "now", "name": "Ada"})
            assert (status, json.loads(body)["text"]) == (200, "stopping now")
            known = hear(wire, lambda k: "end" in k)
        outcome = going.end()
        assert known["end"]["status"] == "stopped"
        assert (outcome.status, outcome.exit_status) == ("stopped", 3)
        who = "monitor: Ada at this computer"
        assert outcome.reason == f"stopped by the operator: {who} (now)"
        events = [(event.kind, event.text) for event in open_run(outcome.runs[0]).events]
        assert ("operator", f"asked to stop now: {who} (now)") in events
        (line,) = actions(going.case.out)
        assert (line["who"], line["what"], line["outcome"]) == (who, "stop now", "done")
        assert page.request("POST", "/stop", {"after": "now"})[0] == 409, "nothing runs any more"
