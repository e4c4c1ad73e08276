"""Figures of a true cycle, and what the requirements of the static test are judged by, on the fine grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]
FORCE_CAP_KN = 1000.0
DWELLS_S = 0.1  # from here on a turn is a rest whose level, and whose end, are two readings of its top


@dataclass(frozen=True)
class Cut:
    """A cycle on the fine grid, by indices: loading from `low` to `top`, unloading to `end`."""

    t: Array
    x: Array
    force: Array
    low: int
    top: int
    end: int
    arrives: int  # the stroke comes within 2e-4 of the record's range of its top

    @property
    def up(self) -> slice:
        return slice(self.low, self.top + 1)

    @property
    def down(self) -> slice:
        return slice(self.top, self.end + 1)

    def dwell_s(self) -> float:
        """Time at the top beyond what passing through takes: a band is passed in half the time of two."""
        band = 0.003 * float(self.x[self.top] - self.x[self.low])
        return max(0.0, 2.0 * self._within(band) - self._within(2.0 * band))

    def _within(self, band: float) -> float:
        above = np.flatnonzero(self.x[self.low : self.end + 1] >= self.x[self.top] - band) + self.low
        return float(self.t[above[-1]] - self.t[above[0]])

    def level_mm(self) -> float:
        """Stroke at which it dwells; its top where it does not."""
        if self.dwell_s() < 0.1:
            return float(self.x[self.top])
        near = self.x[self.top] - 0.003 * float(self.x[self.top] - self.x[self.low])
        part = self.x[self.low : self.end + 1]
        return float(np.median(part[part >= near]))

    def closing(self) -> float:
        """Return what a chord between its lower ends adds to the loop's area (evaluation/figures.md: W_a)."""
        gap = float(self.x[self.low] - self.x[self.end])
        return 0.5 * float(self.force[self.end] + self.force[self.low]) * gap


def area(x: Array, force: Array) -> float:
    """Return the integral of force over stroke, kN mm = J."""
    return float(np.trapezoid(force, x))


def loop_figures(cut: Cut) -> dict[str, Interval]:
    """Return the figures of a loop.

    They are as docs/evaluation/figures.md defines them: the lower turning point is where the loading
    begins, the force there is that with which a rest is left, an open loop is closed by a chord. Two readings
    are left only at a dwell: its level or, where it creeps, its end.
    """
    x, force, i0, top, j0, up, down = cut.x, cut.force, cut.low, cut.top, cut.end, cut.up, cut.down
    stored = area(x[up], force[up])
    absorbed = stored + area(x[down], force[down]) + cut.closing()
    low = float(x[i0])
    dwells = cut.dwell_s() >= DWELLS_S
    high = sorted((cut.level_mm(), float(x[top])))
    tops = [float(force[top]), float(force[cut.arrives])] if dwells else [float(force[top])]
    secants = [(f - float(force[i0])) / (x_top - low) for f in tops for x_top in high]
    way = float(x[top]) - low
    mean = 0.5 * (float(x[top]) + low)
    near = np.abs(x[up] - mean) < 0.01 * way
    slope = float(np.polyfit(x[up][near] - mean, force[up][near], 1)[0])
    out: dict[str, Interval] = {
        "stored_energy_J": (stored,) * 2,
        "absorbed_energy_J": (absorbed,) * 2,
        "damping": (absorbed / stored,) * 2,
        "tangent_stiffness_kN_per_mm": (slope,) * 2,
        "secant_stiffness_kN_per_mm": (min(secants), max(secants)),
        "stroke_min_mm": (low,) * 2,
        "stroke_max_mm": (high[0], high[1]),
        "prestress_mm": (0.5 * (low + high[0]), 0.5 * (low + high[1])),
        "amplitude_mm": (0.5 * (high[0] - low), 0.5 * (high[1] - low)),
        "force_max_kN": (float(np.max(force[i0 : j0 + 1])),) * 2,
        "force_min_kN": (float(np.min(force[i0 : j0 + 1])),) * 2,
    }
    for name, part in (("loading", up), ("unloading", down)):
        out[f"speed_{name}_max_mm_per_s"] = fastest(cut.t[part], x[part])
    return out


