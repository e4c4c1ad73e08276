"""Start the twin's process beside a campaign, and end it with the campaign; it can hold up nothing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

END_S = 10.0
"""Longest wait for it to judge what it has heard [s]."""


@contextmanager
def twin_process(folder: Path, model: Path, say: Callable[[str], object]) -> Iterator[None]:
    """While inside, a process judges the campaign's cycles by a model.

    Parameters
    ----------
    folder : Path
        The campaign's folder; it need not be there yet.
    model : Path
        The model file.
    say : callable
        Tells the operator if it ended before its time.

    Raises
    ------
    BadInput
        If the model cannot be read, or does not say how well it is known.
    """
    demand_known(model)
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand.daq.twin", str(folder.absolute()), str(model.absolute())],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C in the terminal is for the campaign
    )
    try:
        yield
    finally:
        if process.poll() is not None and process.returncode != 0:
            say(f"the twin ended too early (status {process.returncode}): not every cycle was judged")
        if process.stdin is not None:
            with suppress(OSError):
                process.stdin.close()
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def demand_known(path: Path) -> None:
    """Refuse a model file that the twin cannot judge by, before anything moves.

    Raises
    ------
    BadInput
        With the file, and what to do.
    """
    from bufferstand.model.twin import load_known  # noqa: PLC0415 - half a second, for campaigns with a twin only

    load_known(path)
