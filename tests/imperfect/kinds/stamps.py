"""Clocks and stamps."""

from __future__ import annotations

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene

from .common import inner

STAMP = (r".", r"repeated|backward|doubled|duplicate|same stamp|stamps? (of|that|is|are)|clock")
TIMES = frozenset(
    {
        "frequency_Hz",
        "speed_loading_max_mm_per_s",
        "speed_unloading_max_mm_per_s",
        "speed_max_mm_per_s",
        "dynamic_stiffness_kN_per_mm",
        "storage_stiffness_kN_per_mm",
        "loss_stiffness_kN_per_mm",
        "loss_factor",
        "speed-limit",
        "pause-limit",
        "immediate-unloading",
    }
)


def doubled(rng: np.random.Generator, s: Scene) -> Applied:
    """Rows that were written twice."""
    n = len(s.time_s)
    count = max(1, int(n * rng.choice([0.001, 0.02, 1.0])))
    s.keep(np.sort(np.concatenate([np.arange(n), rng.choice(n, count, replace=False)])))
    return Applied("doubled", f"{count} of {n} rows", words=STAMP, harmless=True)


def backward(rng: np.random.Generator, s: Scene) -> Applied:
    """Rows that were exchanged."""
    n = len(s.time_s)
    count = int(rng.integers(1, 6))
    order = np.arange(n)
    for i in rng.choice(np.arange(2, n - 3), count, replace=False):
        order[i], order[i + 1] = order[i + 1], order[i]
    s.keep(order)
    # each channel has its own instants: rows of two channels that change places leave both in order
    rows = [np.isfinite(x) for x in (s.force_read_kN, *s.strokes_mm, *s.temperatures_C)]
    seen = any((np.diff(s.time_s[filled]) <= 0.0).any() for filled in rows)
    size = f"{count} pairs of rows exchanged"
    return Applied("backward", size, words=STAMP if seen else None, harmless=True)


def clock_back(rng: np.random.Generator, s: Scene) -> Applied:
    """A clock that was set back: how long that took is not known, what was pushed is."""
    at, by = inner(rng, s), s.dt_s * rng.uniform(2.0, 20.0)
    s.time_s = np.where(s.true_time_s > at, s.time_s - by, s.time_s)
    return Applied(
        "clock-set-back",
        f"{by:.4f} s at {at:.2f} s",
        words=STAMP,
        channel="time",
        figures="named",
        falsifies=TIMES,
        may=("stroke-jump", "offset-jump", "gain-jump", "spike"),
        start_s=at - 2.0 * s.dt_s,
        end_s=at + by + 2.0 * s.dt_s,
    )


def rounded(rng: np.random.Generator, s: Scene) -> Applied:
    """Stamps with few digits."""
    step = float(rng.choice([0.001, 0.01]))
    while step > 4.0 * s.dt_s:
        step /= 10.0
    s.time_s = np.round(s.time_s / step) * step
    return Applied("rounded-stamps", f"{step} s at {s.dt_s:.4f} s", harmless=True)


def jittered(rng: np.random.Generator, s: Scene) -> Applied:
    """Stamps given late by a busy computer."""
    size = s.dt_s * rng.uniform(0.02, 0.2)
    noise = np.clip(rng.normal(0, size, len(s.time_s)), -0.45 * s.dt_s, 0.45 * s.dt_s)
    s.time_s = s.time_s + noise
    return Applied("jitter", f"{size / s.dt_s:.2f} of a step", harmless=True)
