"""Rows that a logger loses, leaves out or leaves blank."""

from __future__ import annotations

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene

from .common import cycle_s, inner, place, spanned

GAP = (r".", r"\blost\b|missing|\bgaps?\b|not on record|no samples?\b|\bholes?\b|interrupt")
BLANK = (
    r".",
    r"no value|no number|\bNaN\b|\bblanks?\b|missing|\bempty\b|\blost\b|\bgaps?\b|without a number",
)


def _lost(s: Scene, name: str, size: str, keep: np.ndarray, *, harmless: bool = False) -> Applied:
    gone = s.true_time_s[~keep]
    start, end = float(gone.min()), float(gone.max())
    # a loss that reaches the end leaves no gap: a record that ends, or begins, where rows are left
    words = GAP if keep[0] and keep[-1] else None
    s.keep(keep)
    return Applied(
        name, size, words=words, channel="time", start_s=start, end_s=end, harmless=harmless, may=("unlike",)
    )


def lost_single(rng: np.random.Generator, s: Scene) -> Applied:
    """One sample, or one in a thousand."""
    n = len(s.time_s)
    count = max(1, round(n * rng.choice([0.0, 0.0005, 0.001])))
    keep = np.ones(n, dtype=bool)
    keep[rng.choice(np.arange(1, n - 1), count, replace=False)] = False
    return _lost(s, "lost-single", f"{count} of {n} rows", keep, harmless=True)


def lost_burst(rng: np.random.Generator, s: Scene) -> Applied:
    """A stretch within the motion."""
    part = place(rng, s, cycle_s(s) * rng.uniform(0.01, 0.25))
    keep = np.ones(len(s.time_s), dtype=bool)
    keep[part] = False
    return _lost(s, "lost-burst", f"{part.stop - part.start} rows", keep)


