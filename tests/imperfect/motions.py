"""Motions as a servo-hydraulic stand makes them: what was asked for, rounded, late, short, overshooting."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

Array = NDArray[np.float64]
REST_KEPT_S = 8.0  # of a long rest so much is on the fine grid; the remainder is a few long steps
OVERSAMPLED = 20


@dataclass(frozen=True)
class Motion:
    """A true motion on a fine grid, and how it was meant."""

    time_s: Array
    stroke_mm: Array
    sample_rate_Hz: float
    kind: str  # static, harmonic
    shape: str
    steps: tuple[tuple[float, float], ...]  # spans of the harmonic steps
    rests: tuple[tuple[float, float], ...]  # spans in which the stand rests
    begin_s: float  # what the logger saw of it
    end_s: float
    facts: dict[str, float] = field(default_factory=dict)


def servo(rng: np.random.Generator, command: Array, dt_s: float, reversal_s: float) -> Array:
    """Return what the stand makes of a command: reversals that take time, lag, overshoot."""
    width = round(reversal_s / dt_s)
    x = uniform_filter1d(command, width, mode="nearest") if width > 1 else command.copy()
    way = str(rng.choice(["stiff", "lag", "overshoot"], p=[0.5, 0.35, 0.15]))
    if way == "lag":
        a = float(np.exp(-dt_s / (rng.uniform(0.1, 1.0) * reversal_s + 1e-3)))
        x = _filtered([1.0 - a], [1.0, -a], x)
    elif way == "overshoot":
        w, zeta = 2.0 * np.pi * rng.uniform(8.0, 25.0), rng.uniform(0.45, 0.8)
        r, th = np.exp(-zeta * w * dt_s), w * np.sqrt(1.0 - zeta**2) * dt_s
        den = [1.0, -2.0 * r * np.cos(th), r * r]
        x = _filtered([sum(den)], den, x)
    return x


def _filtered(b: list[float], a: list[float], x: Array) -> Array:
    y: Array = lfilter(b, a, x - x[0])  # starts at rest
    return y + x[0]


def static(rng: np.random.Generator) -> Motion:
    """Draw a static test: mostly three strokes as the standard has them, some that break a condition."""
    strokes = int(rng.choice([2, 3, 4, 5], p=[0.06, 0.7, 0.14, 0.1]))
    ways = ["none", "speed", "dwell", "pause", "residual", "warm"]
    broken = str(rng.choice(ways, p=[0.77, 0.05, 0.05, 0.05, 0.05, 0.03]))
    bad = int(rng.integers(strokes))  # the stroke that breaks it
    if broken == "warm":  # a single stroke more, of the specimen that was warmed on purpose
        bad = strokes
        strokes += 1
    warm_from_s = np.inf
    top = rng.uniform(101.5, 105.0) if rng.random() < 0.82 else rng.uniform(75.0, 97.0)
    low = rng.uniform(-3.0, -0.2) if rng.random() < 0.6 else 0.0
    speed = float(np.exp(rng.uniform(np.log(4.0), np.log(44.0))))
    back = min(46.0, speed * rng.uniform(0.7, 1.3))
    lead, tail = rng.uniform(0.5, 5.0), rng.uniform(0.5, 5.0)
    reversal_s = float(np.exp(rng.uniform(np.log(0.005), np.log(0.2))))
    dwell = rng.uniform(0.0, 0.3) if rng.random() < 0.4 else 0.0
    t, x = [0.0, lead], [low, low]
    rests, longs = [(0.0, lead)], []
    for i in range(strokes):
        v = rng.uniform(56.0, 90.0) if broken == "speed" and i == bad else speed
        hold = rng.uniform(1.6, 4.0) if broken == "dwell" and i == bad else dwell
        peak = top + rng.uniform(-0.3, 0.3)
        rest = tail if i == strokes - 1 else rng.uniform(2.0, 40.0)
        if broken == "pause" and i == bad and i < strokes - 1:
            rest = rng.uniform(640.0, 900.0)
        if broken == "warm" and i == bad:
            warm_from_s = 0.5 * (t[-2] + t[-1])  # in the pause: what it begins with is on its thermometer
        ending = rng.uniform(3.1, 3.5) if broken == "residual" and i == bad and i < strokes - 1 else low
        for after, where in (
            (abs(peak - x[-1]) / v, peak),
            (hold, peak),
            (abs(peak - ending) / back, ending),
        ):
            if after:
                t.append(t[-1] + after)
                x.append(where)
        if rest > REST_KEPT_S:
            longs.append((t[-1] + REST_KEPT_S - 1.0, rest - REST_KEPT_S))
        rests.append((t[-1], t[-1] + min(rest, REST_KEPT_S)))
        t.append(t[-1] + min(rest, REST_KEPT_S))
        x.append(ending)
    whole = t[-1] + sum(more for _, more in longs)
    rate = float(np.clip(np.exp(rng.uniform(np.log(2000.0), np.log(12000.0))) / t[-1], 12.0, 1000.0))
    dt = 1.0 / (rate * max(OVERSAMPLED, int(np.ceil(500.0 / rate))))
    grid = np.arange(0.0, t[-1], dt)
    stroke = servo(rng, np.interp(grid, t, x), dt, reversal_s)
    real = grid + sum((np.where(grid > at, more, 0.0) for at, more in longs), np.zeros_like(grid))
    shifted = [(float(np.interp(a, grid, real)), float(np.interp(b, grid, real))) for a, b in rests]
    begin, end = _seen(rng, 0.0, whole, lead, tail, 0.5 * (t[2] - t[1]), min(2.0, 0.05 * back))
    if rng.random() < 0.04:  # it was started while the first stroke falls
        begin = lead + abs(x[2] - x[1]) / speed + dwell + rng.uniform(0.1, 0.8) * (top - low) / back
        end = max(end, begin + 1.0)
    facts = {"strokes": strokes, "speed_mm_per_s": speed, "reversal_s": reversal_s, "dwell_s": dwell}
    facts["warm_from_s"] = float(np.interp(warm_from_s, grid, real)) if broken == "warm" else np.inf
    return Motion(real, stroke, rate, "static", broken, (), tuple(shifted), begin, end, facts)


def _seen(
    rng: np.random.Generator, first: float, last: float, lead: float, tail: float, into: float, late: float
) -> tuple[float, float]:
    begins = str(rng.choice(["rest", "motion", "within"], p=[0.7, 0.2, 0.1]))
    begin = {"rest": first, "motion": first + lead, "within": first + lead + rng.uniform(0.1, 0.9) * into}[
        begins
    ]
    end = last if rng.random() < 0.75 else last - tail + late
    if rng.random() < 0.04:  # it was stopped too early
        end = rng.uniform(begin + 0.1 * (end - begin), end)
    return begin, end


def single(
    rng: np.random.Generator, kind: str, top_mm: float, up_s: float, hold_s: float, down_s: float
) -> Motion:
    """Return one event: an impact, or a proof load that is held."""
    lead, tail = rng.uniform(0.3, 1.5), rng.uniform(1.5, 4.0)
    t = np.cumsum([0.0, lead, up_s, hold_s, down_s, tail])
    rate = min(10_000.0, 12_000.0 / t[-1])
    dt = 1.0 / (rate * OVERSAMPLED)
    grid = np.arange(0.0, t[-1], dt)
    if kind == "impact":  # a quarter wave into the buffer, a slower one out of it
        way_in = np.sin(0.5 * np.pi * np.clip((grid - t[1]) / up_s, 0.0, 1.0))
        way_out = np.cos(0.5 * np.pi * np.clip((grid - t[3]) / down_s, 0.0, 1.0))
        stroke = top_mm * np.where(grid < t[2], way_in, way_out)
    else:
        stroke = servo(rng, np.interp(grid, t, [0.0, 0.0, top_mm, top_mm, 0.0, 0.0]), dt, 0.05)
    rests = ((0.0, float(t[1])), (float(t[4]), float(t[5])))
    facts = {"strokes": 1.0, "top_mm": top_mm, "up_s": up_s}
    return Motion(grid, stroke, rate, kind, "single", (), rests, 0.0, float(grid[-1]), facts)


def harmonic(rng: np.random.Generator, *, two_sided: bool, several: bool) -> Motion:  # noqa: PLR0915
    """Draw a harmonic run of one or several steps."""
    count = int(rng.integers(2, 5)) if several else 1
    shape = str(rng.choice(["sine", "triangle", "trapezoid"], p=[0.75, 0.15, 0.1]))
    f0 = float(np.exp(rng.uniform(np.log(0.1), np.log(2.5))))
    middle = 0.0 if two_sided else rng.uniform(18.0, 75.0)
    most = 40.0 if two_sided else min(middle - 1.0, 100.0 - middle, 30.0)
    plans = []
    f, a = f0, rng.uniform(4.0, most)
    what = str(rng.choice(["amplitude", "frequency", "prestress"])) if several else "none"
    for i in range(count):
        m = middle
        if i and what == "amplitude":
            a = float(np.clip(a * rng.choice([0.5, 0.7, 1.4, 2.0]), 3.0, most))
        elif i and what == "frequency":
            f = float(np.clip(f * rng.choice([0.5, 2.0]), 0.05, 2.6))
        elif i and not two_sided:
            m = float(np.clip(middle + rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0), a + 1.0, 99.0 - a))
        plans.append((m, a, f, int(rng.integers(5, 12))))
    slowest, cycles_s = min(p[2] for p in plans), sum(p[3] / p[2] for p in plans)
    per_cycle = float(np.exp(rng.uniform(np.log(80.0), np.log(1500.0))))
    rate = min(per_cycle * slowest, 12000.0 / (cycles_s + 8.0))
    rate = max(rate, 60.0 * max(p[2] for p in plans))
    dt = 1.0 / (rate * max(OVERSAMPLED, int(np.ceil(500.0 / rate))))
    pieces, now, spans, rests = [], 0.0, [], []
    at = 0.0 if two_sided else float(rng.uniform(-1.0, 0.0))

    def add(values: Array) -> None:
        nonlocal now
        pieces.append(values)
        now += len(values) * dt

    lead = rng.uniform(0.5, 2.0)
    add(np.full(int(lead / dt), at))
    for m, a, f, n in plans:
        if abs(m - at) > 1e-9:
            add(np.linspace(at, m, int(max(0.5, abs(m - at) / rng.uniform(5.0, 40.0)) / dt)))
        start = now
        add(np.full(int(rng.uniform(0.3, 2.0) / dt), m))
        rests.append((start, now))
        start = now
        phase = np.arange(round(n / f / dt)) * dt * f
        add(m + a * _wave(shape, phase))
        spans.append((start, now))
        at = m
    tail = rng.uniform(0.3, 1.5)
    start = now
    add(np.full(int(tail / dt), at))
    rests.append((start, now))
    command = np.concatenate(pieces)
    fastest = max(p[2] for p in plans)
    reversal_s = float(np.exp(rng.uniform(np.log(0.005), np.log(min(0.2, 0.25 / fastest)))))
    stroke = servo(rng, command, dt, reversal_s)
    if rng.random() < 0.3:  # the logger was started and stopped while it ran
        period = 1.0 / plans[0][2]
        begin = spans[0][0] + rng.uniform(0.0, 1.0) * period
        end = spans[-1][1] - rng.uniform(0.0, 1.0) / plans[-1][2]
    else:
        begin, end = 0.0, len(command) * dt
    grid = np.arange(len(command)) * dt
    facts = {"reversal_s": reversal_s, "steps": count, "frequency_Hz": f0}
    return Motion(
        grid, stroke, rate, "harmonic", shape, tuple(spans), tuple(rests), begin, min(end, grid[-1]), facts
    )


def _wave(shape: str, phase: Array) -> Array:
    if shape == "sine":
        return np.sin(2.0 * np.pi * phase)
    if shape == "triangle":
        return np.interp(phase % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    return np.interp(phase % 1.0, [0.0, 0.2, 0.3, 0.7, 0.8, 1.0], [0.0, 1.0, 1.0, -1.0, -1.0, 0.0])
