"""What really happened: strokes, figures of each cycle and readings of the standard, from the fine grid.

A figure is an interval (lowest, highest): where words leave room (is a creeping dwell part of the stroke?)
either reading is true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .specimens import branches

Array = NDArray[np.float64]
Interval = tuple[float, float]
FORCE_CAP_KN = 1000.0


@dataclass(frozen=True)
class TrueCycle:
    """One stroke and its cycle, numbered as it happened."""

    number: int
    start_s: float  # loading begins
    top_s: float
    leaves_top_s: float
    end_s: float
    whole: bool  # both ends are on the record
    figures: dict[str, Interval]
    readings: dict[str, float | None]  # of the requirements; None: the stroke did not reach there
    dwell_s: float
    residual_mm: float  # stroke before loading
    left_mm: float  # stroke after unloading
    pause_s: float | None  # rest since the stroke before
    temperature_C: Interval  # over the cycle


def find_strokes(x: Array, share: float = 0.08) -> list[tuple[int | None, int, int | None]]:
    """Return (lower, upper, lower) turning points by index; None where the record ends before."""
    ends = branches(x)
    if not ends:
        return []
    threshold = share * float(np.ptp(x))
    points = [0] + [i for i, _ in ends]
    turns = [points[0]]
    for i in points[1:]:  # zigzag: keep extremes that a swing of the threshold confirms
        if len(turns) >= 2 and (x[turns[-1]] - x[turns[-2]]) * (x[i] - x[turns[-1]]) >= 0:
            turns[-1] = i
        elif abs(x[i] - x[turns[-1]]) >= threshold:
            turns.append(i)
    out: list[tuple[int | None, int, int | None]] = []
    for k, i in enumerate(turns):
        before = turns[k - 1] if k else None
        after = turns[k + 1] if k + 1 < len(turns) else None
        is_top = (before is not None and x[i] > x[before]) or (
            before is None and after is not None and x[i] > x[after]
        )
        if is_top:
            out.append((before, i, after))
    return out


def cycles(t: Array, x: Array, force: Array, temperature: Array, *, static: bool) -> list[TrueCycle]:
    """Return the cycles between the record's begin and end."""
    found = find_strokes(x)
    out: list[TrueCycle] = []
    for k, (low, top, after) in enumerate(found):
        edge = 0.0015 * float(np.ptp(x))  # what may lack of a cycle at the ends of the record
        first = 0 if low is None else low
        last = len(x) - 1 if after is None else after
        level = x[top] - 1e-9 * np.ptp(x)
        peak = first + int(np.argmax(x[first : last + 1] >= level))
        i0 = first if low is None else _last_at(x, low, peak)
        j0 = peak + int(np.argmax(x[peak : last + 1] <= np.min(x[peak : last + 1]) + 1e-9 * np.ptp(x)))
        whole = low is not None and after is not None
        if low is not None and low == 0 and x[0] > _least(x, found) + edge:
            whole = False
        if after is not None and after == len(x) - 1 and x[-1] > _least(x, found) + edge:
            whole = False
        leaves = peak + _stays(x[peak : j0 + 1], x[peak] - 2e-4 * np.ptp(x))
        arrives = i0 + int(np.argmax(x[i0 : peak + 1] >= x[peak] - 2e-4 * np.ptp(x)))
        # over one more cycle its end: the lower turn, where the next loading begins
        next_low = j0 if after is None else _last_at(x, j0, found[k + 1][1]) if k + 1 < len(found) else j0
        figures = _figures(t, x, force, i0, peak, j0, arrives, static=static) if whole else {}
        if whole and not static:
            figures |= _harmonics(t, x, force, i0, next_low)
        span = slice(i0, max(j0, i0 + 1) + 1)
        figures["temperature_start_C"] = (float(temperature[i0]),) * 2
        figures["temperature_max_C"] = (float(np.max(temperature[span])),) * 2
        out.append(
            TrueCycle(
                number=k + 1,
                start_s=float(t[i0]),
                top_s=float(t[peak]),
                leaves_top_s=float(t[leaves]),
                end_s=float(t[j0]),
                whole=whole,
                figures=figures,
                readings=readings(x, force, i0, peak, j0) if static and low is not None else {},
                dwell_s=float(t[leaves] - t[arrives]),
                residual_mm=float(x[i0]),
                left_mm=float(x[j0]),
                pause_s=float(t[i0]) - out[-1].end_s if out else None,
                temperature_C=(float(np.min(temperature[span])), float(np.max(temperature[span]))),
            )
        )
    return out


def _least(x: Array, found: list[tuple[int | None, int, int | None]]) -> float:
    inner = [x[after] for _, _, after in found[:-1] if after is not None]
    return float(np.median(inner)) if inner else float(np.min(x))


def _last_at(x: Array, low: int, top: int) -> int:
    piece = x[low : top + 1]
    lowest = np.flatnonzero(piece <= piece.min() + 1e-9 * (piece.max() - piece.min() + 1e-12))
    at = low + int(lowest[-1])
    # a rest above a short dip (overshoot) is where loading begins
    rest = (np.abs(np.diff(x[at : top + 1])) < 1e-9) & (x[at:top] < x[at] + 0.1 * np.ptp(piece))
    return at + int(np.flatnonzero(rest)[-1]) + 1 if rest.any() else at


def _stays(x: Array, level: float) -> int:
    below = x < level
    return int(np.argmax(below)) if below.any() else len(x) - 1


