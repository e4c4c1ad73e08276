"""Force laws of specimens, of our own making: nothing of `model/` is used.

A spring lies between a loading and an unloading envelope. After a reversal at x_r it leaves the state z_r
(+1 loading envelope, -1 unloading envelope) by a power law of the way since then,
z = z_r + (±1 - z_r) (1 - (1 + s/(m l))^-m), s = |x - x_r|. Two Maxwell branches ride on the middle curve,
the first strokes are stiffer, warmth softens. Below x = 0 there is no contact and no force.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spring:
    """A buffer's spring; forces in kN, strokes in mm."""

    system: str
    preload_kN: float
    linear_kN_per_mm: float
    power_kN: float  # of the progressive part, at 100 mm
    power: float
    stage_kN_per_mm: float  # what a second stage adds beyond stage_mm
    stage_mm: float
    stage_width_mm: float
    loss_0: float  # (loading - unloading envelope) / loading envelope, at 0 and at 100 mm
    loss_100: float
    transition_mm: float
    transition_power: float
    seating_mm: float
    rate_shares: tuple[float, float]
    rate_times_s: tuple[float, float]
    softening: float
    softening_path_mm: float
    softening_per_K: float

    def envelope(self, stroke_mm: Array) -> Array:
        """Loading envelope."""
        x = np.clip(stroke_mm, 0.0, None)
        stage = np.logaddexp(0.0, (x - self.stage_mm) / self.stage_width_mm) * self.stage_width_mm
        return (
            self.preload_kN
            + self.linear_kN_per_mm * x
            + self.power_kN * (x / 100.0) ** self.power
            + self.stage_kN_per_mm * stage
        )

    def force(self, time_s: Array, stroke_mm: Array, temperature_C: Array) -> Array:
        """Force over a motion given finely enough that it is straight between two points."""
        upper = self.envelope(stroke_mm)
        loss = self.loss_0 + (self.loss_100 - self.loss_0) * np.clip(stroke_mm, 0.0, None) / 100.0
        middle = upper * (1.0 - loss / 2.0)
        seat = np.clip(stroke_mm / self.seating_mm, 0.0, 1.0)
        seat = seat * seat * (3.0 - 2.0 * seat)
        force = middle + upper * loss / 2.0 * self._band(stroke_mm)
        driven = middle * seat
        step = np.diff(time_s, prepend=time_s[0])
        for share, tau_s in zip(self.rate_shares, self.rate_times_s, strict=True):
            force = force + share * high_pass(driven, step, tau_s)
        path_mm = np.cumsum(np.abs(np.diff(stroke_mm, prepend=stroke_mm[0])))
        force = force * (1.0 + self.softening * np.exp(-path_mm / self.softening_path_mm))
        force = force * (1.0 - self.softening_per_K * (temperature_C - 20.0))
        return np.clip(force, 0.0, None) * seat

    def _band(self, x: Array) -> Array:
        z = np.empty_like(x)
        state, start = -1.0, 0
        for end, direction in branches(x):
            s = np.abs(x[start : end + 1] - x[start]) / (self.transition_power * self.transition_mm)
            z[start : end + 1] = state + (direction - state) * (1.0 - (1.0 + s) ** -self.transition_power)
            state, start = float(z[end]), end
        z[start:] = state
        return z


@dataclass(frozen=True)
class Damper:
    """A two-sided damper: F = c v|v|^(a-1) + k x, kN, mm, mm/s."""

    system: str
    viscous_kN: float  # at 100 mm/s
    power: float
    linear_kN_per_mm: float

    def force(self, time_s: Array, stroke_mm: Array, temperature_C: Array) -> Array:  # noqa: ARG002
        """Force over a motion on a uniform time grid."""
        speed = np.gradient(stroke_mm, time_s) / 100.0
        smooth = speed * (speed * speed + 1e-6) ** ((self.power - 1.0) / 2.0)
        return self.viscous_kN * smooth + self.linear_kN_per_mm * stroke_mm


