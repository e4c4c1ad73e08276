"""Processes that record until they are killed, or until the disk is full."""

from __future__ import annotations

import os
import resource
import signal
import sys
import time
from pathlib import Path

from bufferstand.recording.recorder import RunRecorder
from tests.recording import samples

ROWS = 20
FILE_LIMIT_BYTES = 6 << 20


def say(text: str, where: int = 1) -> None:
    os.write(where, f"{text}\n".encode())


def record(directory: Path, acknowledgements: int) -> None:
    """Record without end; say after each acknowledgement how many samples are safe."""
    recorder = RunRecorder(
        directory, "run-1", samples.metadata(), sync_interval_s=0.001, segment_bytes=30_000
    )
    say("0", acknowledgements)
    first, said = 0, 0
    while True:
        recorder.append(*samples.block(first, ROWS))
        recorder.anchor(int(samples.time_us(first)), 1.0 + first * 1e-3, "2026-03-01T08:00:00+00:00")  # type: ignore[arg-type]
        first += ROWS
        while first - recorder.written > 50 * ROWS:
            time.sleep(0)  # keep pace with the disk instead of overrunning it
        if recorder.durable != said:
            said = recorder.durable
            say(str(said), acknowledgements)


def record_to_the_limit(directory: Path) -> None:
    """Record on a disk that is full after a few MiB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_LIMIT_BYTES, FILE_LIMIT_BYTES))
    recorder = RunRecorder(directory, "run-1", samples.metadata(), sync_interval_s=0.001)
    first, warned_at = 0, -1
    while recorder.failure is None:
        recorder.append(*samples.block(first, 1000))
        first += 1000
        while recorder.failure is None and first - recorder.written > 5000:
            time.sleep(0)
        if recorder.disk_warning and warned_at < 0:
            warned_at = recorder.written
    say(f"{warned_at} {recorder.durable} {recorder.failure}")
    recorder.close("complete")
    say(f"{recorder.durable}")


def kill(order: str) -> None:
    """Let a fork record into a folder, kill it after so many acknowledgements, say the last one it gave."""
    folder, wanted = order.rsplit("=", 1)
    out, into = os.pipe()
    child = os.fork()
    if child == 0:
        record(Path(folder), into)
    os.close(into)
    with os.fdopen(out) as lines:
        last = [int(lines.readline()) for _ in range(int(wanted) + 1)][-1]
        os.kill(child, signal.SIGKILL)
        for line in lines:
            last = int(line)
    os.waitpid(child, 0)
    say(str(last))


if __name__ == "__main__":
    if sys.argv[1] == "kill":
        for order in sys.argv[2:]:
            kill(order)
    else:
        record_to_the_limit(Path(sys.argv[2]))
