"""A whole stroke history by the compiled kernel: many times faster than numpy where the spring warms up."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bufferstand.model import kernels as at
from bufferstand.model.fleet import factors_of, law_of, rest_of
from bufferstand.model.simulation import Simulation
from bufferstand.model.spring import SpringModel


def simulate_compiled(
    model: SpringModel,
    time_s: ArrayLike,
    stroke_mm: ArrayLike,
    *,
    temperature_C: float,
    ambient_C: float | None = None,
    initial_band: float = 0.0,
) -> Simulation:
    """Return what :func:`bufferstand.model.simulation.simulate` returns, to rounding; parameters and Returns
    are its own.

    It pays from some millions of samples on, or when numba is warm: import and compilation take seconds.

    Raises
    ------
    ValueError
        If the arrays differ in shape or are empty, or time falls.
    ImportError
        If numba (the extra ``fast``) is not installed.
    """
    t = np.asarray(time_s, dtype=np.float64)
    stroke = np.ascontiguousarray(stroke_mm, dtype=np.float64)
    if t.ndim != 1 or t.shape != stroke.shape or len(t) == 0:
        raise ValueError(f"time and stroke must be of one length, got shapes {t.shape} and {stroke.shape}")
    durations, which = np.unique(np.diff(t, prepend=t[0]), return_inverse=True)
    if durations[0] < 0.0:
        raise ValueError("time must not fall")
    state = np.array(rest_of(model, float(stroke[0]), initial_band))
    state[[at.TEMPERATURE, at.SENSOR]] = temperature_C
    state[at.AMBIENT] = temperature_C if ambient_C is None else ambient_C
    factors = np.array([factors_of(model, float(dt)) for dt in durations]).ravel()
    places = np.zeros((len(t), 4), dtype=np.intp)
    places[:, 2] = at.FACTORS_SIZE * which
    outputs = np.empty((len(t), at.READ))
    cells, law = model.tables.rows().ravel(), np.array(law_of(model))
    at.compiled()(cells, law, factors, state, places.ravel(), stroke, outputs.reshape(-1))
    columns = np.ascontiguousarray(outputs.T)
    T = columns[at.TEMPERATURE]
    return Simulation(
        columns[at.FORCE],
        T,
        columns[at.SENSOR],
        columns[at.HEAT],
        columns[at.WORK],
        columns[at.BAND],
        model.warnings(float(T.min()), float(T.max())),
    )
