"""Springs and stroke histories that the tests of this room share."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch


def reference_curves(transition_length_mm: float = 6.0, points_mm: float = 2.5) -> Curves:
    """The curve with which docs/model.md's comparisons were made."""
    x = np.arange(0.0, 105.1, points_mm)
    loading = 15.0 + 2.0 * x + (600.0 - 15.0 - 192.0) / 96.0**4 * x**4
    unloading = loading * (1.0 - 0.202 - 0.535 * (np.minimum(x, 96.0) / 100.0) ** 1.06)
    return Curves(
        stroke_mm=tuple(x.tolist()),
        loading_kN=tuple(loading.tolist()),
        unloading_kN=tuple(np.maximum.accumulate(unloading).tolist()),
        transition_length_mm=transition_length_mm,
    )


def parallel_curves(width_kN: float = 40.0, k: float = 3.0, k_t: float = 11.0) -> Curves:
    """Straight parallel curves: a = b = (k_t - k) / h, for which all is known in closed form."""
    return Curves(
        stroke_mm=(0.0, 50.0, 100.0),
        loading_kN=(60.0, 60.0 + 50.0 * k, 60.0 + 100.0 * k),
        unloading_kN=(60.0 - width_kN, 60.0 - width_kN + 50.0 * k, 60.0 - width_kN + 100.0 * k),
        transition_stiffness_kN_per_mm=(k_t, k_t, k_t),
    )


def spring(curves: Curves | None = None, **parts: object) -> SpringModel:
    """A spring of some curves; the laws that are not given have no effect (1 MJ/K, no loss, no branch)."""
    laws: dict[str, object] = {
        "temperature": TemperatureLaw(),
        "heat": HeatBalance(capacity_J_per_K=1e6),
        "viscous": ViscousBranch(),
    }
    return SpringModel(name="test", curves=curves or reference_curves(), **(laws | parts))


def sine(mean_mm, amplitude_mm, frequency_Hz, cycles, points=2000):
    """Time and stroke of a sine that begins at its lower turning point, ``points`` a cycle."""
    time = np.arange(cycles * points + 1) / (points * frequency_Hz)
    return time, mean_mm - amplitude_mm * np.cos(2.0 * np.pi * frequency_Hz * time)


def path(*strokes_mm, step_mm=0.02):
    """A stroke history through the given strokes, in steps of about ``step_mm``."""
    parts = [np.array([float(strokes_mm[0])])]
    for start, end in pairwise(strokes_mm):
        count = max(1, round(abs(end - start) / step_mm))
        parts.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(parts)


@st.composite
def valid_curves(draw, ramp_mm=0.0) -> Curves:
    """Any curves that the checks let pass: jagged, meeting or apart, with or without preload."""
    count = draw(st.integers(2, 8))
    part = st.floats(0.0, 1.0)
    gaps = [draw(st.floats(4.0, 20.0)) for _ in range(count - 1)]
    rises = [draw(st.floats(0.2, 10.0)) * gap for gap in gaps]
    strokes = np.concatenate([[0.0], np.cumsum(gaps)])
    loading = draw(st.sampled_from([0.0, 5.0, 30.0])) + np.concatenate([[0.0], np.cumsum(rises)])
    shares = np.array([round(draw(part), 4) for _ in range(count)])
    unloading = np.minimum(np.maximum.accumulate(loading * shares), loading)
    # A cubic that keeps the order of its points is nowhere steeper than three times its steepest chord.
    steepest = 3.0 * max(float(np.max(np.diff(f) / np.diff(strokes))) for f in (loading, unloading))
    rule = draw(st.booleans())
    stiffness = None if rule else tuple(steepest + 40.0 * draw(part) for _ in range(count))
    # Between its points a cubic of one order may pass its neighbour: then these are no valid curves.
    try:
        return Curves(
            stroke_mm=tuple(strokes.tolist()),
            loading_kN=tuple(loading.tolist()),
            unloading_kN=tuple(unloading.tolist()),
            transition_length_mm=draw(st.floats(1.0, 15.0)) if rule else None,
            transition_stiffness_kN_per_mm=stiffness,
            contact_ramp_mm=ramp_mm,
        )
    except BadInput:
        assume(False)
        raise


def turning_points(end_mm: float, most: int = 10):
    """Strokes between which a spring is driven to and fro, a little beyond both ends of its tables."""
    return st.lists(st.floats(-2.0, end_mm + 1.0), min_size=2, max_size=most)
