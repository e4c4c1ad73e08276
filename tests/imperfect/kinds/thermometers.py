"""Temperatures: readings that are few, gone, or codes of a sensor that failed."""

from __future__ import annotations

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene

from .common import inner

SENSOR = (r"sensor|temperature|thermometer", r"fault|power-on|disconnect|disturbed|\bcodes?\b|left out")
COVERED_S = 13.0  # well below the 15 s of docs/evaluation/requirements.md


def _readings_at(s: Scene, wanted: np.ndarray) -> None:
    """Leave readings only in the rows that are wanted (mask)."""
    s.temperatures_C = [np.where(wanted, x, np.nan) for x in s.temperatures_C]


def sparse(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A slow logger of temperatures."""
    if not s.temperatures_C:
        return None
    seconds = float(rng.choice([rng.uniform(2.0, 12.0), rng.uniform(20.0, 60.0)]))
    slot = np.floor((s.true_time_s - s.true_time_s[0]) / seconds)
    _readings_at(s, np.concatenate([[True], np.diff(slot) > 0]))
    return Applied("temperature-sparse", f"every {seconds:.1f} s", harmless=seconds < COVERED_S)


def first_second(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Temperatures written down where each cycle starts, and not again."""
    if not s.temperatures_C:
        return None
    wanted = np.zeros(len(s.time_s), dtype=bool)
    for c in s.cycles:
        wanted |= (s.true_time_s >= c.start_s - 0.5) & (s.true_time_s <= c.start_s + 0.5)
    if wanted.all():
        return None
    _readings_at(s, wanted)
    return Applied("temperature-first-second", "about the start of each cycle")


def hole(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A hole in the readings."""
    if not s.temperatures_C:
        return None
    long = rng.uniform(5.0, 60.0)
    at = rng.uniform(s.true_time_s[0], s.true_time_s[-1])
    _readings_at(s, (s.true_time_s < at) | (s.true_time_s > at + long))
    return Applied("temperature-hole", f"{long:.0f} s from {at:.0f} s", harmless=long < 10.0)


def _odd(rng: np.random.Generator, s: Scene, value: float, name: str) -> Applied | None:
    if not s.temperatures_C:
        return None
    k = int(rng.integers(len(s.temperatures_C)))
    seconds = float(rng.choice([0.0, rng.uniform(0.5, 4.0)]))
    at = rng.uniform(s.true_time_s[0], max(s.true_time_s[0], s.true_time_s[-1] - seconds))
    rows = (s.true_time_s >= at) & (s.true_time_s <= at + max(seconds, 1.01 * s.dt_s))
    rows &= np.isfinite(s.temperatures_C[k])
    if not rows.any():
        return None
    s.temperatures_C[k] = np.where(rows, value, s.temperatures_C[k])
    if s.faulty_C:
        s.faulty_C[k] |= rows
    return Applied(
        name,
        f"sensor {k + 1}, {value:g} °C for {seconds:.1f} s at {at:.1f} s",
        kinds=("spike",),
        words=SENSOR,
        channel="temperature",
        figures="named",
        start_s=float(s.true_time_s[rows][0]),
        end_s=float(s.true_time_s[rows][-1]),
        may=("held", "frozen", "offset-jump", "clipped"),
        harmless=seconds < 4.0,
    )


def power_on(rng: np.random.Generator, s: Scene) -> Applied | None:
    """The value of a sensor before its first conversion."""
    return _odd(rng, s, 85.0, "temperature-85")


def disconnected(rng: np.random.Generator, s: Scene) -> Applied | None:
    """The code of a sensor that does not answer."""
    return _odd(rng, s, float(rng.choice([-127.0, 999.9, -9999.0, 850.0])), "temperature-127")


def swapped(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Two plugs are exchanged: both sensors are on the specimen, and nothing is wrong."""
    if len(s.temperatures_C) < 2:
        return None
    later = s.true_time_s > inner(rng, s)
    a, b = s.temperatures_C[:2]
    s.temperatures_C[:2] = [np.where(later, b, a), np.where(later, a, b)]
    return Applied("temperature-swapped", "two plugs exchanged", harmless=True)


def missing(rng: np.random.Generator, s: Scene) -> Applied | None:
    """No thermometer at all: what depends on it is inconclusive."""
    if not s.temperatures_C:
        return None
    s.temperatures_C, s.faulty_C = [], []
    return Applied("temperature-missing", "no channel")
