"""Starting ``run`` or ``resume`` so that it goes on without the desk, and seeing that it has begun."""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from bufferstand.daq.desk.commands import is_written, tail_of, word_of
from bufferstand.daq.desk.shell import Desk
from bufferstand.daq.operator import is_running
from bufferstand.foundation import BadInput

LOG_NAME = "desk.log"
"""What the command has written, in the campaign's folder: whoever opens the desk later reads it there."""
BEGIN_S = 180.0
"""So long a command may take until the campaign answers or it has ended [s]."""
LOOK_S = 0.2
LAST_WORDS_S = 20.0
"""So long a command whose campaign has ended may take until it has said so and is gone [s]."""


async def launch(desk: Desk, folder: Path, *words: str, add: bool = False) -> None:
    """Start a command in a session of its own and wait until its campaign runs.

    Parameters
    ----------
    desk : Desk
    folder : Path
        The campaign's, made if it is not there.
    words : str
        The command.
    add : bool
        What an earlier command has written there stays.

    Raises
    ------
    BadInput
        If it has ended without a campaign; its message is what the command said.
    """
    if is_running(folder):
        raise BadInput("a campaign is running in this folder already", remedy="wait for its end, or stop it")
    log, fresh = folder / LOG_NAME, not folder.exists()
    await _last_words(log)
    before = log.stat().st_size if add and log.exists() else 0
    process = desk.commands.begin(log, *words, add=add)
    loop = asyncio.get_running_loop()
    end_s = loop.time() + BEGIN_S
    while process.poll() is None and loop.time() < end_s:
        if await asyncio.to_thread(is_running, folder):
            return
        await asyncio.sleep(LOOK_S)
    status = process.poll()
    if status == 2:
        said = tail_of(log, before).strip()
        if fresh:  # nothing has begun: nothing is left behind
            with suppress(OSError):
                log.unlink()
                folder.rmdir()
        lines = [
            line.removeprefix("bufferstand: ")
            for line in said.splitlines()
            if line.startswith("bufferstand: ")
        ]
        raise BadInput("\n".join(lines) or said or "the command ended without a word")


async def _last_words(log: Path) -> None:
    """Wait until the command before has ended: what it says last is not what the next one says."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + LAST_WORDS_S
    while is_written(log) and loop.time() < end_s:
        await asyncio.sleep(LOOK_S)


async def note_of_start(desk: Desk, name: str, items: Collection[str], operator: str) -> None:
    """Write down in the campaign's notes who has ticked what before the stand moved.

    Parameters
    ----------
    desk : Desk
    name : str
        The campaign's folder, from the desk's.
    items : collection of str
        The checklist; it may be empty.
    operator : str
        Who stands there; empty where nobody said.
    """
    said = f"checklist ticked: {'; '.join(items)}" if items else "started at the desk"
    await desk.commands.ask("note", "--", word_of(name), f"{said} ({operator or 'someone'} at the desk)")
