"""The web process of a running campaign; :mod:`bufferstand.daq.monitor.process` starts it and tells it what
to do.

It ends when its standard input does, that is with the campaign, or by the rule of
:mod:`bufferstand.daq.monitor.staying`.
"""

from __future__ import annotations

import asyncio
import json
import os
import resource
import signal
import socket
import sys
from contextlib import suppress
from pathlib import Path

from bufferstand.daq.monitor.access import Tokens
from bufferstand.daq.monitor.encryption import Certificate
from bufferstand.daq.monitor.process import STAYS
from bufferstand.daq.monitor.server import serve

NICE = 5
"""The acquisition goes first."""
MOST_MEMORY_BYTES = 1 << 30
"""Whatever strangers make it hold, the machine keeps its memory."""


async def _until_input_ends() -> None:
    loop, over = asyncio.get_running_loop(), asyncio.Event()

    def look() -> None:
        if not os.read(sys.stdin.fileno(), 4096):
            loop.remove_reader(sys.stdin.fileno())
            over.set()

    loop.add_reader(sys.stdin.fileno(), look)
    await over.wait()


async def _serve(settings: dict[str, str]) -> None:
    with socket.socket(fileno=int(settings["socket"])) as listener:
        tokens = Tokens(settings["view"], settings["control"], free_view=bool(settings["free_view"]))
        await serve(
            Path(settings["folder"]),
            listener,
            tokens,
            results=False,
            names=settings["names"].split(),
            certificate=Certificate(Path(settings["chain"]), Path(settings["key"]))
            if settings["chain"]
            else None,
            until=_until_input_ends(),
            stays=_say_it_stays if settings["stays"] else None,
        )


def _say_it_stays() -> None:
    """Tell the parent, which waits for this or for the end; it may be gone."""
    with suppress(OSError):
        os.write(sys.stdout.fileno(), STAYS)


def main() -> None:
    """Serve until standard input ends."""
    os.nice(NICE)
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY_BYTES, MOST_MEMORY_BYTES))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(
        signal.SIGTERM, lambda *_: None
    )  # uvicorn ends by it, and raises it again: all is to be tidied
    line = b""
    while not line.endswith(b"\n"):  # unbuffered: what follows is for the loop
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            return
        line += byte
    asyncio.run(_serve(json.loads(line)))


if __name__ == "__main__":
    main()
