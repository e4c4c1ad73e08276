"""Noise and errors within what is stated: U must hold, and nothing need be said."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from tests.imperfect.applied import Applied
from tests.imperfect.chain import Scene


def coloured(rng: np.random.Generator, s: Scene) -> Applied:
    """Noise that a filter before the converter has coloured."""
    a = float(np.exp(-s.dt_s / rng.uniform(0.005, 0.05)))
    size = s.force_span * rng.uniform(0.0003, 0.002)
    n = len(s.time_s)
    s.force_read_kN = s.force_read_kN + lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(0, size, n))
    s.strokes_mm = [x + lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(0, 0.01, n)) for x in s.strokes_mm]
    return Applied("noise-coloured", f"{size:.2f} kN", harmless=True)


def hum(rng: np.random.Generator, s: Scene) -> Applied | None:
    """Mains hum; where it is sampled to a standstill it is an offset, and no hum."""
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
    """Coarse steps of the converters."""
    kN, mm = s.force_span * rng.uniform(0.0003, 0.003), float(rng.choice([0.01, 0.02, 0.05, 0.1]))
    s.force_read_kN = np.round(s.force_read_kN / kN) * kN
    s.strokes_mm = [np.round(x / mm) * mm for x in s.strokes_mm]
    return Applied("quantised", f"{kN:.2f} kN, {mm} mm", harmless=True)


def drift_within(rng: np.random.Generator, s: Scene) -> Applied | None:
    """A zero of the force that wanders within the limit stated for it."""
    if "force" not in s.stated:
        return None
    limit = 0.3 * s.stated["force"].zero
    way = (s.true_time_s - s.true_time_s[0]) / np.ptp(s.true_time_s)
    s.force_read_kN = s.force_read_kN + limit * way
    return Applied("drift-within", f"{limit:.2f} kN", harmless=True)


def wire_period(rng: np.random.Generator, s: Scene) -> Applied | None:
    """The wave of a drum in the linearity of a draw wire."""
    if "stroke_1" not in s.stated:
        return None
    drum, phase = rng.uniform(150.0, 320.0), rng.uniform(0.0, 2 * np.pi)
    limit = rng.uniform(0.3, 0.9) * s.stated["stroke_1"].linearity
    s.strokes_mm = [
        x + limit * (np.sin(2 * np.pi * x / drum + phase) - np.sin(phase)) / 2 for x in s.strokes_mm
    ]
    return Applied("wire-period", f"±{limit:.3f} mm over {drum:.0f} mm", harmless=True)
