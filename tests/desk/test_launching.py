"""What a command that the desk has begun writes, and when it can write no more."""

from __future__ import annotations

import asyncio
from pathlib import Path

from bufferstand.daq.desk.campaigns import launching
from bufferstand.daq.desk.commands import Commands, is_written, tail_of


def test_a_log_is_written_as_long_as_its_command_lives(tmp_path: Path) -> None:
    log = tmp_path / "desk.log"
    assert not is_written(log)
    process = Commands(tmp_path).begin(log, "docs", "--address", "127.0.0.1:0")
    try:
        assert is_written(log)
    finally:
        process.kill()
        process.wait(60)
    assert not is_written(log)


def test_a_command_that_follows_waits_for_the_last_words_of_the_one_before(tmp_path: Path) -> None:
    log = tmp_path / "desk.log"
    commands = Commands(tmp_path)
    before = commands.begin(log, "plan", "not-there.toml")
    asyncio.run(launching._last_words(log))
    first = tail_of(log)
    assert before.wait(60) == 2
    assert "not-there.toml" in first
    after = commands.begin(log, "plan", "nor-there.toml", add=True)
    assert after.wait(60) == 2
    assert not is_written(log)
    assert "not-there" not in tail_of(log, len(first.encode()))
    assert "nor-there" in tail_of(log, len(first.encode()))
