"""The listening side: what a campaign said last stays, however it leaves."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bufferstand.daq.monitor.follower import Follower
from bufferstand.daq.monitor.publisher import LIVE_NAME
from bufferstand.daq.monitor.view import Cursor, View

END = {"end": {"status": "stopped", "reason": "by the operator"}, "progress": {"phase": "done"}}


def sections(view: View) -> dict[str, object]:
    found: dict[str, object] = json.loads(view.news(Cursor()) or '{"sections":{}}')["sections"]
    return found


async def until(true: Callable[[], bool]) -> None:
    async with asyncio.timeout(10.0):
        while not true():
            await asyncio.sleep(0.01)


@pytest.fixture
def campaign(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
        server.bind(str(tmp_path / LIVE_NAME))
        server.listen(4)
        server.setblocking(False)
        yield server


def test_the_end_stays_though_the_campaign_leaves_slowly(tmp_path: Path, campaign: socket.socket) -> None:
    """Let go by a campaign whose socket still listens, one comes back, and is never taken on."""

    async def scene() -> None:
        view = View()
        follower = Follower(tmp_path, view, results=False)
        following = asyncio.create_task(follower.run())
        loop = asyncio.get_running_loop()
        wire, _ = await loop.sock_accept(campaign)
        wire.send(json.dumps(END).encode())
        wire.close()
        await until(follower.ended.is_set)
        await asyncio.sleep(0.1)  # it is in the queue again by now
        campaign.close()
        await asyncio.sleep(0.3)
        assert not following.done()
        assert sections(view)["end"] == END["end"]
        following.cancel()

    asyncio.run(scene())


def test_a_campaign_that_dies_before_it_says_anything_is_still_waited_for(
    tmp_path: Path, campaign: socket.socket
) -> None:
    async def scene() -> None:
        view = View()
        follower = Follower(tmp_path, view, results=False)
        following = asyncio.create_task(follower.run())
        await asyncio.sleep(0.2)
        campaign.close()
        await until(lambda: "source" in sections(view))
        assert sections(view)["source"] == {"kind": "waiting"}
        assert not following.done()
        following.cancel()

    asyncio.run(scene())
