"""Start the simulated stand as a process of its own, and end it again."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from bufferstand.drivers.simulated.serving.server import Served
from bufferstand.foundation import BadInput, DeviceFault, ExitStatus

READY_S = 120.0
"""Longest wait for a stand to come up [s of the wall]; on a busy machine that takes many times as long."""
STOP_S = 60.0
"""Longest wait for a stand to end when asked [s of the wall]: it may have a long truth to write."""
MEMORY = Path("/dev/shm")
"""File system in memory, where the system has one."""


class SimulatedStandProcess:
    """A running simulated stand; a context manager that stops it.

    It also ends by itself when this process does.

    Parameters
    ----------
    process : Popen
    served : Served
        Where it can be reached.
    log : Path
        What it wrote to standard error.
    """

    def __init__(self, process: subprocess.Popen[bytes], served: Served, log: Path) -> None:
        self._process = process
        self.served = served
        self.log = log

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    def stop(self) -> int:
        """Ask it to end (it takes its wires away and writes the truth); return its exit status.

        Raises
        ------
        DeviceFault
            If it did not end in time; it has been killed then.
        """
        if self.running:
            self._process.terminate()
        try:
            status = self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self.kill()
            raise DeviceFault(
                f"the simulated stand (process {self.pid}) did not end within {STOP_S:g} s and was killed; "
                f"see {self.log}"
            ) from None
        self._close_pipes()
        return status

    def kill(self) -> None:
        """End it at once, as a power cut would: wires stay behind, the truth is lost."""
        self._process.kill()
        self._process.wait()
        self._close_pipes()

    def _close_pipes(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def __enter__(self) -> SimulatedStandProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


@contextmanager
def wires_folder() -> Iterator[Path]:
    """Make a folder for a stand's wires, in memory if possible, and take it away at the end.

    The kernel's 1-Wire folder lies in memory, too. On a disk the renaming of a sensor's file can wait for the
    disk for half a second, and with it the whole stand, whose wires are served by one thread.

    Yields
    ------
    Path
    """
    memory = MEMORY if os.access(MEMORY, os.W_OK | os.X_OK) else None
    with tempfile.TemporaryDirectory(prefix="bufferstand-", dir=memory) as name:
        yield Path(name)


def start_process(
    stand_file: Path,
    *,
    directory: Path,
    model: Path | None = None,
    speed: float = 1.0,
    port: int = 0,
    truth: Path | None = None,
    faults: Sequence[str] = (),
    fault_file: Path | None = None,
    wait_for_reader: bool = False,
) -> SimulatedStandProcess:
    """Start a simulated stand and wait until it can be reached.

    Parameters
    ----------
    stand_file : Path
    directory : Path
        For its wires, its endpoints file (``endpoints.json``) and its log (``stand.log``).
    model : Path, optional
        Spring model instead of the one that the stand file names.
    speed : float
        Stand seconds in one second of the wall.
    port : int
        TCP port; 0 takes a free one.
    truth : Path, optional
        File for what really happened, written when it is stopped.
    faults : sequence of str
        As ``--fault`` takes them.
    fault_file : Path, optional
        Schedule of faults (TOML).
    wait_for_reader : bool
        Let it wait for whoever reads its ring; above a speed of 1 it always does.

    Raises
    ------
    BadInput
        If the stand refuses what it was given; the message is its own.
    DeviceFault
        If it does not come up.
    """
    directory.mkdir(parents=True, exist_ok=True)
    log = directory / "stand.log"
    arguments = [sys.executable, "-m", "bufferstand.drivers.simulated", str(stand_file.absolute())]
    arguments += ["--speed", repr(speed), "--port", str(port), "--with-parent"]
    arguments += ["--wires", str((directory / "wires").absolute())]
    arguments += ["--endpoints", str((directory / "endpoints.json").absolute())]
    for option, path in (("--model", model), ("--truth", truth), ("--faults", fault_file)):
        if path is not None:
            arguments += [option, str(path.absolute())]
    for fault in faults:
        arguments += ["--fault", fault]
    if wait_for_reader:
        arguments.append("--wait-for-reader")
    home = str(Path(__file__).parents[4])
    inherited = os.environ.get("PYTHONPATH")
    environment = {**os.environ, "PYTHONPATH": f"{home}{os.pathsep}{inherited}" if inherited else home}
    with log.open("wb") as errors:
        # A session of its own: Ctrl-C must stop the campaign, not pull the stand from under it.
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            env=environment,
            start_new_session=True,
        )
    try:
        return SimulatedStandProcess(process, _wait_until_ready(process, log), log)
    except BaseException:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
        raise


def _wait_until_ready(process: subprocess.Popen[bytes], log: Path) -> Served:
    """Read the line with which the server says where it is."""
    if process.stdout is None:
        raise ValueError("the process has no standard output to listen to")
    descriptor = process.stdout.fileno()
    line = b""
    deadline_s = time.monotonic() + READY_S
    while not line.endswith(b"\n"):
        left_s = deadline_s - time.monotonic()
        if left_s <= 0.0:
            raise DeviceFault(f"the simulated stand was not ready within {READY_S:g} s; see {log}")
        if not select.select([descriptor], [], [], left_s)[0]:
            continue
        piece = os.read(descriptor, 4096)
        if not piece:
            status = process.wait(STOP_S)
            said = log.read_text(encoding="utf-8", errors="replace").strip()
            if status == ExitStatus.BAD_INPUT:
                raise BadInput(said)
            raise DeviceFault(f"the simulated stand ended with status {status} before it was ready: {said}")
        line += piece
    return Served(**json.loads(line))
