"""The web process beside a campaign: killed, frozen, orphaned, or ended with it; the campaign never minds."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosedOK

from bufferstand.daq.monitor.access import new_tokens
from bufferstand.daq.monitor.process import Address, bind, demand_libraries, links, parse_address
from bufferstand.foundation import BadInput, how_to_add
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import HARMONIC
from tests.daq.test_runner import Case
from tests.monitor.served import TOKENS, hear, running, served, until

LONG = HARMONIC.replace("cycles = 3", "cycles = 25")


def state_of(pid: int) -> str:
    """Return the kernel's letter for a process: ``T`` is stopped; empty where there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""


@pytest.mark.slow
def test_a_killed_web_process_is_said_and_the_campaign_goes_on(tmp_path: Path) -> None:
    said: list[str] = []
    with served(tmp_path / "out") as page, running(tmp_path, LONG) as going:
        page.process.watch(said.append)
        page.enter(TOKENS.view)
        with page.live() as wire:
            hear(wire, lambda k: k["rows"])
        os.kill(page.process.pid, signal.SIGKILL)
        until(lambda: said)
        outcome = going.end()
    assert outcome.status == "complete"
    assert len(said) == 1
    assert "web process has ended (signal 9); the campaign goes on" in said[0]


@pytest.mark.slow
def test_a_frozen_web_process_costs_the_campaign_nothing(tmp_path: Path) -> None:
    alone = Case(tmp_path / "alone", LONG).run()
    with served(tmp_path / "watched" / "out") as page, running(tmp_path / "watched", LONG) as going:
        page.enter(TOKENS.view)
        with page.live() as wire:
            hear(wire, lambda k: k["rows"])
        os.kill(page.process.pid, signal.SIGSTOP)
        until(lambda: state_of(page.process.pid) == "T")
        try:
            outcome = going.end()
        finally:
            os.kill(page.process.pid, signal.SIGCONT)
    assert outcome.status == "complete"
    for one, two in zip(alone.runs, outcome.runs, strict=True):
        runs = open_run(one), open_run(two)
        assert [run.gaps("controller") for run in runs] == [[], []]
        rows = [run.streams["controller"].rows for run in runs]
        assert abs(rows[0] - rows[1]) <= 40, "the same campaign, to one or two passes"


@pytest.mark.slow
def test_it_ends_with_the_campaign_and_says_so_to_its_pages(tmp_path: Path) -> None:
    with served(tmp_path / "out") as page, running(tmp_path, LONG) as going:
        page.enter(TOKENS.view)
        with page.live() as wire:
            hear(wire, lambda k: k["rows"])
            assert going.end().status == "complete"
            known = hear(wire, lambda k: k.get("campaign", {}).get("status") == "complete" and "end" in k)
            assert (known["end"]["status"], known["end"]["reason"]) == ("complete", "")
            assert known["end"]["stand"]["safe"] is True
            threading.Thread(target=page.process.end).start()
            with pytest.raises(ConnectionClosedOK):
                hear(wire, lambda _: False)
        until(lambda: state_of(page.process.pid) in ("", "Z"))


@pytest.mark.slow
def test_it_does_not_outlive_a_killed_parent(tmp_path: Path) -> None:
    program = (
        "import os, sys, time; from pathlib import Path; from bufferstand.daq.monitor.process import *\n"
        f"with web_process(Path({str(tmp_path)!r}), Address(port=0), lambda line: None) as web:\n"
        "    print(web.pid, flush=True); time.sleep(600)\n"
    )
    parent = subprocess.Popen([sys.executable, "-P", "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        until(lambda: state_of(pid) in ("S", "R"))
    finally:
        parent.kill()
        parent.communicate()
    until(lambda: state_of(pid) in ("", "Z"))


@pytest.mark.slow
def test_a_page_whose_campaign_has_not_begun_waits_for_it(tmp_path: Path) -> None:
    with served(tmp_path / "not there yet") as page:
        page.enter(TOKENS.view)
        with page.live() as wire:
            assert hear(wire, lambda k: "source" in k)["source"] == {"kind": "waiting"}


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("", Address()),
        ("192.168.1.5:9000", Address("192.168.1.5", 9000, exact=True)),
        ("127.0.0.1", Address("127.0.0.1", 8420, exact=True)),
        (":0", Address("127.0.0.1", 0, exact=True)),
        ("[::1]:81", Address("::1", 81, exact=True)),
        ("[::1]", Address("::1", 8420, exact=True)),
        ("localhost:81", Address("localhost", 81, exact=True)),
    ],
)
def test_addresses(text: str, address: Address) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["127.0.0.1:http", "127.0.0.1:99999", "a:b:c", "demo.toml:", ":-1"])
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match=r"is no HOST:PORT; write e\.g\. 192"):
        parse_address(text)


def test_a_port_that_is_taken_is_refused_if_it_was_asked_for_and_else_another_is_taken() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=f"cannot be served at 127.0.0.1:{port}: Address already in use"):
            bind(Address("127.0.0.1", port, exact=True))
        with bind(Address("127.0.0.1", port)) as other:
            assert other.getsockname()[1] != port
    with pytest.raises(BadInput, match="no address of this machine"):
        bind(Address("no such host.invalid", 0, exact=True))


def test_the_links_say_what_they_open(monkeypatch: pytest.MonkeyPatch) -> None:
    class Bound:
        def __init__(self, host: str) -> None:
            self.host = host

        def getsockname(self) -> tuple[str, int]:
            return self.host, 8420

    def told(host: str, **options: Any) -> list[str]:
        return links(Bound(host), new_tokens(loopback=host.startswith("127"), **options))  # type: ignore[arg-type]

    here = told("127.0.0.1")
    assert here[0] == "live monitor, to look on (from this computer): http://127.0.0.1:8420/"
    assert here[1].startswith("live monitor, with stop and notes: http://127.0.0.1:8420/#")
    assert len(told("127.0.0.1", view_only=True)) == 1
    monkeypatch.setattr(socket, "gethostname", lambda: "lab-pc")
    away = told("0.0.0.0")
    assert away[0].startswith("live monitor, to look on: http://lab-pc:8420/#")
    assert away[0].split("#")[1] != away[1].split("#")[1]
    assert "network can read along" in away[2]


def test_a_missing_library_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(BadInput) as caught:
        demand_libraries()
    assert (
        str(caught.value) == f"the live monitor needs starlette, uvicorn, websockets; {how_to_add('monitor')}"
    )
