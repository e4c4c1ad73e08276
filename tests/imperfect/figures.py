"""Figures of a true cycle, and what the requirements of the static test are judged by, on the fine grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]
FORCE_CAP_KN = 1000.0
OPEN = 0.005  # a loop whose lower ends differ by more than this share of its range is open


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

    def starting_forces(self, *, static: bool) -> list[float]:
        """Force where loading begins; at rest in the very contact it is anything up to the preload's."""
        out = [float(self.force[self.low])]
        if static and -0.2 < self.x[self.low] < 0.2:
            free = int(np.argmax(self.x[self.up] > self.x[self.low] + 0.5))
            out.append(float(np.max(self.force[self.low : self.low + free + 1])))
        return out

    def closings(self, *, static: bool) -> list[float]:
        """What closes the loop: a chord; where the lower ends differ, nothing or either end's force, too."""
        gap = float(self.x[self.low] - self.x[self.end])
        ends = float(self.force[self.end])
        chords = [0.5 * (ends + start) * gap for start in self.starting_forces(static=static)]
        if abs(gap) > OPEN * float(self.x[self.top] - self.x[self.low]):
            chords += [0.0, ends * gap]
        return chords


def area(x: Array, force: Array) -> float:
    """Return the integral of force over stroke, kN mm = J."""
    return float(np.trapezoid(force, x))


def loop_figures(cut: Cut, *, static: bool) -> dict[str, Interval]:
    """Return the figures of a loop."""
    t, x, force, i0, top, j0, up, down = (
        cut.t,
        cut.x,
        cut.force,
        cut.low,
        cut.top,
        cut.end,
        cut.up,
        cut.down,
    )
    stored = area(x[up], force[up])
    around = stored + area(x[down], force[down])
    absorbed = sorted(around + closing for closing in cut.closings(static=static))
    lows = sorted((float(x[i0]), float(x[j0]), float(np.min(x[i0 : j0 + 1]))))
    low: Interval = (lows[0], lows[-1])
    levels = sorted((cut.level_mm(), float(x[top])))
    high: Interval = (levels[0], levels[1])
    tops = sorted((float(force[top]), float(force[cut.arrives])))
    starts = cut.starting_forces(static=static)
    spans = (float(x[top]) - low[1], float(x[top]) - low[0])
    secants = [(f - f_0) / s for f in tops for f_0 in starts for s in spans]
    way = float(x[top] - x[i0])
    mean = 0.5 * (x[top] + x[i0])
    near = np.abs(x[up] - mean) < 0.01 * way
    slope = float(np.polyfit(x[up][near] - mean, force[up][near], 1)[0])
    out: dict[str, Interval] = {
        "stored_energy_J": (stored,) * 2,
        "absorbed_energy_J": (absorbed[0], absorbed[-1]),
        "damping": (absorbed[0] / stored, absorbed[-1] / stored),
        "tangent_stiffness_kN_per_mm": (slope,) * 2,
        "secant_stiffness_kN_per_mm": (min(secants), max(secants)),
        "stroke_min_mm": low,
        "stroke_max_mm": high,
        "prestress_mm": (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])),
        "amplitude_mm": (0.5 * (high[0] - low[1]), 0.5 * (high[1] - low[0])),
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


def harmonics(t: Array, x: Array, force: Array, i0: int, i1: int) -> dict[str, Interval]:
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


def readings(cut: Cut) -> dict[str, float | None]:
    """Return what the requirements of the 105 mm static test are judged by."""
    up_x, up_f = cut.x[cut.up], cut.force[cut.up]
    keep = np.concatenate([[True], np.diff(np.maximum.accumulate(up_x)) > 0])
    line_x = np.linspace(2.0, 10.0, 401)
    line = np.polyfit(line_x, np.interp(line_x, up_x[keep], up_f[keep]), 1)
    out: dict[str, float | None] = {"preload": float(line[1])}
    for place in (25.0, 60.0, 100.0):
        reached = up_x[-1] >= place
        out[f"force-at-{place:.0f}mm"] = float(np.interp(place, up_x[keep], up_f[keep])) if reached else None
    over = np.flatnonzero(up_f > FORCE_CAP_KN)
    last = up_x[-1] if not len(over) else float(up_x[over[0]])
    inside = up_x <= last
    stored = area(up_x[inside], up_f[inside])
    down_x, down_f = cut.x[cut.down], cut.force[cut.down]
    below = down_x <= last
    absorbed = stored + area(down_x[below], down_f[below])
    out["stored-energy"] = stored
    out["absorbed-energy-ratio"] = absorbed / stored
    return out
