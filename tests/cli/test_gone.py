"""A terminal that is closed, and a pipe that nobody reads any more, end any command in one way."""

from __future__ import annotations

import errno
import os
import pty
import subprocess
import sys

import pytest

from bufferstand.cli.closed_terminal import is_closed_terminal, nobody_reads, say
from bufferstand.foundation.errors import ExitStatus

SHOWS_TWICE = """
import sys, click, bufferstand.cli.main as main
@click.command()
def shows() -> None:
    click.echo("one")
    sys.stdout.flush()
    sys.stdin.readline()
    click.echo("two")
main.bufferstand = shows
main.main([])
"""


def shown_to_nobody(descriptor: int, other_end: int) -> tuple[int, str]:
    """Run a command that shows a line, and one more once its reader has gone; return status, stderr."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", SHOWS_TWICE],
        stdin=subprocess.PIPE,
        stdout=descriptor,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.close(descriptor)
    assert os.read(other_end, 100).split() == [b"one"]
    os.close(other_end)
    _, said = process.communicate("\n", timeout=240.0)
    return process.returncode, said


def test_a_closed_terminal_is_the_operators_stop() -> None:
    other_end, terminal = pty.openpty()
    status, said = shown_to_nobody(terminal, other_end)
    assert (status, said) == (ExitStatus.STOPPED, "bufferstand: stopped by the operator\n")


def test_a_pipe_that_nobody_reads_any_more_is_enough() -> None:
    other_end, pipe = os.pipe()
    assert shown_to_nobody(pipe, other_end) == (ExitStatus.DONE, "")


@pytest.mark.parametrize(
    ("error", "nobody", "closed"),
    [
        (OSError(errno.EIO, "Input/output error"), True, True),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), True, False),
        (OSError(errno.ENOSPC, "No space left on device"), False, False),
        (OSError(errno.EIO, "Input/output error", "run.h5"), False, False),
        (ValueError("EIO"), False, False),
    ],
)
def test_a_file_says_its_own_errors(error: Exception, nobody: bool, closed: bool) -> None:
    assert nobody_reads(error) is nobody
    assert is_closed_terminal(error, on_terminal=True) is closed
    assert is_closed_terminal(error, on_terminal=False) is False
    error.__context__ = KeyboardInterrupt()
    assert is_closed_terminal(error, on_terminal=False) is closed


def test_a_line_for_nobody_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    reads, writes = os.pipe()
    os.close(reads)
    with os.fdopen(writes, "w", buffering=1) as nobody:
        monkeypatch.setattr(sys, "stderr", nobody)
        say("safe stop: force 0.0 kN")
        with pytest.raises(BrokenPipeError):
            os.write(writes, b"x")
        os.dup2(os.open(os.devnull, os.O_WRONLY), writes)  # what is left in it goes there