def lost_turn(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A stretch about a turning point."""
    tops = [c.top_s for c in s.cycles] + [c.end_s for c in s.cycles]
    if not tops:
        return None
    at, long = float(rng.choice(tops)), cycle_s(s) * rng.uniform(0.005, 0.08)
    keep = np.abs(s.true_time_s - at) > max(long, 1.5 * s.dt_s) / 2
    if keep.all() or at < s.true_time_s[2] or at > s.true_time_s[-3]:
        return None
    return _lost(s, "lost-turn", f"{int(np.sum(~keep))} rows about {at:.2f} s", keep)


def lost_branch(rng: np.random.Generator, s: Scene) -> Applied | None:
    """All samples between two turns: a branch without inner samples."""
    whole = [c for c in s.cycles if c.whole]
    if not whole:
        return None
    c = whole[int(rng.integers(len(whole)))]
    a, b = (c.start_s, c.top_s) if rng.random() < 0.5 else (c.leaves_top_s, c.end_s)
    edge = 0.02 * (b - a)
    keep = ~((s.true_time_s > a + edge) & (s.true_time_s < b - edge))
    if keep.all():
        return None
    return _lost(s, "lost-branch", f"{int(np.sum(~keep))} rows from {a:.2f} to {b:.2f} s", keep)


def lost_stroke(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A whole stroke, from rest to rest: nobody can know that there was one."""
    inside = [c for c in s.cycles[:-1] if c.whole]
    if s.motion.kind != "static" or not inside:
        return None
    c = inside[int(rng.integers(len(inside)))]
    keep = ~((s.true_time_s > c.start_s - 0.3) & (s.true_time_s < c.end_s + 0.6))
    if keep.all() or s.true_time_s[0] > c.start_s - 0.3:
        return None
    return _lost(s, "lost-stroke", f"stroke {c.number}", keep)


def lost_pause(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A stretch of a pause."""
    rests = [(a, b) for a, b in s.motion.rests[1:-1] if b - a > 1.0]
    if s.motion.kind != "static" or not rests:
        return None
    a, b = rests[int(rng.integers(len(rests)))]
    first = rng.uniform(a + 0.6, b - 0.3) if b - a > 0.95 else a + 0.6
    long = float(rng.choice([s.dt_s, rng.uniform(0.0, max(0.0, b - 0.2 - first))]))
    keep = ~((s.true_time_s >= first) & (s.true_time_s <= first + max(long, 1.01 * s.dt_s)))
    if keep.all():
        return None
    shortest = min((c.end_s - c.start_s for c in s.cycles), default=1.0)
    size = f"{long:.2f} s in the pause at {first:.1f} s"
    return _lost(s, "lost-pause", size, keep, harmless=long < 0.5 * shortest)


def slower_at_rest(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A logger that slows down at rest."""
    if s.motion.kind != "static":
        return None
    factor = int(rng.choice([5, 10, 50]))
    s.keep(s.moving() | (np.arange(len(s.time_s)) % factor == 0))
    return Applied("rate-change", f"1/{factor} of the rate at rest", harmless=True)


def stops_at_rest(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A logger that stops at rest."""
    if s.motion.kind != "static":
        return None
    s.keep(s.moving())
    short = all(b - a < 8.0 for a, b in s.motion.rests[1:-1])
    return Applied("stops-at-rest", "no rows at rest", harmless=short)


def slower_in_motion(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A logger that slows down while the stand moves."""
    factor = int(rng.choice([2, 5]))
    if cycle_s(s) / s.dt_s < 60 * factor:
        return None
    at = inner(rng, s)
    s.keep((s.true_time_s < at) | (np.arange(len(s.time_s)) % factor == 0))
    return Applied("rate-change-moving", f"1/{factor} of the rate from {at:.2f} s", harmless=True)


def few_samples(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Few samples a cycle: the bound on what lies between them is part of U (contract, section 4)."""
    left = float(np.exp(rng.uniform(np.log(3.0), np.log(70.0))))
    k = int(cycle_s(s) / s.dt_s / left)
    if k < 2 or len(s.time_s) // k < 6:
        return None
    s.keep(np.arange(len(s.time_s)) % k == 0)
    return Applied("few-samples", f"{left:.0f} a cycle")


def by_event(rng: np.random.Generator, s: Scene) -> Applied:
    """A row where something has changed, or a beat has passed."""
    mm, kN = s.span_mm * rng.uniform(0.0005, 0.003), s.force_span * rng.uniform(0.0005, 0.003)
    beat = float(rng.choice([1.0, 5.0]))
    x, f, t = s.strokes_mm[0], s.force_read_kN, s.time_s
    keep = np.zeros(len(t), dtype=bool)
    last = 0
    keep[0] = True
    for i in range(1, len(t)):
        if abs(x[i] - x[last]) > mm or abs(f[i] - f[last]) > kN or t[i] - t[last] > beat:
            keep[i] = True
            last = i
    s.keep(keep)
    fine = max(mm / s.span_mm, kN / s.force_span) < 0.001
    return Applied("event-log", f"{mm:.3f} mm, {kN:.2f} kN, {beat} s", harmless=fine)


def no_numbers(rng: np.random.Generator, s: Scene) -> Applied:
    """Single cells without a number."""
    n = len(s.time_s)
    count = max(1, round(n * rng.choice([0.0, 0.001])))
    rows = rng.choice(np.arange(1, n - 1), count, replace=False)
    if rng.random() < 0.5:
        s.force_read_kN = s.force_read_kN.copy()
        s.force_read_kN[rows] = np.nan
    else:
        s.strokes_mm = [x.copy() for x in s.strokes_mm]
        for x in s.strokes_mm:
            x[rows] = np.nan
    return Applied("nan-cells", f"{count} of {n}", words=BLANK, harmless=True)


def no_numbers_burst(rng: np.random.Generator, s: Scene) -> Applied:
    """A stretch of the force without numbers."""
    part = place(rng, s, cycle_s(s) * rng.uniform(0.01, 0.2))
    s.force_read_kN = s.force_read_kN.copy()
    s.force_read_kN[part] = np.nan
    start, end = spanned(s, part)
    return Applied(
        "nan-burst", f"force, rows {part.start} to {part.stop}", words=BLANK, start_s=start, end_s=end
    )


def slower_force(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A force that is read in every k-th row."""
    k = int(rng.choice([2, 4, 5]))
    if cycle_s(s) / s.dt_s < 60 * k:
        return None
    s.force_read_kN = np.where(np.arange(len(s.time_s)) % k == 0, s.force_read_kN, np.nan)
    return Applied("blanks", f"force in every {k}th row", harmless=True)


def interleaved(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Force and stroke are read at instants of their own, each in rows of its own."""
    if cycle_s(s) / s.dt_s < 240:
        return None
    k = int(rng.choice([2, 3]))
    row = np.arange(len(s.time_s))
    s.force_read_kN = np.where(row % k == 0, s.force_read_kN, np.nan)
    s.strokes_mm = [np.where(row % k == 1, x, np.nan) for x in s.strokes_mm]
    return Applied("interleaved", f"force and stroke in turn, each in every {k}th row", harmless=True)
