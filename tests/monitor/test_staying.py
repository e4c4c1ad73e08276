"""The page behind a campaign that has ended: it stays for whoever has it open, and for nobody else."""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from bufferstand.daq.monitor import server
from bufferstand.daq.monitor.access import Tokens
from bufferstand.daq.monitor.process import Address, bind, web_process
from bufferstand.daq.monitor.staying import PAGE_NAME, announced, end_page, rule_in_words
from tests.daq.test_runner import Case
from tests.monitor.served import TOKENS, Page, hear, until
from tests.monitor.test_process import state_of

FREE = Tokens(view="", control=TOKENS.control, free_view=True)


@pytest.fixture
def ended(tmp_path: Path) -> Path:
    """A campaign that has ended."""
    case = Case(tmp_path)
    assert case.run().status == "complete"
    return case.out


@pytest.mark.slow
def test_it_stays_with_the_results_while_somebody_has_it_open_and_is_ended_by_its_folder(ended: Path) -> None:
    said: list[str] = []
    with web_process(ended, Address(port=0), said.append, FREE, stays=True) as process:
        page = Page(process, said[:2])
        with page.live() as wire:
            hear(wire, lambda k: "campaign" in k)
            process.end()
            assert process.stays
            known = hear(wire, lambda k: k.get("runs", {}).get("evaluating") is False)
            assert len(known["runs"]["runs"]) == 1
            assert page.request("POST", "/close", {}, Cookie="")[0] == 403, "looking is not closing"
    assert f"the live page stays open with the results: {page.origin}/" in said[-1]
    assert rule_in_words() in said[-1]
    assert "--end" in said[-1]
    content = json.loads((ended / PAGE_NAME).read_text())
    assert content == {"pid": process.pid, "port": page.port}
    command = [sys.executable, "-P", "-m", "bufferstand", "monitor", str(ended), "--end"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    assert (done.returncode, done.stderr.strip()) == (0, "the page is closed")
    until(lambda: state_of(process.pid) in ("", "Z"))
    assert not (ended / PAGE_NAME).exists()
    again = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    assert (again.returncode, again.stderr.strip()) == (0, "no page has stayed open here")


@pytest.mark.slow
def test_whoever_may_act_closes_it_for_everybody(ended: Path) -> None:
    said: list[str] = []
    with web_process(ended, Address(port=0), said.append, FREE, stays=True) as process:
        page = Page(process, said[:2])
        assert page.enter(TOKENS.control) == 200
        with page.live() as wire:
            hear(wire, lambda k: k.get("source") == {"kind": "finished"})
            process.end()
            status, _, body = page.request("POST", "/close", {"name": "Ada"})
            assert (status, json.loads(body)) == (200, {"text": "the page is being closed"})
            until(lambda: state_of(process.pid) in ("", "Z"))
    last = json.loads((ended / "actions.jsonl").read_text().splitlines()[-1])
    assert (last["what"], last["who"]) == ("close the page", "monitor: Ada at this computer")


@pytest.mark.slow
def test_a_script_that_nobody_watches_leaves_no_process_and_waits_for_none(ended: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from bufferstand.daq.monitor.process import *\n"
        f"with web_process(Path({str(ended)!r}), Address(port=0), print, stays=True) as web:\n"
        "    pid = web.pid\nprint(pid, web.stays)\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True, timeout=240
    )
    pid, stays = done.stdout.splitlines()[-1].split()
    assert stays == "False"
    until(lambda: state_of(int(pid)) in ("", "Z"))
    assert "stays" not in done.stdout.replace("web.stays", "").rpartition("\n")[0]


@pytest.mark.slow
def test_it_ends_when_nobody_has_had_it_open_for_the_stated_time(
    ended: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rule itself, with a short time: open at the end, so it stays; closed, so it ends by itself."""
    monkeypatch.setattr(server, "IDLE_S", 0.6)
    stayed = threading.Event()

    async def scene() -> None:
        over = asyncio.Event()
        with bind(Address(port=0)) as listener:
            port = listener.getsockname()[1]
            serving = asyncio.create_task(
                server.serve(ended, listener, FREE, results=False, until=over.wait(), stays=stayed.set)
            )
            origin: Any = f"http://127.0.0.1:{port}"
            async with connect(
                f"ws://127.0.0.1:{port}/live", origin=origin, proxy=None, max_size=None
            ) as wire:
                while '"finished"' not in str(await wire.recv()):
                    pass
                over.set()
                while '"evaluating":false' not in str(await wire.recv()):
                    pass
                assert not serving.done()
                assert (ended / PAGE_NAME).exists()
            await asyncio.wait_for(serving, 30.0)

    asyncio.run(scene())
    assert stayed.is_set()
    assert not (ended / PAGE_NAME).exists()


def test_a_number_that_was_left_behind_ends_no_strangers_process(tmp_path: Path) -> None:
    sleeper = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        (tmp_path / PAGE_NAME).write_text(json.dumps({"pid": sleeper.pid, "port": 1}))
        assert end_page(tmp_path) is False
        assert sleeper.poll() is None
        assert not (tmp_path / PAGE_NAME).exists(), "what was left behind is cleared away"
    finally:
        sleeper.communicate(b"\n")


def test_a_second_page_takes_nothing_from_the_first(tmp_path: Path) -> None:
    with announced(tmp_path, 1):
        before = (tmp_path / PAGE_NAME).read_text()
        with announced(tmp_path, 2):
            assert (tmp_path / PAGE_NAME).read_text() == before
        assert (tmp_path / PAGE_NAME).exists()
    assert not (tmp_path / PAGE_NAME).exists()
    with announced(tmp_path / "not there", 1):
        pass
    (tmp_path / PAGE_NAME).write_text("nonsense")
    descriptor = os.open(tmp_path / PAGE_NAME, os.O_RDWR)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    assert end_page(tmp_path) is False
    os.close(descriptor)
