"""The real command, doomed: ``python -m tests.daq.doomed NOTES MOMENT SECONDS ENDPOINTS bufferstand-words…``.

It runs a campaign on a stand that another process serves, until it kills itself (SIGKILL, from a thread of
its own) so many seconds after it began (``anywhere``), began to record (``recording``), to close and seal a
run (``sealing``), to recover what an earlier one left (``recovering``), to creep to first contact
(``touching``), to warm up (``warming``) or to cycle between forces (``cycling``); with ``never`` it lives. In
NOTES it writes down every block that the recorder got and every acknowledgement, as evidence that it cannot
alter.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class Doom:
    """The end of this process."""

    def __init__(self, notes: Path, moment: str, after_s: float) -> None:
        self._notes, self._moment = notes, moment
        self._come = threading.Event()
        self._after_s = after_s
        self._stage = os.open(notes / "stage", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        threading.Thread(target=self._strike, daemon=True).start()
        self.at("anywhere", "starting")

    def at(self, moment: str, stage: str) -> None:
        """Begin to count if this is the moment; write down the stage that begins."""
        os.pwrite(self._stage, stage.ljust(20).encode(), 0)
        if moment == self._moment:
            self._come.set()

    def _strike(self) -> None:
        self._come.wait()
        time.sleep(self._after_s)
        os.kill(os.getpid(), signal.SIGKILL)

    def write(self, name: str, content: bytes) -> None:
        """Add to a file of evidence; the kernel has it when this returns."""
        handle = os.open(self._notes / name, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.write(handle, content)
        os.close(handle)


def around(owner: Any, name: str, before: Callable[..., object], after: Callable[..., object]) -> None:
    """Have something done before and after a method or function."""
    real = getattr(owner, name)

    def both(*words: Any, **named: Any) -> Any:
        before(*words, **named)
        result = real(*words, **named)
        after(*words, **named)
        return result

    setattr(owner, name, both)


def nothing(*_: object, **__: object) -> None:
    """Do nothing."""


def watch(doom: Doom) -> None:
    """Let the recorder leave evidence, and tell when what begins."""
    from bufferstand.daq.campaign import campaign_runner as runner
    from bufferstand.daq.campaign import session
    from bufferstand.daq.motions import motion_runner as driving
    from bufferstand.daq.zero.zeroing import Zeroing
    from bufferstand.recording.journal.segments import SegmentedJournal
    from bufferstand.recording.recorder import RunRecorder

    def acknowledged(journal: Any, *_: object) -> None:
        doom.write(f"{journal._first.stem}.ack", f"{journal.durable}\n".encode())

    def handed_over(recorder: Any, *block: Any, **named: Any) -> None:
        doom.write(f"{recorder.path.stem}.tap", pickle.dumps((block, named)))

    around(
        RunRecorder,
        "__init__",
        nothing,
        lambda recorder, *_, **__: (
            doom.write(f"{recorder.path.stem}.ack", b"0\n"),
            doom.at("recording", "recording"),
        ),
    )
    around(RunRecorder, "append", handed_over, nothing)
    around(
        RunRecorder,
        "close",
        lambda *_: doom.at("sealing", "sealing"),
        lambda *_: doom.at("", "between"),
    )
    for name in ("sync", "finish"):
        around(SegmentedJournal, name, nothing, acknowledged)
    around(
        runner,
        "seal_orphans",
        lambda *_: doom.at("recovering", "recovering"),
        lambda *_: doom.at("", "connecting"),
    )
    for owner, name, stage in (
        (Zeroing, "_creep", "touching"),
        (session, "warm_up", "warming"),
        (driving, "cycle_between_forces", "cycling"),
    ):
        around(
            owner,
            name,
            lambda *_, stage=stage, **__: doom.at(stage, stage),
            lambda *_, stage=stage, **__: doom.at("", f"after {stage}"),
        )


def main(words: list[str]) -> None:
    """Run the command on the stand that is served already."""
    doom = Doom(Path(words[0]), words[1], float(words[2]))
    from bufferstand.cli.campaign import running
    from bufferstand.cli.main import main as bufferstand
    from bufferstand.drivers.simulated.serving.server import Served
    from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
    from bufferstand.foundation.clock import Clock, WallClock

    served = Served(**json.loads(Path(words[3]).read_text()))

    @contextmanager
    def stand(prepared: Any, **_: object) -> Iterator[tuple[StandFile, Clock]]:
        yield with_endpoints(prepared.stand_file, served.endpoints()), WallClock(served.speed)

    running.simulated_stand = stand
    watch(doom)
    sys.argv = ["bufferstand", *words[4:]]
    bufferstand()


def serve() -> None:
    """Run one command after the other, each in a process of its own that need not import everything again."""

    for line in sys.stdin:
        log, words = json.loads(line)
        child = os.fork()
        if child == 0:
            said = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            nowhere = os.open(os.devnull, os.O_RDONLY)
            for handle, source in ((0, nowhere), (1, said), (2, said)):
                os.dup2(source, handle)
            status = 1
            try:
                main(words)
            except SystemExit as end:
                status = int(end.code or 0)
            finally:
                sys.stderr.flush()
                os._exit(status)
        _, waited = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(waited), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["serve"]:
        serve()
    else:
        main(sys.argv[1:])
