"""The twin's process: python -m bufferstand.daq.twin DIR MODEL.toml; it ends when its standard input does.

It listens at the campaign's socket as the live page does, writes ``twin.json`` into the folder, and hands
what has moved to the campaign, which puts it into the run as an event.
"""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import sys
import time
from contextlib import suppress
from pathlib import Path

from bufferstand.daq.monitor import BUFFER_BYTES, LIVE_NAME, TWIN_NAME
from bufferstand.daq.operator import ask
from bufferstand.daq.twin.live_twin import LiveTwin
from bufferstand.foundation import BadInput, short_address
from bufferstand.foundation.files import write_text
from bufferstand.model import load_model

NICE = 10
"""Acquisition and page go first."""
LOOK_S = 0.5


def main() -> None:
    """Listen until standard input ends."""
    folder, model = Path(sys.argv[1]), load_model(sys.argv[2])
    os.nice(NICE)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    twin = LiveTwin(model)
    while not _ended(LOOK_S):
        if (folder / LIVE_NAME).exists():
            _listen(folder, twin)


def _ended(wait_s: float) -> bool:
    return bool(select.select([sys.stdin], [], [], wait_s)[0]) and not os.read(sys.stdin.fileno(), 4096)


def _listen(folder: Path, twin: LiveTwin) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as wire:
        wire.settimeout(LOOK_S)
        try:
            with short_address(folder / LIVE_NAME) as address:
                wire.connect(address)
        except OSError:
            return
        judged_s = time.monotonic()
        while True:
            try:
                packet = wire.recv(BUFFER_BYTES)
            except TimeoutError:
                packet = None
            except OSError:
                return
            if packet == b"":
                return
            if packet:
                twin.hear(json.loads(packet))
            if time.monotonic() - judged_s >= LOOK_S:
                _judge(folder, twin)
                judged_s = time.monotonic()


def _judge(folder: Path, twin: LiveTwin) -> None:
    before = twin.judged
    alarms = twin.judge()
    if twin.judged != before:
        with suppress(BadInput, OSError):
            write_text(folder / TWIN_NAME, json.dumps(twin.document(), separators=(",", ":")))
    for alarm in alarms:
        with suppress(BadInput):
            ask(folder, {"finding": alarm.sentence, "by": "twin"})


if __name__ == "__main__":
    main()
