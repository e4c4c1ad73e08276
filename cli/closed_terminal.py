"""A closed terminal, or a pipe without a reader: how it is recognised, and what is done."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

import click

from bufferstand.foundation import plain_but_for_displays

NOBODY_READS = (errno.EIO, errno.EPIPE)
"""What writing fails with once the terminal has been closed, or the reader of a pipe has ended."""


def nobody_reads(error: BaseException) -> bool:
    """Return whether an error says that what is printed reaches nobody; a file's own error names the file."""
    return isinstance(error, OSError) and error.errno in NOBODY_READS and error.filename is None


def shows_on_terminal() -> bool:
    """Return whether standard output is a terminal; asked before it can be closed."""
    try:
        return sys.stdout is not None and sys.stdout.isatty()
    except (OSError, ValueError):
        return False


def is_closed_terminal(error: BaseException, *, on_terminal: bool) -> bool:
    """Return whether an error is that of a closed terminal, which ends a command as its operator does.

    Parameters
    ----------
    error : BaseException
        What writing failed with.
    on_terminal : bool
        Whether standard output was a terminal: what else fails with EIO is a broken disk.
    """
    interrupted = isinstance(error.__context__, KeyboardInterrupt)  # click writes to it behind a hang-up
    return (
        nobody_reads(error)
        and isinstance(error, OSError)
        and error.errno == errno.EIO
        and (on_terminal or interrupted)
    )


def say(line: str) -> None:
    """Show a line on standard error; one that nobody can see any more is no reason to stop a safe stop."""
    with suppress(OSError):
        click.echo(line, err=True)


class PlainTerminal(io.TextIOWrapper):
    """A terminal that shows escape sequences of names and notes instead of obeying them."""

    def write(self, text: str) -> int:
        """Write a text; return how long it was."""
        super().write(plain_but_for_displays(text))
        return len(text)


@contextmanager
def plain_terminals() -> Iterator[None]:
    """While inside, whatever is shown on a terminal is plain; files and pipes get it as it is."""
    before = sys.stdout, sys.stderr
    try:
        sys.stdout, sys.stderr = (_plain(stream) for stream in before)
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, PlainTerminal):
                with suppress(OSError, ValueError):
                    stream.flush()
        sys.stdout, sys.stderr = before


def _plain(stream: TextIO) -> TextIO:
    try:
        if not isinstance(stream, io.TextIOWrapper):
            return stream
        if not stream.isatty():
            if sys.platform == "win32":  # whose code page lacks ± and ≥, and differs from desk to desk
                stream.reconfigure(encoding="utf-8")
            return stream
    except (OSError, ValueError):
        return stream
    stream.flush()
    # Without closing the descriptor when this wrapper goes: it is the process's.
    raw = open(stream.fileno(), "wb", closefd=False)  # noqa: SIM115 - a descriptor; closed with the process
    return PlainTerminal(raw, stream.encoding, stream.errors, line_buffering=True, write_through=True)


def drop(stream: TextIO) -> None:
    """Let what is not written yet go: at its end, Python would try once more and complain."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