def area(x: Array, force: Array) -> float:
    """Return the integral of force over stroke, kN mm = J."""
    return float(np.trapezoid(force, x))


def _figures(
    t: Array, x: Array, force: Array, i0: int, top: int, j0: int, arrives: int, *, static: bool
) -> dict[str, Interval]:
    up, down = slice(i0, top + 1), slice(top, j0 + 1)
    stored = area(x[up], force[up])
    closing = 0.5 * (force[j0] + force[i0]) * (x[i0] - x[j0])
    absorbed = stored + area(x[down], force[down]) + closing
    lows = sorted((float(x[i0]), float(x[j0]), float(np.min(x[i0 : j0 + 1]))))
    low: Interval = (lows[0], lows[-1])
    high: Interval = (float(x[top]),) * 2
    tops = sorted((float(force[top]), float(force[arrives])))
    starts = [float(force[i0])]
    if (
        static and -0.2 < x[i0] < 0.2
    ):  # at rest in the very contact: the force is anything up to the preload's
        starts.append(float(np.max(force[i0 : i0 + int(np.argmax(x[up] > x[i0] + 0.5)) + 1])))
    spans = (float(x[top]) - low[1], float(x[top]) - low[0])
    secants = [(f - f_0) / s for f in tops for f_0 in starts for s in spans]
    way = float(x[top] - x[i0])
    mean = 0.5 * (x[top] + x[i0])
    near = np.abs(x[up] - mean) < 0.01 * way
    slope = float(np.polyfit(x[up][near] - mean, force[up][near], 1)[0])
    out: dict[str, Interval] = {
        "stored_energy_J": (stored,) * 2,
        "absorbed_energy_J": (absorbed,) * 2,
        "damping": (absorbed / stored,) * 2,
        "tangent_stiffness_kN_per_mm": (slope,) * 2,
        "secant_stiffness_kN_per_mm": (min(secants), max(secants)),
        "stroke_min_mm": low,
        "stroke_max_mm": high,
        "prestress_mm": (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[0])),
        "amplitude_mm": (0.5 * (high[0] - low[1]), 0.5 * (high[0] - low[0])),
        "force_max_kN": (float(np.max(force[i0 : j0 + 1])),) * 2,
        "force_min_kN": (
            float(np.min(force[i0 : j0 + 1])),
            max(starts[-1], float(np.min(force[i0 : j0 + 1]))),
        ),
    }
    for name, part in (("loading", up), ("unloading", down)):
        count = part.stop - part.start
        v = np.abs(np.diff(x[part])) / np.diff(t[part])
        w = max(1, count // 20)
        level = np.abs(x[part][w:] - x[part][:-w]) / (t[part][w:] - t[part][:-w])
        out[f"speed_{name}_max_mm_per_s"] = (float(np.max(level)), float(np.max(v)))
    return out


def _harmonics(t: Array, x: Array, force: Array, i0: int, i1: int) -> dict[str, Interval]:
    """First harmonics over the period from one lower turn to the next.

    Of a force that still settles they depend on whether its drift is taken out first: either reading is true.
    """
    period = float(t[i1] - t[i0])
    tt = t[i0 : i1 + 1] - t[i0]
    turn = np.exp(-2j * np.pi * tt / period)

    def first(y: Array, drift: float) -> complex:
        level = y - y[0] - drift * (y[-1] - y[0]) * tt / period
        return complex(2.0 / period * np.trapezoid(level * turn, tt))

    x_f = (x[i0 : i1 + 1], force[i0 : i1 + 1])
    both = [first(x_f[1], drift) / first(x_f[0], drift) for drift in (0.0, 1.0)]
    values = {
        "frequency_Hz": [1.0 / period],
        "dynamic_stiffness_kN_per_mm": [abs(k) for k in both],
        "storage_stiffness_kN_per_mm": [k.real for k in both],
        "loss_stiffness_kN_per_mm": [k.imag for k in both],
        "loss_factor": [k.imag / k.real for k in both],
    }
    return {name: (min(value), max(value)) for name, value in values.items()}


def readings(x: Array, force: Array, i0: int, top: int, j0: int) -> dict[str, float | None]:
    """Return what the requirements of the 105 mm static test are judged by."""
    up_x, up_f = x[i0 : top + 1], force[i0 : top + 1]
    keep = np.concatenate([[True], np.diff(np.maximum.accumulate(up_x)) > 0])
    line_x = np.linspace(2.0, 10.0, 401)
    line = np.polyfit(line_x, np.interp(line_x, up_x[keep], up_f[keep]), 1)
    out: dict[str, float | None] = {"preload": float(line[1])}
    for place in (25.0, 60.0, 100.0):
        reached = up_x[-1] >= place
        out[f"force-at-{place:.0f}mm"] = float(np.interp(place, up_x[keep], up_f[keep])) if reached else None
    over = np.flatnonzero(up_f > FORCE_CAP_KN)
    cut = up_x[-1] if not len(over) else float(up_x[over[0]])
    inside = up_x <= cut
    stored = area(up_x[inside], up_f[inside])
    down_x, down_f = x[top : j0 + 1], force[top : j0 + 1]
    below = down_x <= cut
    absorbed = stored + area(down_x[below], down_f[below])
    out["stored-energy"] = stored
    out["absorbed-energy-ratio"] = absorbed / stored
    return out
