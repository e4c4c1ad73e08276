"""Commands that take a while and are watched by a page: touch-off, jog, report, the simulated stand.

A job that is stopped gets Ctrl-C, as in a terminal: whatever moves then ends in the safe stop.
"""

from __future__ import annotations

import asyncio
import secrets
import signal
import subprocess
import tempfile
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import tail_of
from bufferstand.daq.desk.shell import Desk
from bufferstand.foundation import BadInput

KEPT = 40
"""Jobs that are remembered."""
END_S = 15.0
"""Longest wait for a job of the desk's own to end with it [s]."""


@dataclass
class Job:
    """A command that was started.

    Parameters
    ----------
    key : str
        Its name in addresses.
    command : str
        As one can type it.
    process : Popen
    log : Path
        What it has written.
    ends_with_desk : bool
        It serves the desk alone (the simulated stand, a live page).
    """

    key: str
    command: str
    process: subprocess.Popen[bytes]
    log: Path
    ends_with_desk: bool

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self.process.poll() is None

    @property
    def text(self) -> str:
        """The end of what it has written, without the program's name."""
        return tail_of(self.log).replace("bufferstand: ", "").strip()

    def stop(self) -> None:
        """Give it Ctrl-C."""
        if self.running:
            self.process.send_signal(signal.SIGINT)


class Jobs:
    """The jobs of a desk.

    Parameters
    ----------
    desk : Desk
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._logs = Path(tempfile.mkdtemp(prefix="bufferstand-desk-"))

    def routes(self) -> list[Route]:
        """Return the routes by which pages watch and stop them."""
        return [self._desk.look("/job/{key}", self.state), self._desk.act("/job/{key}/stop", self.stop)]

    def begin(
        self,
        *words: str,
        ends_with_desk: bool = False,
        secret: tuple[str, str] | None = None,
        aside: bool = False,
    ) -> Job:
        """Start a command and watch it; the options are those of :meth:`Commands.begin`."""
        key = secrets.token_urlsafe(9)
        log = self._logs / f"{key}.log"
        process = self._desk.commands.begin(
            log, *words, ends_with_desk=ends_with_desk, secret=secret, aside=aside
        )
        job = self._jobs[key] = Job(key, self._desk.commands.shown(*words), process, log, ends_with_desk)
        while len(self._jobs) > KEPT:
            oldest = next((one for one in self._jobs.values() if not one.running), None)
            if oldest is None:
                break
            del self._jobs[oldest.key]
            with suppress(OSError):
                oldest.log.unlink()
        return job

    def find(self, key: str) -> Job | None:
        """Return a job by its name."""
        return self._jobs.get(key)

    async def state(self, request: Request) -> Response:
        """Say how far a job is."""
        job = self._known(request)
        text = await asyncio.to_thread(lambda: job.text)
        return JSONResponse({"running": job.running, "status": job.process.poll(), "text": text})

    async def stop(self, request: Request, content: dict[str, object]) -> Response:  # noqa: ARG002 - its signature
        """Stop a job as Ctrl-C would."""
        self._known(request).stop()
        return JSONResponse({})

    def _known(self, request: Request) -> Job:
        job = self.find(request.path_params["key"])
        if job is None:
            raise BadInput("there is no such job any more")
        return job

    @contextmanager
    def ending(self) -> Iterator[None]:
        """On the way out, end what serves the desk alone; what moves a stand goes on to its own end."""
        try:
            yield
        finally:
            own = [job for job in self._jobs.values() if job.ends_with_desk and job.running]
            for job in own:
                job.stop()
            for job in own:
                with suppress(subprocess.TimeoutExpired):
                    job.process.wait(END_S)
                if job.running:
                    job.process.kill()
            for job in self._jobs.values():
                with suppress(OSError):
                    job.log.unlink()
            with suppress(OSError):
                self._logs.rmdir()
