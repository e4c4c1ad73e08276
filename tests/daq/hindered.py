"""The real command on a disk that is slow and a computer whose clock is set: ``SLOW JUMP doomed-words…``.

``SLOW`` is ``least:most``, what every bringing to the disk takes longer [s], ``JUMP`` by how much the civil
time is set, 1 s after the first run began [s]. Both go where the real ones would: into the recorder's
``fdatasync`` and into the acquisition's civil time, as CLOCK_REALTIME belongs to everybody on this computer.
"""

from __future__ import annotations

import random
import sys
import time
from datetime import UTC, datetime, timedelta
from typing import Any

from tests.daq import doomed


def slow_disk(least_s: float, most_s: float) -> None:
    from bufferstand.recording.journal.file import JournalFile

    dice = random.Random(1)
    real = JournalFile.sync

    def sync(file: JournalFile) -> None:
        time.sleep(dice.uniform(least_s, most_s))
        real(file)

    JournalFile.sync = sync  # type: ignore[method-assign]


def jumping_clock(jump_s: float) -> None:
    from bufferstand.daq.acquisition.loop import Acquisition

    began: list[float] = []
    real_attach, real_init = Acquisition.attach, Acquisition.__init__

    def set_by() -> float:
        return jump_s if began and time.monotonic() - began[0] > 1.0 else 0.0

    def utc() -> str:
        return (datetime.now(UTC) + timedelta(seconds=set_by())).isoformat()

    def attach(acquisition: Acquisition, recorder: Any) -> None:
        began.append(time.monotonic())
        real_attach(acquisition, recorder)

    def init(acquisition: Acquisition, *words: Any, **named: Any) -> None:
        real_init(acquisition, *words, **named, civil_s=lambda: time.time() + set_by(), utc=utc)

    Acquisition.attach = attach  # type: ignore[method-assign]
    Acquisition.__init__ = init  # type: ignore[method-assign]


if __name__ == "__main__":
    least, most = map(float, sys.argv[1].split(":"))
    if most:
        slow_disk(least, most)
    if jump := float(sys.argv[2]):
        jumping_clock(jump)
    doomed.main(sys.argv[3:])
