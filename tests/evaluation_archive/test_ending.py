"""The command is ended by signals, for real: nothing of it stays behind, and what was done is known."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from bufferstand.evaluation.archive.cache import FILE_NAME
from tests.evaluation_archive.samples import LONG_S, archive, let_slow_wait, until
from tests.evaluation_report.make_runs import Made, write_campaign


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start the command in a session of its own, as a terminal does.

    It ends at a hang-up, as a terminal's does, though these tests be run by ``nohup``, which has it ignored.
    """
    as_run = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str | Path) -> subprocess.Popen[str]:
        command = [sys.executable, "-P", "-m", "bufferstand", *map(str, arguments)]
        started.append(
            subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
            )
        )
        return started[-1]

    yield start
    signal.signal(signal.SIGHUP, as_run)
    for process in started:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
        process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        pytest.param(signal.SIGHUP, marks=pytest.mark.long),
        pytest.param(signal.SIGINT, marks=pytest.mark.long),
        signal.SIGKILL,
    ],
)
def test_a_signal_ends_all_processes_and_keeps_what_is_done(
    number: signal.Signals,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    start: Callable[..., subprocess.Popen[str]],
) -> None:
    """To the command alone; its output is read to the end, for which all who hold it must have ended."""
    runs = archive(tmp_path / "archive")[:4]
    slow = [Made(f"slow-{n}", 30.0, 10.0, 2.5, cycles=3) for n in (1, 2)]
    waiting = sorted(write_campaign(tmp_path / "waiting", slow).rglob("*.h5"))
    assert max(path.stat().st_size for path in waiting) < min(path.stat().st_size for path in runs)
    let_slow_wait(tmp_path, monkeypatch)
    cache = "--cache", tmp_path / "cache", "--draws", "100", "--json", "-"
    process = start("evaluate", *runs, *waiting, "--jobs", "2", *cache)
    # The two that wait are the smallest, and so the last: others are done before they are handed out.
    until(lambda: all(path.with_name(f"{path.name}.opened").exists() for path in waiting))
    process.send_signal(number)
    output, errors = process.communicate(timeout=LONG_S)
    assert output == ""
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
        return
    assert (process.returncode, errors.strip()) == (3, "bufferstand: stopped by the operator")
    with closing(sqlite3.connect(tmp_path / "cache" / FILE_NAME)) as kept:
        assert kept.execute("SELECT count(*) FROM runs").fetchone()[0] >= 2


@pytest.mark.slow
def test_an_interrupt_from_the_terminal_while_processes_start(
    tmp_path: Path, start: Callable[..., subprocess.Popen[str]]
) -> None:
    """It goes to all of them; whatever they are at, one line is said and nothing else."""
    runs = archive(tmp_path / "archive")
    process = start("evaluate", *runs, "--jobs", "2", "--no-cache", "--draws", "20000")
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    # First the process that minds shared resources, then those that evaluate.
    until(lambda: len(children.read_text().split()) >= 2)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=LONG_S)
    assert (process.returncode, errors.strip()) == (3, "bufferstand: stopped by the operator")


def test_an_interrupt_while_the_command_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: Callable[..., subprocess.Popen[str]]
) -> None:
    (tmp_path / "click.py").write_text("raise KeyboardInterrupt\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])]))
    process = start("evaluate", "--help")
    assert process.communicate(timeout=LONG_S) == (
        "",
        "bufferstand: stopped by the operator: nothing was begun\n",
    )
    assert process.returncode == 3
