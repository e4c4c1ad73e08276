"""Channels that fail: what they show is not what was there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene

from .common import cycle_s, inner, place, spanned, unloaded

CHANNEL_WORDS = {"force": r"force|\bkN\b", "stroke": r"stroke|wire|travel"}
STEP = r"\bjump|\bsteps?\b|\bslip|\bshift|\bgain|\boffset|agree|differ"
CLIP = r"clip|saturat|cut off|end of its range|\bflat\b"
STILL = r"fr[eo]ze|stuck|stands? still|constant|same value|does not (move|follow)|broken|\bh[eo]ld"
ALONE = r"spike|outlier|single (sample|value|reading)|stands? alone|\balone\b"
CODE = r"sentinel|\bcodes?\b|no value|overflow|not a (number|measurement|reading)|" + ALONE
SENTINELS = (-9999.0, 9.91e37, 32767.0, 999_999.0)


def drift_beyond(rng: np.random.Generator, s: Scene) -> Applied:
    """A zero of the force that wanders by more than is stated.

    Only between rests without load can it be told from a specimen that settles or warms up.
    """
    size = s.force_span * rng.uniform(0.04, 0.12) * rng.choice([-1.0, 1.0])
    way = (s.true_time_s - s.true_time_s[0]) / np.ptp(s.true_time_s)
    s.force_read_kN = s.force_read_kN + size * way
    seen = unloaded(s, 0) and unloaded(s, -1)
    return Applied(
        "drift-beyond",
        f"{size:.1f} kN over the record",
        kinds=("drift",),
        words=(CHANNEL_WORDS["force"], r"drift|zero (moves|moved|wanders|changes|differs)"),
        channel="force",
        figures="named" if seen else "hidden",
        may=("zero", "unlike", "offset-jump", "gain-jump", "sign"),
        plain=seen,
    )


def held(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A channel that is read more slowly than the rows are written, each value repeated."""
    per_cycle = cycle_s(s) / s.dt_s
    k = int(rng.integers(3, 12))
    if k > per_cycle / 60:
        return None
    at = np.arange(len(s.time_s)) // k * k
    which = "force" if rng.random() < 0.5 else "stroke"
    if which == "force":
        s.force_read_kN = s.force_read_kN[at]
    else:
        s.strokes_mm = [x[at] for x in s.strokes_mm]
    return Applied(
        "held",
        f"{which}, {k} rows",
        kinds=("held",),
        words=(CHANNEL_WORDS[which], r"\bh[eo]ld|repeat|same value|slower"),
        channel=which,
        figures="named",
        may=("frozen",),
        plain=True,
    )


def frozen(rng: np.random.Generator, s: Scene) -> Applied:
    """A channel that stands still for a while."""
    part = place(rng, s, cycle_s(s) * rng.uniform(0.08, 0.4))
    which = str(rng.choice(["force", "stroke"]))
    if which == "force":
        s.force_read_kN = s.force_read_kN.copy()
        s.force_read_kN[part] = s.force_read_kN[part.start]
    else:
        s.strokes_mm[0] = s.strokes_mm[0].copy()
        s.strokes_mm[0][part] = s.strokes_mm[0][part.start]
    start, end = spanned(s, part)
    return Applied(
        "frozen",
        f"{which}, rows {part.start} to {part.stop}",
        kinds=("frozen", "held"),
        words=(CHANNEL_WORDS[which], STILL),
        channel=which,
        figures="named",
        start_s=start,
        end_s=end + 2.0 * s.dt_s,
        may=("stroke-jump", "offset-jump", "gain-jump", "spike", "clipped", "unlike"),
        plain=bool(np.ptp(s.true_stroke()[part]) > 0.05 * s.span_mm) and part.stop - part.start >= 10,
    )


def _clip(s: Scene, which: str, level: float, values: list[np.ndarray], unit: str) -> Applied:
    over = np.flatnonzero(np.max(values, axis=0) > level)
    top = float(np.max(values))
    return Applied(
        f"clipped-{which}",
        f"{level:.1f} of {top:.1f} {unit}",
        kinds=("clipped",),
        words=(CHANNEL_WORDS[which], CLIP),
        channel=which,
        figures="named",
        start_s=float(s.true_time_s[over[0]]),
        end_s=float(s.true_time_s[over[-1]]),
        may=("held", "frozen", "unlike"),
        plain=len(over) >= 12,
    )


def clipped_force(rng: np.random.Generator, s: Scene) -> Applied | None:
    """An amplifier at the end of its range."""
    level = float(np.max(s.force_read_kN)) - s.force_span * rng.uniform(0.04, 0.35)
    if not (s.force_read_kN > level).any():
        return None
    made = _clip(s, "force", level, [s.force_read_kN], "kN")
    s.force_read_kN = np.minimum(s.force_read_kN, level)
    return made


