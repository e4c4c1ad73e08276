"""What goes wrong with records: random kinds and sizes, and what may be asked of an evaluation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from .chain import Applied, Scene

Fault = Callable[[np.random.Generator, Scene], Applied | None]

GAP = r"lost|missing|gap|not on record|no sample|hole|interrupt"
STEP = r"jump|step|gain|offset|shift|slip|agree|differ"
STAMP = r"repeated|backward|time stamp|doubled|duplicate|same stamp"
UNIT = r"unit|factor|implausib|not plausible|1000|range of the stand|beyond"
SENSOR = r"sensor|power-on|85|127|disconnect|thermometer"


@dataclass(frozen=True)
class Kind:
    """A kind of imperfection: at which stage it arises, and which it excludes."""

    name: str
    stage: int  # 0 analog, 1 converter, 2 thermometers, 3 rows, 4 stamps, 5 export
    group: str
    make: Fault


def _place(rng: np.random.Generator, s: Scene, length_s: float) -> slice:
    """A stretch of rows while the specimen moves."""
    rows = np.flatnonzero(s.moving())
    first = int(rng.choice(rows[: max(1, len(rows) - 2)]))
    last = int(np.searchsorted(s.true_time_s, s.true_time_s[first] + length_s))
    return slice(first, max(first + 1, min(last, len(s.time_s))))


def _cycle_s(s: Scene) -> float:
    whole = [c.end_s - c.start_s for c in s.cycles if c.whole]
    return float(np.median(whole)) if whole else float(np.ptp(s.true_time_s))


def _inner(rng: np.random.Generator, s: Scene) -> float:
    """A moment well within the motion: from 20 to 80 % of the record."""
    moving = s.true_time_s[s.moving()]
    return float(np.quantile(moving, rng.uniform(0.2, 0.8)))


def coloured(rng: np.random.Generator, s: Scene) -> Applied:
    a = float(np.exp(-s.dt_s / rng.uniform(0.005, 0.05)))
    size = s.force_span * rng.uniform(0.0003, 0.002)
    n = len(s.time_s)
    s.force_read_kN = s.force_read_kN + lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(0, size, n))
    s.strokes_mm = [x + lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(0, 0.01, n)) for x in s.strokes_mm]
    return Applied("noise-coloured", f"{size:.2f} kN", harmless=True)


def hum(rng: np.random.Generator, s: Scene) -> Applied | None:
    rate = s.motion.sample_rate_Hz
    seen = abs((50.0 + rate / 2) % rate - rate / 2)
    if seen < 2.0:
        return None
    size, phase = s.force_span * rng.uniform(0.0005, 0.004), rng.uniform(0, 6.3)
    wave = np.sin(2 * np.pi * 50.0 * s.true_time_s + phase)
    s.force_read_kN = s.force_read_kN + size * wave
    s.strokes_mm = [x + 0.01 * wave for x in s.strokes_mm]
    return Applied("hum", f"{size:.2f} kN at 50 Hz (seen at {seen:.1f} Hz)", harmless=True)


def quantised(rng: np.random.Generator, s: Scene) -> Applied:
    kN, mm = s.force_span * rng.uniform(0.0003, 0.003), float(rng.choice([0.01, 0.02, 0.05, 0.1]))
    s.force_read_kN = np.round(s.force_read_kN / kN) * kN
    s.strokes_mm = [np.round(x / mm) * mm for x in s.strokes_mm]
    return Applied("quantised", f"{kN:.2f} kN, {mm} mm", harmless=True)


def drift_within(rng: np.random.Generator, s: Scene) -> Applied | None:
    if "force" not in s.stated:
        return None
    limit = 0.3 * s.stated["force"].zero
    way = (s.true_time_s - s.true_time_s[0]) / np.ptp(s.true_time_s)
    s.force_read_kN = s.force_read_kN + limit * way
    return Applied("drift-within", f"{limit:.2f} kN", harmless=True)


def wire_period(rng: np.random.Generator, s: Scene) -> Applied | None:
    if "stroke_1" not in s.stated:
        return None
    drum, phase = rng.uniform(150.0, 320.0), rng.uniform(0.0, 2 * np.pi)
    limit = rng.uniform(0.3, 0.9) * s.stated["stroke_1"].linearity
    s.strokes_mm = [
        x + limit * (np.sin(2 * np.pi * x / drum + phase) - np.sin(phase)) / 2 for x in s.strokes_mm
    ]
    return Applied("wire-period", f"±{limit:.3f} mm over {drum:.0f} mm", harmless=True)


def drift_beyond(rng: np.random.Generator, s: Scene) -> Applied:
    size = s.force_span * rng.uniform(0.04, 0.12) * rng.choice([-1.0, 1.0])
    way = (s.true_time_s - s.true_time_s[0]) / np.ptp(s.true_time_s)
    s.force_read_kN = s.force_read_kN + size * way
    return Applied(
        "drift-beyond", f"{size:.1f} kN over the record", r"drift|zero|settl|offset|agree", "judged"
    )


def held(rng: np.random.Generator, s: Scene) -> Applied | None:
    per_cycle = _cycle_s(s) / s.dt_s
    k = int(rng.integers(3, 12))
    if k > per_cycle / 60:
        return None
    at = np.arange(len(s.time_s)) // k * k
    if rng.random() < 0.5:
        s.force_read_kN = s.force_read_kN[at]
        which = "force"
    else:
        s.strokes_mm = [x[at] for x in s.strokes_mm]
        which = "stroke"
    return Applied("held", f"{which}, {k} rows", r"h[eo]ld|repeat|same value|slower", "judged")


def frozen(rng: np.random.Generator, s: Scene) -> Applied:
    part = _place(rng, s, _cycle_s(s) * rng.uniform(0.08, 0.4))
    which = str(rng.choice(["force", "stroke"]))
    if which == "force":
        s.force_read_kN = s.force_read_kN.copy()
        s.force_read_kN[part] = s.force_read_kN[part.start]
    else:
        s.strokes_mm[0] = s.strokes_mm[0].copy()
        s.strokes_mm[0][part] = s.strokes_mm[0][part.start]
    visible = np.ptp(s.true_stroke()[part]) > 0.05 * s.span_mm and part.stop - part.start >= 10
    word = r"fr[eo]ze|stuck|stand(s)? still|constant|same value|does not (move|follow)|broken|h[eo]ld"
    return Applied(
        "frozen", f"{which}, rows {part.start} to {part.stop}", word if visible else None, "judged"
    )


def clipped_force(rng: np.random.Generator, s: Scene) -> Applied | None:
    top = float(np.max(s.force_read_kN))
    level = top - s.force_span * rng.uniform(0.04, 0.35)
    count = int(np.sum(s.force_read_kN > level))
    s.force_read_kN = np.minimum(s.force_read_kN, level)
    word = r"clip|saturat|flat|cut off|end of its" if count >= 12 else None
    return Applied("clipped-force", f"{level:.0f} of {top:.0f} kN", word, "judged")


def clipped_stroke(rng: np.random.Generator, s: Scene) -> Applied | None:
    top = float(np.max(s.strokes_mm[0]))
    level = top - s.span_mm * rng.uniform(0.03, 0.2)
    count = int(np.sum(s.strokes_mm[0] > level))
    s.strokes_mm = [np.minimum(x, level) for x in s.strokes_mm]
    word = r"clip|saturat|flat|cut off|end of its" if count >= 12 else None
    return Applied("clipped-stroke", f"{level:.1f} of {top:.1f} mm", word, "judged")


def spikes(rng: np.random.Generator, s: Scene) -> Applied:
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
    return Applied(
        "spikes", f"{which}, {count} samples", r"spike|outlier|single (sample|value)|jump|alone", "judged"
    )


def gain_jump(rng: np.random.Generator, s: Scene) -> Applied:
    at, factor = _inner(rng, s), 1.0 + rng.uniform(0.05, 0.25) * rng.choice([-1.0, 1.0])
    s.force_read_kN = np.where(s.true_time_s >= at, factor * s.force_read_kN, s.force_read_kN)
    return Applied("gain-jump", f"force × {factor:.3f} from {at:.2f} s", STEP, "judged")


def offset_jump(rng: np.random.Generator, s: Scene) -> Applied:
    at, size = _inner(rng, s), s.force_span * rng.uniform(0.05, 0.2) * rng.choice([-1.0, 1.0])
    s.force_read_kN = np.where(s.true_time_s >= at, s.force_read_kN + size, s.force_read_kN)
    return Applied("offset-jump", f"force {size:+.1f} kN from {at:.2f} s", STEP, "judged")


def stroke_slip(rng: np.random.Generator, s: Scene) -> Applied:
    at, size = _inner(rng, s), s.span_mm * rng.uniform(0.04, 0.12) * rng.choice([-1.0, 1.0])
    s.strokes_mm[0] = np.where(s.true_time_s >= at, s.strokes_mm[0] + size, s.strokes_mm[0])
    return Applied("stroke-slip", f"{size:+.2f} mm from {at:.2f} s", STEP, "judged")


def force_late(rng: np.random.Generator, s: Scene) -> Applied:
    late = rng.uniform(0.005, 0.05) * _cycle_s(s) * rng.choice([-1.0, 1.0])
    s.force_read_kN = np.interp(s.time_s - late, s.time_s, s.force_read_kN)
    return Applied("force-late-beyond", f"{late * 1e3:.1f} ms", None, "free")


def zero_off(rng: np.random.Generator, s: Scene) -> Applied | None:
    size = rng.uniform(1.0, 5.0) * rng.choice([-1.0, 1.0])
    s.strokes_mm = [x + size for x in s.strokes_mm]
    starts_free = s.motion.kind == "static" and float(np.min(s.true_stroke())) < -0.15
    word = r"zero|contact" if starts_free else None
    return Applied("zero-off", f"{size:+.2f} mm", word, "judged" if starts_free else "free")


def force_zero_off(rng: np.random.Generator, s: Scene) -> Applied:
    size = rng.uniform(4.0, 20.0) * rng.choice([-1.0, 1.0])
    s.force_read_kN = s.force_read_kN + size
    starts_free = s.motion.kind == "static" and float(np.min(s.true_stroke())) < -0.15
    word = r"force[^;.]*(zero|offset|tare)|kN (at rest|unloaded|without)" if starts_free else None
    return Applied("force-zero-off", f"{size:+.1f} kN", word, "judged" if starts_free else "free")


def _readings_at(s: Scene, wanted: np.ndarray) -> None:
    """Leave readings only in the rows that are wanted (mask)."""
    s.temperatures_C = [np.where(wanted, x, np.nan) for x in s.temperatures_C]


def _every(s: Scene, seconds: float) -> np.ndarray:
    slot = np.floor((s.true_time_s - s.true_time_s[0]) / seconds)
    return np.concatenate([[True], np.diff(slot) > 0])


def sparse_temperature(rng: np.random.Generator, s: Scene) -> Applied | None:
    if not s.temperatures_C:
        return None
    seconds = float(rng.choice([rng.uniform(2.0, 12.0), rng.uniform(20.0, 60.0)]))
    _readings_at(s, _every(s, seconds))
    return Applied("temperature-sparse", f"every {seconds:.1f} s", harmless=seconds < 13.0)


def first_second(rng: np.random.Generator, s: Scene) -> Applied | None:
    if not s.temperatures_C:
        return None
    wanted = np.zeros(len(s.time_s), dtype=bool)
    for c in s.cycles:
        wanted |= (s.true_time_s >= c.start_s - 0.5) & (s.true_time_s <= c.start_s + 0.5)
    _readings_at(s, wanted)
    return Applied("temperature-first-second", "about the start of each cycle")


def temperature_hole(rng: np.random.Generator, s: Scene) -> Applied | None:
    if not s.temperatures_C:
        return None
    long = rng.uniform(5.0, 60.0)
    at = rng.uniform(s.true_time_s[0], s.true_time_s[-1])
    _readings_at(s, (s.true_time_s < at) | (s.true_time_s > at + long))
    return Applied("temperature-hole", f"{long:.0f} s from {at:.0f} s", harmless=long < 10.0)


def _odd_reading(rng: np.random.Generator, s: Scene, value: float, name: str) -> Applied | None:
    if not s.temperatures_C:
        return None
    k = int(rng.integers(len(s.temperatures_C)))
    seconds = float(rng.choice([0.0, rng.uniform(0.5, 4.0)]))
    at = rng.uniform(s.true_time_s[0], max(s.true_time_s[0], s.true_time_s[-1] - seconds))
    rows = (s.true_time_s >= at) & (s.true_time_s <= at + max(seconds, 1.01 * s.dt_s))
    if not np.isfinite(s.temperatures_C[k][rows]).any():
        return None
    s.temperatures_C[k] = np.where(rows & np.isfinite(s.temperatures_C[k]), value, s.temperatures_C[k])
    return Applied(name, f"sensor {k + 1}, {seconds:.1f} s at {at:.1f} s", SENSOR, harmless=seconds < 4.0)


def power_on(rng: np.random.Generator, s: Scene) -> Applied | None:
    return _odd_reading(rng, s, 85.0, "temperature-85")


def disconnected(rng: np.random.Generator, s: Scene) -> Applied | None:
    return _odd_reading(rng, s, -127.0, "temperature-127")


def swapped(rng: np.random.Generator, s: Scene) -> Applied | None:
    if len(s.temperatures_C) < 2:
        return None
    later = s.true_time_s > _inner(rng, s)
    a, b = s.temperatures_C[:2]
    s.temperatures_C[:2] = [np.where(later, b, a), np.where(later, a, b)]
    return Applied("temperature-swapped", "two plugs exchanged", harmless=True)


def no_temperature(rng: np.random.Generator, s: Scene) -> Applied | None:
    if not s.temperatures_C:
        return None
    s.temperatures_C = []
    return Applied("temperature-missing", "no channel", r"temperature" if s.motion.kind == "static" else None)


def lost_single(rng: np.random.Generator, s: Scene) -> Applied:
    n = len(s.time_s)
    count = max(1, round(n * rng.choice([0.0, 0.0005, 0.001])))
    keep = np.ones(n, dtype=bool)
    keep[rng.choice(np.arange(1, n - 1), count, replace=False)] = False
    s.keep(keep)
    return Applied("lost-single", f"{count} of {n} rows", GAP, harmless=True)


def lost_burst(rng: np.random.Generator, s: Scene) -> Applied:
    part = _place(rng, s, _cycle_s(s) * rng.uniform(0.01, 0.25))
    keep = np.ones(len(s.time_s), dtype=bool)
    keep[part] = False
    s.keep(keep)
    return Applied(
        "lost-burst",
        f"{part.stop - part.start} rows at {s.true_time_s[min(part.start, len(s.time_s) - 1)]:.2f} s",
        GAP,
    )


def lost_turn(rng: np.random.Generator, s: Scene) -> Applied | None:
    tops = [c.top_s for c in s.cycles] + [c.end_s for c in s.cycles]
    if not tops:
        return None
    at, long = float(rng.choice(tops)), _cycle_s(s) * rng.uniform(0.005, 0.08)
    keep = np.abs(s.true_time_s - at) > max(long, 1.5 * s.dt_s) / 2
    if keep.all() or at < s.true_time_s[2] or at > s.true_time_s[-3]:
        return None
    lost = int(np.sum(~keep))
    s.keep(keep)
    return Applied("lost-turn", f"{lost} rows about {at:.2f} s", GAP)


def lost_pause(rng: np.random.Generator, s: Scene) -> Applied | None:
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
    s.keep(keep)
    return Applied(
        "lost-pause", f"{long:.2f} s in the pause at {first:.1f} s", harmless=long < 0.5 * shortest
    )


def slower_at_rest(rng: np.random.Generator, s: Scene) -> Applied | None:
    if s.motion.kind != "static":
        return None
    factor = int(rng.choice([5, 10, 50]))
    keep = s.moving() | (np.arange(len(s.time_s)) % factor == 0)
    s.keep(keep)
    return Applied("rate-change", f"1/{factor} of the rate at rest", harmless=True)


def stops_at_rest(rng: np.random.Generator, s: Scene) -> Applied | None:
    if s.motion.kind != "static":
        return None
    s.keep(s.moving())
    return Applied(
        "stops-at-rest", "no rows at rest", harmless=all(b - a < 8.0 for a, b in s.motion.rests[1:-1])
    )


def slower_in_motion(rng: np.random.Generator, s: Scene) -> Applied | None:
    factor = int(rng.choice([2, 5]))
    if _cycle_s(s) / s.dt_s < 60 * factor:
        return None
    at = _inner(rng, s)
    s.keep((s.true_time_s < at) | (np.arange(len(s.time_s)) % factor == 0))
    return Applied("rate-change-moving", f"1/{factor} of the rate from {at:.2f} s", harmless=True)


def few_samples(rng: np.random.Generator, s: Scene) -> Applied | None:
    left = float(np.exp(rng.uniform(np.log(3.0), np.log(70.0))))
    k = int(_cycle_s(s) / s.dt_s / left)
    if k < 2 or len(s.time_s) // k < 6:
        return None
    s.keep(np.arange(len(s.time_s)) % k == 0)
    return Applied("few-samples", f"{left:.0f} a cycle", figures="within" if left > 40.0 else "judged")


def by_event(rng: np.random.Generator, s: Scene) -> Applied:
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
    return Applied(
        "event-log",
        f"{mm:.3f} mm, {kN:.2f} kN, {beat} s",
        harmless=max(mm / s.span_mm, kN / s.force_span) < 0.001,
    )


def no_numbers(rng: np.random.Generator, s: Scene) -> Applied:
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
    return Applied(
        "nan-cells", f"{count} of {n}", r"no value|number|NaN|blank|missing|empty|lost", harmless=True
    )


def no_numbers_burst(rng: np.random.Generator, s: Scene) -> Applied:
    part = _place(rng, s, _cycle_s(s) * rng.uniform(0.01, 0.2))
    s.force_read_kN = s.force_read_kN.copy()
    s.force_read_kN[part] = np.nan
    return Applied(
        "nan-burst",
        f"force, rows {part.start} to {part.stop}",
        r"no value|number|NaN|blank|missing|empty|lost|gap",
    )


def slower_force(rng: np.random.Generator, s: Scene) -> Applied | None:
    k = int(rng.choice([2, 4, 5]))
    if _cycle_s(s) / s.dt_s < 60 * k:
        return None
    s.force_read_kN = np.where(np.arange(len(s.time_s)) % k == 0, s.force_read_kN, np.nan)
    return Applied("blanks", f"force in every {k}th row", harmless=True)


def doubled(rng: np.random.Generator, s: Scene) -> Applied:
    n = len(s.time_s)
    count = max(1, int(n * rng.choice([0.001, 0.02, 1.0])))
    rows = np.sort(np.concatenate([np.arange(n), rng.choice(n, count, replace=False)]))
    s.keep(rows)
    return Applied("doubled", f"{count} of {n} rows", STAMP, harmless=True)


def backward(rng: np.random.Generator, s: Scene) -> Applied:
    n = len(s.time_s)
    count = int(rng.integers(1, 6))
    order = np.arange(n)
    for i in rng.choice(np.arange(2, n - 3), count, replace=False):
        order[i], order[i + 1] = order[i + 1], order[i]
    s.keep(order)
    return Applied("backward", f"{count} pairs of rows exchanged", STAMP, harmless=True)


def clock_back(rng: np.random.Generator, s: Scene) -> Applied:
    at, by = _inner(rng, s), s.dt_s * rng.uniform(2.0, 20.0)
    s.time_s = np.where(s.true_time_s > at, s.time_s - by, s.time_s)
    return Applied("clock-set-back", f"{by:.4f} s at {at:.2f} s", STAMP + "|clock", "judged")


def rounded(rng: np.random.Generator, s: Scene) -> Applied:
    step = float(rng.choice([0.001, 0.01]))
    while step > 4.0 * s.dt_s:
        step /= 10.0
    s.time_s = np.round(s.time_s / step) * step
    return Applied("rounded-stamps", f"{step} s at {s.dt_s:.4f} s", harmless=True)


def jittered(rng: np.random.Generator, s: Scene) -> Applied:
    size = s.dt_s * rng.uniform(0.02, 0.2)
    noise = np.clip(rng.normal(0, size, len(s.time_s)), -0.45 * s.dt_s, 0.45 * s.dt_s)
    s.time_s = s.time_s + noise
    return Applied("jitter", f"{size / s.dt_s:.2f} of a step", harmless=True)


def newtons(rng: np.random.Generator, s: Scene) -> Applied:
    s.factor["force"] = 1000.0
    return Applied("unit-N-as-kN", "force × 1000", UNIT, "judged")


def metres(rng: np.random.Generator, s: Scene) -> Applied:
    s.factor["stroke"] = 0.001
    s.decimals["stroke"] = 7
    return Applied("unit-m-as-mm", "stroke / 1000", UNIT, "judged")


def times_ten(rng: np.random.Generator, s: Scene) -> Applied | None:
    if s.motion.kind != "static":
        return None
    which = str(rng.choice(["force", "stroke"]))
    s.factor[which] = 10.0
    return Applied("times-ten", which, UNIT, "judged")


def sign_force(rng: np.random.Generator, s: Scene) -> Applied:
    s.factor["force"] = -1.0
    one_sided = float(np.min(s.force_kN)) > -0.1 * s.force_span
    return Applied(
        "sign-force", "turned", r"negative|sign" if one_sided else None, "judged" if one_sided else "free"
    )


def sign_stroke(rng: np.random.Generator, s: Scene) -> Applied:
    s.factor["stroke"] = -1.0
    one_sided = float(np.min(s.motion.stroke_mm)) > -0.1 * s.span_mm
    return Applied(
        "sign-stroke", "turned", r"negative|sign" if one_sided else None, "judged" if one_sided else "free"
    )


KINDS: tuple[Kind, ...] = (
    Kind("noise-coloured", 0, "noise", coloured),
    Kind("hum", 0, "hum", hum),
    Kind("drift-within", 0, "drift", drift_within),
    Kind("wire-period", 0, "wire", wire_period),
    Kind("drift-beyond", 0, "drift", drift_beyond),
    Kind("force-late-beyond", 0, "late", force_late),
    Kind("zero-off", 0, "zero", zero_off),
    Kind("force-zero-off", 0, "drift", force_zero_off),
    Kind("gain-jump", 0, "jump", gain_jump),
    Kind("offset-jump", 0, "jump", offset_jump),
    Kind("stroke-slip", 0, "jump", stroke_slip),
    Kind("spikes", 1, "spikes", spikes),
    Kind("clipped-force", 1, "clip", clipped_force),
    Kind("clipped-stroke", 1, "clip", clipped_stroke),
    Kind("quantised", 1, "quantised", quantised),
    Kind("held", 1, "held", held),
    Kind("frozen", 1, "frozen", frozen),
    Kind("temperature-sparse", 2, "temperature", sparse_temperature),
    Kind("temperature-first-second", 2, "temperature", first_second),
    Kind("temperature-hole", 2, "temperature", temperature_hole),
    Kind("temperature-85", 2, "temperature", power_on),
    Kind("temperature-127", 2, "temperature", disconnected),
    Kind("temperature-swapped", 2, "temperature", swapped),
    Kind("temperature-missing", 2, "temperature", no_temperature),
    Kind("lost-single", 3, "lost-single", lost_single),
    Kind("lost-burst", 3, "lost-burst", lost_burst),
    Kind("lost-turn", 3, "lost-turn", lost_turn),
    Kind("lost-pause", 3, "lost-pause", lost_pause),
    Kind("rate-change", 3, "rate", slower_at_rest),
    Kind("few-samples", 3, "rate", few_samples),
    Kind("rate-change-moving", 3, "rate", slower_in_motion),
    Kind("stops-at-rest", 3, "rate", stops_at_rest),
    Kind("event-log", 3, "rate", by_event),
    Kind("nan-cells", 3, "nan", no_numbers),
    Kind("nan-burst", 3, "nan", no_numbers_burst),
    Kind("blanks", 3, "rate", slower_force),
    Kind("doubled", 4, "stamps", doubled),
    Kind("backward", 4, "stamps", backward),
    Kind("clock-set-back", 4, "stamps", clock_back),
    Kind("rounded-stamps", 4, "stamps", rounded),
    Kind("jitter", 4, "stamps", jittered),
    Kind("unit-N-as-kN", 5, "export", newtons),
    Kind("unit-m-as-mm", 5, "export", metres),
    Kind("times-ten", 5, "export", times_ten),
    Kind("sign-force", 5, "export", sign_force),
    Kind("sign-stroke", 5, "export", sign_stroke),
)


def put_in(rng: np.random.Generator, scene: Scene, only: str | None = None) -> None:
    """Put none to four imperfections in, each with a size of its own, in the order in which they arise."""
    if only is not None:
        chosen = [kind for kind in KINDS if kind.name == only]
    else:
        wanted = int(rng.choice([0, 1, 2, 3, 4], p=[0.08, 0.37, 0.3, 0.17, 0.08]))
        chosen = []
        for i in rng.permutation(len(KINDS)):
            kind = KINDS[i]
            if len(chosen) < wanted and all(kind.group != other.group for other in chosen):
                chosen.append(kind)
    for kind in sorted(chosen, key=lambda kind: kind.stage):
        made = kind.make(rng, scene)
        if made is not None:
            scene.applied.append(made)
