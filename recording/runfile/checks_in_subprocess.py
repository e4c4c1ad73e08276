"""Opens a file that may be damaged in a separate process, which is ended if it does not return.

HDF5 trusts what it reads: in its file format 1.8 the heap of texts has no check sum, and one turned bit in it
lets its library run in circles for ever, or crash. No thread can stop it, as it runs in C. So this
process opens by HDF5 only files that are as they were sealed, or that another one has read to the end.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.recording.runfile.content_checks import ContentFault, content_faults
from bufferstand.recording.runfile.reading import RESTORE

LEAST_S = 30
"""So much processor time a file has in any case: some hundred times of what a small one takes …"""
BYTES_PER_S = 5_000_000
"""… and a second more for so many bytes: a tenth of the pace of a slow machine."""
_WALL_RATIO = 10
"""Waiting for a disk or for busy cores is no fault of the file; waiting for ever helps nobody."""


def content_faults_apart(path: Path) -> list[ContentFault]:
    """Return :func:`bufferstand.recording.runfile.content_checks.content_faults` of a file that is not as
    it was sealed.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BadInput
        As :func:`bufferstand.recording.runfile.content_checks.content_faults`, or if HDF5 crashes on the file
        or does not end.
    """
    if not path.is_file():
        raise BadInput("no such file", file=path, remedy="check the path")
    seconds = LEAST_S + path.stat().st_size // BYTES_PER_S
    command = [sys.executable, "-P", "-m", __name__, str(path.absolute()), str(seconds)]
    # What this process imports from where, that one has to: it may run from a folder or an archive.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_WALL_RATIO * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _damaged("it cannot be read in reasonable time", path) from None
    if done.returncode == -signal.SIGXCPU:
        raise _damaged("HDF5 does not come to an end with it", path)
    if done.returncode < 0:
        raise _damaged(f"HDF5 crashes on it ({signal.Signals(-done.returncode).name})", path)
    if done.returncode > 0:
        last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise _damaged(f"it cannot be looked into ({last or f'status {done.returncode}'})", path)
    return _understood(json.loads(done.stdout), path)


def _damaged(what: str, path: Path) -> BadInput:
    return BadInput(
        f"damaged: {what}, and its bytes are not those that were sealed", file=path, remedy=RESTORE
    )


def _understood(said: dict[str, Any], path: Path) -> list[ContentFault]:
    if "refused" in said:
        raise BadInput(file=path, **said["refused"])
    return [ContentFault(**finding) for finding in said["findings"]]


def _look(path: Path, seconds: int) -> None:
    """Say as JSON what is found; the system ends this process when its time is over, whoever still waits."""
    most = resource.getrlimit(resource.RLIMIT_CPU)[1]
    resource.setrlimit(
        resource.RLIMIT_CPU, (seconds if most == resource.RLIM_INFINITY else min(seconds, most), most)
    )
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        said: dict[str, Any] = {"findings": [asdict(finding) for finding in content_faults(path)]}
    except BadInput as error:
        said = {"refused": {"problem": error.problem, "place": error.place, "remedy": error.remedy}}
    sys.stdout.write(json.dumps(said))


if __name__ == "__main__":
    _look(Path(sys.argv[1]), int(sys.argv[2]))
