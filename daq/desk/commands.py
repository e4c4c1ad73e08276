"""The commands as child processes: the desk does nothing that a command does not do, and shows which it is.

What only looks (``plan``, ``check``) is waited for. What moves a stand is a process of its own session: it
goes on when the desk ends, and the campaign's folder says what became of it.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Any

import orjson

from bufferstand.foundation import BadInput, program
from bufferstand.foundation.operating_system import is_lock_taken

AT_ONCE = 2
"""So many commands that only look run at once; the acquisition goes first."""
NICE = 5
PATIENCE_S = 120.0
"""Longest wait for a command that only looks [s]."""
MOST_LOG_BYTES = 65536
"""So much of the end of a log is shown."""
_WITH_PARENT = (
    "-c",
    (
        "import ctypes, runpy, signal; ctypes.CDLL(None).prctl(1, signal.SIGINT);"
        "runpy.run_module('bufferstand', run_name='__main__', alter_sys=True)"
    ),
)
"""Runs the command so that Linux gives it Ctrl-C when the desk is gone, also where that was killed
(prctl, PR_SET_PDEATHSIG)."""
NOISE = "bufferstand: "
"""What a message of a command begins with."""


@dataclass(frozen=True)
class Answer:
    """What a command said.

    Parameters
    ----------
    command : str
        As one could have typed it in the desk's folder.
    status : int
        Its exit status.
    out, said : str
        What it wrote to standard output, and to standard error.
    """

    command: str
    status: int
    out: str
    said: str

    @property
    def problem(self) -> str:
        """Its message, without the program's name; empty where it has none."""
        lines = [line.removeprefix(NOISE) for line in self.said.splitlines()]
        return "\n".join(lines).strip()

    def json(self) -> Any:
        """Return its standard output as data; None where that is none."""
        try:
            return orjson.loads(self.out)
        except ValueError:
            return None


def word_of(relative: str) -> str:
    """Return a path as a word of a command line, which no option can be taken for."""
    return f"./{relative}" if relative.startswith("-") else relative


class Commands:
    """Runs commands in a folder.

    Parameters
    ----------
    folder : Path
        Where they run; their words name files from there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = self._folder = folder
        self._free = asyncio.Semaphore(AT_ONCE)
        self._begun: list[subprocess.Popen[bytes]] = []

    def shown(self, *words: str) -> str:
        """Return the command as one can type it in the folder."""
        return " ".join((program(), *map(quote, words)))

    async def ask(self, *words: str, patience_s: float = PATIENCE_S) -> Answer:
        """Run a command to its end and return what it said; one that takes too long is ended."""
        async with self._free:
            process = await asyncio.create_subprocess_exec(
                *_whole(words), cwd=self._folder, stdin=DEVNULL, stdout=PIPE, stderr=PIPE
            )
            with suppress(ProcessLookupError):
                os.setpriority(os.PRIO_PROCESS, process.pid, NICE)
            try:
                async with asyncio.timeout(patience_s):
                    out, said = await process.communicate()
            except TimeoutError:
                await _end(process)
                text = f"this took longer than {patience_s:g} s and was ended"
                return Answer(self.shown(*words), 4, "", text)
            except asyncio.CancelledError:
                await _end(process)
                raise
        status = process.returncode or 0
        return Answer(
            self.shown(*words), status, out.decode("utf-8", "replace"), said.decode("utf-8", "replace")
        )

    def begin(
        self,
        log: Path,
        *words: str,
        add: bool = False,
        ends_with_desk: bool = False,
        secret: tuple[str, str] | None = None,
        aside: bool = False,
    ) -> subprocess.Popen[bytes]:
        """Start a command that goes on without the desk; what it writes goes to a file of its own.

        Parameters
        ----------
        log : Path
            That file; only the user may read it.
        words : str
            The command.
        add : bool
            What the file holds already stays.
        ends_with_desk : bool
            It does not outlive the desk, however that ends.
        secret : tuple of str, optional
            An option that takes a file, and what its first line is to be. The command gets it by a pipe: it
            stands on no disk, in no list of processes and in no environment.
        aside : bool
            An acquisition goes first.

        Raises
        ------
        BadInput
            If the log cannot be written.
        """
        self._begun = [one for one in self._begun if one.poll() is None]
        kept = os.O_APPEND if add else os.O_TRUNC
        try:
            log.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(log, os.O_WRONLY | os.O_CREAT | kept, 0o600)
        except OSError as error:
            raise BadInput(f"cannot be written: {error.strerror}", file=error.filename or log) from None
        with os.fdopen(handle, "wb") as stream, _told(secret) as (further, handles):
            with suppress(OSError):  # a file system that knows no locks
                is_lock_taken(handle)  # the command inherits it: it is held as long as that can write
            process = subprocess.Popen(
                _whole((*words, *further), _WITH_PARENT if ends_with_desk else ("-m", "bufferstand")),
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                pass_fds=handles,
                start_new_session=True,  # neither Ctrl-C nor a closed terminal of the desk is for the stand
            )
        if aside:
            with suppress(ProcessLookupError):
                os.setpriority(os.PRIO_PROCESS, process.pid, NICE)
        self._begun.append(process)
        return process


@contextmanager
def _told(secret: tuple[str, str] | None) -> Iterator[tuple[tuple[str, ...], tuple[int, ...]]]:
    """While inside, a secret lies in a pipe; give the words that name it, and what a command inherits."""
    if secret is None:
        yield (), ()
        return
    option, line = secret
    reading, writing = os.pipe()
    try:
        with os.fdopen(writing, "wb") as pipe:
            pipe.write(line.encode() + b"\n")  # far less than a pipe holds: it waits for nobody
        yield (option, f"/dev/fd/{reading}"), (reading,)
    finally:
        os.close(reading)


def is_written(log: Path) -> bool:
    """Return whether a command that a desk has begun with a log may still write to it."""
    with suppress(OSError), log.open("rb") as stream:
        return not is_lock_taken(stream.fileno(), shared=True)
    return False


def tail_of(log: Path, first: int = 0) -> str:
    """Return the end of a log, of what stands behind its first bytes; empty where there is none."""
    with suppress(OSError), log.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(first, size - MOST_LOG_BYTES))
        return stream.read().decode("utf-8", "replace")
    return ""


def _whole(words: tuple[str, ...], how: tuple[str, ...] = ("-m", "bufferstand")) -> list[str]:
    return [sys.executable, "-P", *how, *words]


async def _end(process: Process) -> None:
    with suppress(ProcessLookupError):
        process.kill()
    await process.wait()