def high_pass(driven: Array, step_s: Array, tau_s: float) -> Array:
    """Return what a Maxwell branch of unit share carries, q' = u' - q/tau, exact for straight pieces.

    Uniform steps take the recursive filter; where single longer steps lie between (rests), each piece apart.
    """
    usual = float(np.median(step_s[1:]))
    gain = np.diff(driven, prepend=driven[0])
    q = np.empty_like(driven)
    edges = [0, *np.flatnonzero(np.abs(step_s[1:] - usual) > 1e-9 * usual + 1e-12) + 1, len(driven)]
    a = float(np.exp(-usual / tau_s))
    b = tau_s / usual * (1.0 - a)
    state = 0.0
    for first, last in pairwise(edges):
        if last <= first:
            continue
        if first:  # a long step: the stroke rests
            state = state * float(np.exp(-step_s[first] / tau_s)) + float(gain[first])
        q[first] = state
        if last > first + 1:
            q[first + 1 : last] = lfilter([b], [1.0, -a], gain[first + 1 : last], zi=[a * state])[0]
        state = float(q[last - 1])
    return q


def branches(x: Array, still: float = 1e-9) -> list[tuple[int, float]]:
    """Return (last index, direction) of each stretch of one direction; rests belong to the stretch before."""
    way = np.diff(x)
    moving = np.flatnonzero(np.abs(way) > still)
    if not len(moving):
        return []
    signs = np.sign(way[moving])
    turns = np.flatnonzero(np.diff(signs) != 0)
    ends = [int(moving[i + 1]) for i in turns] + [len(x) - 1]
    directions = [float(signs[i]) for i in turns] + [float(signs[-1])]
    return list(zip(ends, directions, strict=True))


def random_spring(rng: np.random.Generator) -> Spring:
    """Draw a buffer around the limits of the standard: some meet them, some do not."""
    system = str(rng.choice(["elastomer", "elastomer", "rubber-steel", "ring-spring"]))
    preload = rng.uniform(7.0, 54.0)
    rates, softening = (rng.uniform(0.01, 0.05), rng.uniform(0.01, 0.05)), rng.uniform(0.0, 0.08)
    power, power_kN, stage = rng.uniform(2.6, 4.5), 0.0, 0.0
    if system == "elastomer":
        linear = rng.uniform(0.6, 2.2)
        power_kN = max(60.0, rng.uniform(330.0, 980.0) - preload - 100.0 * linear)
        loss = (rng.uniform(0.15, 0.45), rng.uniform(0.55, 0.85))
    elif system == "rubber-steel":
        linear, stage = rng.uniform(1.5, 3.5), rng.uniform(3.0, 12.0)
        loss = (rng.uniform(0.35, 0.6), rng.uniform(0.45, 0.7))
        rates, softening = (rng.uniform(0.002, 0.015), rng.uniform(0.002, 0.02)), rng.uniform(0.0, 0.04)
    else:
        linear = rng.uniform(3.0, 6.0)
        loss = (rng.uniform(0.45, 0.7),) * 2
        rates, softening = (0.0, 0.0), 0.0
    return Spring(
        system=system,
        preload_kN=preload,
        linear_kN_per_mm=linear,
        power_kN=power_kN,
        power=power,
        stage_kN_per_mm=stage,
        stage_mm=rng.uniform(62.0, 80.0),
        stage_width_mm=rng.uniform(6.0, 10.0),
        loss_0=loss[0],
        loss_100=loss[1],
        transition_mm=rng.uniform(1.0, 5.0),
        transition_power=rng.uniform(2.0, 6.0),
        seating_mm=rng.uniform(0.05, 0.4),
        rate_shares=rates,
        rate_times_s=(rng.uniform(0.03, 0.3), rng.uniform(3.0, 15.0)),
        softening=softening,
        softening_path_mm=rng.uniform(150.0, 400.0),
        softening_per_K=rng.uniform(0.0, 0.01),
    )


def random_damper(rng: np.random.Generator) -> Damper:
    """Draw a damper."""
    return Damper("elastomer", rng.uniform(5.0, 60.0), rng.uniform(0.6, 1.6), rng.uniform(0.0, 0.8))
