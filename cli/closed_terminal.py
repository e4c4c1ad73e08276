"""A closed terminal, or a pipe without a reader: how it is recognised, and what is done."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from typing import TextIO

import click

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


def drop(stream: TextIO) -> None:
    """Let what is not written yet go: at its end, Python would try once more and complain."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
