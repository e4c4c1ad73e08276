"""A process that seals and verifies a long journal and says how much memory that took."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

from bufferstand.recording.journal.records import DataRecord, EndRecord
from bufferstand.recording.journal.segments import SegmentedJournal
from bufferstand.recording.sealing.seal_journal import seal
from bufferstand.recording.sealing.verification import verify
from tests.recording import samples
from tests.recording.peak_memory import peak_MB

ROWS = 20_000


def write(directory: Path, megabytes: int) -> int:
    """Write a journal of so many megabytes; return its samples."""
    journal = SegmentedJournal(
        directory / "run-1.journal", "run-1", samples.metadata(), segment_bytes=megabytes * 300_000
    )
    rows = 0
    stream, _, _, counts = samples.block(0, ROWS)
    dice = np.random.default_rng(1)
    while rows * 16 < megabytes * 1_000_000:
        counts["force"] = dice.integers(-(2**31), 2**31, ROWS, dtype=np.int32)  # no codec makes it smaller
        stamps = samples.time_us(np.arange(rows, rows + ROWS))
        journal.write([DataRecord(stream, rows, 0, stamps, counts)])
        journal.sync()
        rows += ROWS
    journal.finish(EndRecord("complete", "", "2026-03-01T08:00:00+00:00"))
    journal.close()
    return rows


def main(directory: Path, megabytes: int) -> None:
    child = os.fork()  # what writing takes does not count
    if child == 0:
        write(directory, megabytes)
        os._exit(0)
    os.waitpid(child, 0)
    before = peak_MB()
    path = seal(directory / "run-1.journal")
    sealed = peak_MB()
    findings = verify(path)
    print(f"{before:.0f} {sealed:.0f} {peak_MB():.0f} {path.stat().st_size / 1e6:.0f} {len(findings)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