def fastest(t: Array, x: Array) -> Interval:
    """Return the largest speed of a branch: over 5 % of it (evaluation/figures.md), and of any two points."""
    if len(t) < 3:
        return (0.0, 0.0)
    w = max(1, len(t) // 20)
    level = np.abs(x[w:] - x[:-w]) / (t[w:] - t[:-w])
    return (float(np.max(level)), float(np.max(np.abs(np.diff(x)) / np.diff(t))))


def harmonics(t: Array, x: Array, force: Array, i0: int, i1: int) -> dict[str, Interval]:
    """First harmonics over the period from one lower turn to the next, as Fourier has them.

    evaluation/figures.md fits ten harmonics over the fitted period; a drift of the force is not taken out
    first.
    """
    period = float(t[i1] - t[i0])
    turns_s = [turn_s(t, x, i) for i in (i0, i1)]
    tt = t[i0 : i1 + 1] - t[i0]
    turn = np.exp(-2j * np.pi * tt / period)
    first = [np.trapezoid((y - y[0]) * turn, tt) for y in (x[i0 : i1 + 1], force[i0 : i1 + 1])]
    k = complex(first[1] / first[0])
    values = {
        "frequency_Hz": 1.0 / (turns_s[1] - turns_s[0]),
        "dynamic_stiffness_kN_per_mm": abs(k),
        "storage_stiffness_kN_per_mm": k.real,
        "loss_stiffness_kN_per_mm": k.imag,
        "loss_factor": k.imag / k.real,
    }
    return {name: (value, value) for name, value in values.items()}


def turn_s(t: Array, x: Array, i: int) -> float:
    """Return when the stroke is lowest between the points of the grid about its lowest one, by a parabola.

    The grid's own point is up to half a step away, which is 5e-4 of a short period: five times what a
    laboratory's clock is known to. Beside a rest, or at an end of the grid, the point itself counts.
    """
    if not 0 < i < len(x) - 1:
        return float(t[i])
    before, after = float(x[i - 1] - x[i]), float(x[i + 1] - x[i])
    if min(before, after) < 1e-6 * max(before, after):
        return float(t[i])
    return float(t[i]) + 0.25 * float(t[i + 1] - t[i - 1]) * (before - after) / (before + after)


def readings(cut: Cut) -> dict[str, Interval | None]:
    """Return what the requirements of the 105 mm static test are judged by; None: the stroke ends before.

    Two readings are left where evaluation/requirements.md leaves them: whether the line of the preload weighs
    equal strokes or equal times (samples).
    """
    up_x, up_f, up_t = cut.x[cut.up], cut.force[cut.up], cut.t[cut.up]
    keep = np.concatenate([[True], np.diff(np.maximum.accumulate(up_x)) > 0])
    line_x = np.linspace(2.0, 10.0, 401)
    strokes = np.polyfit(line_x, np.interp(line_x, up_x[keep], up_f[keep]), 1)[1]
    inside = (up_x >= 2.0) & (up_x <= 10.0)
    at = np.linspace(up_t[inside][0], up_t[inside][-1], 401) if inside.any() else line_x
    samples = (
        np.polyfit(np.interp(at, up_t, up_x), np.interp(at, up_t, up_f), 1)[1] if inside.any() else strokes
    )
    out: dict[str, Interval | None] = {
        "preload": (float(min(strokes, samples)), float(max(strokes, samples)))
    }
    for place in (25.0, 60.0, 100.0):
        reached = up_x[-1] >= place
        force = float(np.interp(place, up_x[keep], up_f[keep]))
        out[f"force-at-{place:.0f}mm"] = (force, force) if reached else None
    over = np.flatnonzero(up_f > FORCE_CAP_KN)
    last = up_x[-1] if not len(over) else float(up_x[over[0]])
    inside = up_x <= last
    stored = area(up_x[inside], up_f[inside])
    down_x, down_f = cut.x[cut.down], cut.force[cut.down]
    below = down_x <= last
    absorbed = stored + area(down_x[below], down_f[below]) + cut.closing()
    out["stored-energy"] = (stored, stored)
    out["absorbed-energy-ratio"] = (absorbed / stored,) * 2 if stored > 0.0 else None
    return out