def clipped_stroke(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Draw wires at the end of their range."""
    level = float(np.max(s.strokes_mm[0])) - s.span_mm * rng.uniform(0.03, 0.2)
    if not (s.strokes_mm[0] > level).any():
        return None
    made = _clip(s, "stroke", level, s.strokes_mm, "mm")
    s.strokes_mm = [np.minimum(x, level) for x in s.strokes_mm]
    return made


def spikes(rng: np.random.Generator, s: Scene) -> Applied:
    """Single samples that are not of this record."""
    count = int(rng.integers(1, 8))
    rows = rng.choice(np.arange(3, len(s.time_s) - 3), count, replace=False)
    size = rng.uniform(0.1, 0.6) * rng.choice([-1.0, 1.0], count)
    if rng.random() < 0.6:
        s.force_read_kN = s.force_read_kN.copy()
        s.force_read_kN[rows] += size * s.force_span
        which = "force"
    else:
        s.strokes_mm[0] = s.strokes_mm[0].copy()
        s.strokes_mm[0][rows] += size * s.span_mm
        which = "stroke"
    return _alone("spikes", f"{which}, {count} samples", which, s.true_time_s[rows], ALONE)


def sentinels(rng: np.random.Generator, s: Scene) -> Applied:
    """Codes for "no value" among the readings of force or stroke."""
    code, count = float(rng.choice(SENTINELS)), int(rng.integers(1, 6))
    rows = rng.choice(np.arange(3, len(s.time_s) - 3), count, replace=False)
    which = str(rng.choice(["force", "stroke"]))
    if which == "force":
        s.force_read_kN = s.force_read_kN.copy()
        s.force_read_kN[rows] = code
    else:
        s.strokes_mm[0] = s.strokes_mm[0].copy()
        s.strokes_mm[0][rows] = code
    return _alone("sentinel", f"{which}, {count} times {code:g}", which, s.true_time_s[rows], CODE)


def _alone(name: str, size: str, which: str, at: np.ndarray, words: str) -> Applied:
    return Applied(
        name,
        size,
        kinds=("spike",),
        words=(CHANNEL_WORDS[which], words),
        channel=which,
        figures="named",
        start_s=float(at.min()),
        end_s=float(at.max()),
        may=("stroke-jump", "offset-jump", "gain-jump", "clipped", "unlike", "unit", "sign"),
    )


def gain_jump(rng: np.random.Generator, s: Scene) -> Applied:
    """The force's gain changes within the motion."""
    at, factor = inner(rng, s), 1.0 + rng.uniform(0.05, 0.25) * rng.choice([-1.0, 1.0])
    s.force_read_kN = np.where(s.true_time_s >= at, factor * s.force_read_kN, s.force_read_kN)
    return replace(_jump("gain-jump", f"force x {factor:.3f} from {at:.2f} s", at), factor=factor)


def offset_jump(rng: np.random.Generator, s: Scene) -> Applied:
    """The force's zero changes within the motion."""
    at, size = inner(rng, s), s.force_span * rng.uniform(0.05, 0.2) * rng.choice([-1.0, 1.0])
    s.force_read_kN = np.where(s.true_time_s >= at, s.force_read_kN + size, s.force_read_kN)
    return _jump("offset-jump", f"force {size:+.1f} kN from {at:.2f} s", at)


def _jump(name: str, size: str, at: float) -> Applied:
    return Applied(
        name,
        size,
        kinds=("gain-jump", "offset-jump"),  # a single step looks like either
        words=(CHANNEL_WORDS["force"], STEP),
        channel="force",
        figures="named",
        start_s=at,
        may=("unlike", "drift", "zero", "spike", "sign"),
        plain=True,
    )


def stroke_slip(rng: np.random.Generator, s: Scene) -> Applied:
    """A draw wire slips; of two wires one does."""
    at, size = inner(rng, s), s.span_mm * rng.uniform(0.04, 0.12) * rng.choice([-1.0, 1.0])
    s.strokes_mm[0] = np.where(s.true_time_s >= at, s.strokes_mm[0] + size, s.strokes_mm[0])
    return Applied(
        "stroke-slip",
        f"{size:+.2f} mm from {at:.2f} s, 1 of {len(s.strokes_mm)} wires",
        kinds=("stroke-jump",),
        words=(CHANNEL_WORDS["stroke"], STEP),
        channel="stroke",
        figures="named",
        start_s=at,
        may=("unlike", "drift", "zero", "spike", "offset-jump", "sign"),
        plain=True,
    )
