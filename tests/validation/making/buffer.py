"""The made buffer of the static sets, and how it is moved.

F_l(x) = (P + a x + c xⁿ)(1 - exp(-x / 0.3 mm)) loading; F_u = F_l (1 - h (1 - exp(-(x_1 - x) / 1.5 mm)))
unloading, with h by the ratio W_a / W_s that the stroke is to have. Integrals are taken on 200 001 points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.making.standard_set import FloatArray

_FINE = 200_001


@dataclass(frozen=True)
class Buffer:
    """Parameters of the loading branch."""

    preload_kN: float = 20.0
    rise: float = 1.0
    bend: float = 4.8e-4
    power: int = 3

    def loading(self, stroke_mm: FloatArray) -> FloatArray:
        """Return the force of the loading branch [kN]; 0 before contact."""
        x = np.maximum(stroke_mm, 0.0)
        force = self.preload_kN + self.rise * x + self.bend * x**self.power
        return np.asarray(force * -np.expm1(-x / 0.3))

    def unloading(self, stroke_mm: FloatArray, top_mm: float, loss: float) -> FloatArray:
        """Return the force of the unloading branch [kN]."""
        return np.asarray(self.loading(stroke_mm) * (1.0 + loss * np.expm1(-(top_mm - stroke_mm) / 1.5)))

    def stored(self, top_mm: float) -> float:
        """Return W_s [J]."""
        x = np.linspace(0.0, top_mm, _FINE)
        return float(np.trapezoid(self.loading(x), x))

    def loss(self, top_mm: float, ratio: float) -> float:
        """Return h for a ratio W_a / W_s."""
        x = np.linspace(0.0, top_mm, _FINE)
        whole = self.loading(x) - self.unloading(x, top_mm, 1.0)
        return ratio * self.stored(top_mm) / float(np.trapezoid(whole, x))

    def extrapolated_preload(self) -> float:
        """Return the line of least squares through 2 to 10 mm, evenly spread over the stroke, at stroke 0."""
        x = np.linspace(2.0, 10.0, _FINE)
        return float(np.polynomial.Polynomial.fit(x, self.loading(x), 1)(0.0))


@dataclass(frozen=True)
class Test:
    """How the test is made."""

    tops_mm: Sequence[float] = (103.0, 103.0, 103.0)
    ratios: Sequence[float] = (0.55, 0.46, 0.45)
    speed_mm_per_s: float = 20.0
    pause_s: float = 4.0
    dwell_s: float = 0.0
    residual_mm: float = 0.0
    rate_Hz: float = 40.0
    pause_rate_Hz: float | None = None


def motion(buffer: Buffer, test: Test) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, stroke and force of the whole test; rests at stroke 0 (or the residual one) between."""
    pieces: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    now = 0.0

    def add(duration_s: float, first: float, last: float, law: Any, rate_Hz: float) -> None:
        nonlocal now
        count = round(duration_s * rate_Hz)
        share = np.arange(count) / max(count, 1)
        stroke = first + (last - first) * share
        pieces.append((now + duration_s * share, stroke, law(stroke)))
        now += duration_s

    def free(stroke: FloatArray) -> FloatArray:
        return np.zeros_like(stroke)

    add(2.0, 0.0, 0.0, free, test.rate_Hz)
    begin = 0.0
    for top, ratio in zip(test.tops_mm, test.ratios, strict=True):
        loss = buffer.loss(top, ratio)
        duration = whole((top - begin) / test.speed_mm_per_s, test.rate_Hz)
        add(duration, begin, top, buffer.loading, test.rate_Hz)
        if test.dwell_s:
            add(test.dwell_s, top, top, buffer.loading, test.rate_Hz)

        def down(stroke: FloatArray, top: float = top, loss: float = loss) -> FloatArray:
            return buffer.unloading(stroke, top, loss)

        add(
            whole((top - test.residual_mm) / test.speed_mm_per_s, test.rate_Hz),
            top,
            test.residual_mm,
            down,
            test.rate_Hz,
        )
        level = float(down(np.array([test.residual_mm]))[0]) if test.residual_mm else 0.0

        def rest(stroke: FloatArray, level: float = level) -> FloatArray:
            return np.full_like(stroke, level)

        add(test.pause_s, test.residual_mm, test.residual_mm, rest, test.pause_rate_Hz or test.rate_Hz)
        begin = test.residual_mm
    time_s, stroke, force = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return time_s, stroke, force


def whole(duration_s: float, rate_Hz: float) -> float:
    """Return a duration that is a whole number of samples: every turn is a sample."""
    return round(duration_s * rate_Hz) / rate_Hz
