"""Small archives for tests, and files that are wrong in their own ways."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings
from bufferstand.evaluation.archive.tables import cycles_frame, document, runs_frame
from bufferstand.evaluation.facts.run_facts import Options
from tests.evaluation_report.make_runs import Made, write_campaign
from tests.recording.samples import flipped

SETTINGS = EvaluationSettings(Options(draws=50))
NAMES = tuple(
    Made(f"h-{prestress:.0f}-{frequency:g}", prestress, 10.0, frequency, cycles=5)
    for prestress in (30.0, 60.0)
    for frequency in (1.0, 1.5, 2.0, 2.5)
)

LONG_S = 120.0
"""No wait takes so long but that of a test that fails."""

_POISON = """
import os, pathlib, signal

opened = pathlib.Path.open

def poisoned(path, *args, **kwargs):
    if "poison" in path.name:
        os.kill(os.getpid(), signal.SIGKILL)
    return opened(path, *args, **kwargs)

pathlib.Path.open = poisoned
"""

_SLOW = """
import pathlib, time
import h5py

class Slow(h5py.File):
    def __init__(self, name, *args, **kwargs):
        if "slow" in str(name):
            pathlib.Path(str(name) + ".opened").touch()
            time.sleep(600.0)
        super().__init__(name, *args, **kwargs)

h5py.File = Slow
"""


def archive(folder: Path) -> list[Path]:
    """Write eight harmonic runs of one specimen, long enough ago for their times to be trusted."""
    made = sorted(write_campaign(folder, NAMES).rglob("*.h5"))
    for path in made:
        path.chmod(0o644)
        aged(path)
    return made


def aged(path: Path, seconds: float = 1000.0) -> None:
    """Give a file an earlier time of change (that of its inode stays)."""
    facts = path.stat()
    os.utime(path, (facts.st_atime, facts.st_mtime - seconds))


def damaged(path: Path) -> None:
    """Turn one bit of the force of a run, and leave its time of change as it was."""
    facts = path.stat()
    with h5py.File(path) as tree:
        place = tree["entry/controller/force"].id.get_chunk_info(0).byte_offset
    flipped(path, 8 * (place + 20))
    os.utime(path, ns=(facts.st_atime_ns, facts.st_mtime_ns))


def let_poison_kill(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let every process started from now on die when it opens a file that has “poison” in its name."""
    return _in_processes(folder, _POISON, monkeypatch)


def let_slow_wait(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let processes started from now on wait when they open a file named “slow”; they make FILE.opened."""
    _in_processes(folder, _SLOW, monkeypatch)


def _in_processes(folder: Path, code: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = folder / "site"
    place.mkdir()
    (place / "sitecustomize.py").write_text(code)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(place), str(Path(__file__).resolve().parents[2])]))
    return place


def all_of_it(evaluation: ArchiveEvaluation) -> tuple[str, str, object]:
    """Return everything that an evaluation says, to be compared."""
    return (
        cycles_frame(evaluation).to_csv(index=False),
        runs_frame(evaluation).to_csv(index=False),
        document(evaluation),
    )


def until(true: Callable[[], bool]) -> None:
    """Wait for something to be true."""
    deadline = time.monotonic() + LONG_S
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.02)
