"""What the kinds of imperfections share: where in a record they may act."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene

Fault = Callable[[np.random.Generator, Scene], Applied | None]


@dataclass(frozen=True)
class Kind:
    """A kind of imperfection: at which stage it arises, and which it excludes."""

    name: str
    stage: int  # 0 analog, 1 converter, 2 thermometers, 3 rows, 4 stamps, 5 export
    group: str
    make: Fault


def place(rng: np.random.Generator, s: Scene, length_s: float) -> slice:
    """Return a stretch of rows while the specimen moves."""
    rows = np.flatnonzero(s.moving())
    first = int(rng.choice(rows[: max(1, len(rows) - 2)]))
    last = int(np.searchsorted(s.true_time_s, s.true_time_s[first] + length_s))
    return slice(first, max(first + 1, min(last, len(s.time_s))))


def spanned(s: Scene, part: slice) -> tuple[float, float]:
    """Return the true times of the first and the last row of a stretch."""
    return float(s.true_time_s[part.start]), float(s.true_time_s[part.stop - 1])


def cycle_s(s: Scene) -> float:
    """Return how long a cycle takes."""
    whole = [c.end_s - c.start_s for c in s.cycles if c.whole]
    return float(np.median(whole)) if whole else float(np.ptp(s.true_time_s))


def inner(rng: np.random.Generator, s: Scene) -> float:
    """Return a moment well within the motion: from 20 to 80 % of it."""
    moving = s.true_time_s[s.moving()]
    return float(np.quantile(moving, rng.uniform(0.2, 0.8)))


def unloaded(s: Scene, row: int) -> bool:
    """Return whether the specimen is free of the stand at a row, by more than the seat and the noise hide."""
    return s.motion.kind == "static" and bool(s.true_stroke()[row] < -0.15)
