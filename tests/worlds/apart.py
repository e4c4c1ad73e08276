"""Worlds in processes of their own: forked from one that has everything loaded, ended when they are told."""

from __future__ import annotations

import os
import pickle
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from tests.worlds.laws import broken
from tests.worlds.life import Life, Lived
from tests.worlds.world import World

PATIENCE_S = 600.0
"""A world that has not ended after so long hangs [s of the wall]."""


@dataclass
class Result:
    """What became of a world, in little: it goes from process to process.

    Parameters
    ----------
    seed : int
    broken : list of str
        Which law was broken, and how; empty for a world that keeps them all.
    """

    seed: int
    broken: list[str]
    starts: list[str] = field(default_factory=list)
    struck: list[tuple[str, str]] = field(default_factory=list)
    """Name and phase of every trouble that struck, and of every step somebody was killed at."""
    drawn: int = 0
    stand_s: float = 0.0
    spent_s: float = 0.0
    """Processor time [s]."""
    runs: int = 0
    acknowledged: int = 0
    judged_cycles: int = 0
    beyond_U: int = 0
    reports: int = 0
    digest: str = ""


def prepare() -> None:
    """Load, once for all worlds of this process, what each would load for itself."""
    import bufferstand.evaluation.figures.plot
    import bufferstand.evaluation.report.writing  # noqa: F401
    from bufferstand.daq.strokes import prepare as prepare_strokes

    prepare_strokes()


def live(
    world: World,
    *,
    sabotage: Callable[[Life], object] | None = None,
    judge: Callable[[Lived], Result] | None = None,
    keep: Path | None = None,
) -> Result:
    """Live a world in a process of its own and judge it there.

    Parameters
    ----------
    world : World
    sabotage : callable, optional
        As for :class:`tests.worlds.life.Life`.
    judge : callable, optional
        Makes the result of what was lived, in the world's process; by every law if not given.
    keep : Path, optional
        Folder that keeps its files; without it they go.
    """
    prepare()
    folder = Path(tempfile.mkdtemp(prefix="world-")) if keep is None else keep
    folder.mkdir(parents=True, exist_ok=True)
    reads, writes = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", DeprecationWarning
        )  # of a fork beside threads: they have no part in it
        child = os.fork()
    if child == 0:
        os.setsid()
        os.close(reads)
        _live_here(world, folder.resolve(), sabotage, judge or judged, writes)
    os.close(writes)
    try:
        told = _read(reads, child)
    finally:
        os.close(reads)
        os.waitpid(child, 0)
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)
    if not told:
        return Result(world.seed, ["the world’s process ended, or hung, without a word"])
    result = pickle.loads(told)
    assert isinstance(result, Result)
    return result


def _read(handle: int, child: int) -> bytes:
    """Return what the world's last process says; one that hangs is ended with all its group."""
    until_s = time.monotonic() + PATIENCE_S
    parts: list[bytes] = []
    while True:
        ready, _, _ = select.select([handle], [], [], max(0.0, until_s - time.monotonic()))
        if not ready:
            os.killpg(child, signal.SIGKILL)
            return b""
        part = os.read(handle, 1 << 16)
        if not part:
            return b"".join(parts)
        parts.append(part)


def _live_here(
    world: World,
    folder: Path,
    sabotage: Callable[[Life], object] | None,
    judge: Callable[[Lived], Result],
    writes: int,
) -> NoReturn:
    def say(result: Result) -> NoReturn:
        with os.fdopen(writes, "wb") as stream:
            pickle.dump(result, stream)
        os._exit(0)

    try:
        Life(world, folder, sabotage).live(lambda lived: say(judge(lived)))
    except BaseException:  # noqa: BLE001 - nothing of this process may go on as the one it was forked from
        say(Result(world.seed, [f"a traceback: {traceback.format_exc()}"]))


def judged(lived: Lived) -> Result:
    """Judge a world by every law."""
    found, figures = broken(lived)
    world = lived.world
    killed = [(f"kill at {one.killed_at}", "") for one in lived.starts if one.killed_at]
    return Result(
        world.seed,
        found,
        [
            f"killed at {one.killed_at}" if one.killed_at else f"{one.status}: {one.reason}"
            for one in lived.starts
        ],
        [(trouble.name, phase) for one in lived.starts for trouble, phase, _ in one.struck] + killed,
        len(world.troubles),
        float(lived.truth["force_kN"].size * lived.period_s),
        lived.spent_s + time.process_time(),
        len(lived.runs),
        sum(one.acknowledged for one in lived.evidence),
        figures["judged"],
        figures["beyond U"],
        int(bool(lived.report)),
        lived.digest(),
    )
