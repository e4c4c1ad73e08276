"""A process that seals copies of a journal and dies in each some system calls later."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any

from bufferstand.recording.sealing.seal_journal import seal

CALLS = {os.open, os.fsync, os.pwrite, os.fchmod, os.ftruncate, os.posix_fallocate, os.replace, os.unlink}


def die_at(number: int) -> None:
    """Kill this process right before (even) or after (odd) its n-th system call of interest."""
    seen = 0

    def watch(frame: FrameType, event: str, called: Any) -> None:
        nonlocal seen
        if event in ("c_call", "c_return") and called in CALLS:
            if seen == number:
                os.kill(os.getpid(), signal.SIGKILL)
            seen += 1

    sys.setprofile(watch)


def main(journal: Path, out: Path, stride: int) -> None:
    number = 0
    while True:
        folder = out / f"{number:03}"
        folder.mkdir()
        shutil.copy(journal, folder)
        child = os.fork()
        if child == 0:
            die_at(number)
            seal(folder / journal.name)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            break
        number += stride
    os.write(1, f"{number}\n".encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
