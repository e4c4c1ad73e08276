"""A whole stroke history by the compiled kernel: many times faster than numpy where the spring warms up."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bufferstand.model import kernels as at
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
        model.warnings_of(t, stroke, T),
    )


def law_of(model: SpringModel) -> list[float]:
    """Return what a kind of spring keeps, as :func:`bufferstand.model.kernels.drive` reads it."""
    tables, law = model.tables, model.temperature
    shares = [beta for beta, _ in model.viscous.branches]
    return [
        1.0 / tables.step_mm,
        tables.step_mm,
        tables.end_mm,
        law.reference_C,
        law.sensitivity_per_K,
        law.loss_sensitivity_per_K,
        law.spent_K,
        law.softest,
        model.curves.stop_stiffness_kN_per_mm,
        float(model.heat.rule == "paper"),
        model.heat.sensor_gain,
        tables.width_scale_max,
        float(len(shares)),
        *shares,
        *[0.0] * (at.BRANCHES - len(shares)),
    ]


def factors_of(model: SpringModel, dt_s: float) -> list[float]:
    """Return what the duration of a step gives a kind of spring, as :func:`bufferstand.model.kernels.drive`
    reads it."""
    relaxed = [factor for response in model.viscous.responses(dt_s) for factor in response]
    return [*model.heat.step_factors(dt_s), *relaxed, *[0.0] * (2 * at.BRANCHES - len(relaxed))]


def rest_of(model: SpringModel, stroke_mm: float = 0.0, band: float = 0.0) -> list[float]:
    """Return the state of a spring that rests at a stroke without overstress, but for its temperatures."""
    tables = model.tables
    x = min(max(stroke_mm, 0.0), tables.end_mm)
    i = int(x * (1.0 / tables.step_mm))
    f = x - i * tables.step_mm
    cell = tables.rows()[i]
    A, B, _, h, F_m, p_c, G, g = (
        value + slope * f for value, slope in zip(cell[::2], cell[1::2], strict=True)
    )
    state = [0.0] * at.INNER + [0.0, F_m, g] * at.BRANCHES
    state[at.STROKE], state[at.BAND], state[at.INSIDE] = stroke_mm, band, x
    state[at.A_0], state[at.B_0], state[at.DEPTH], state[at.WIDTH] = A, B, g, h
    r = band - p_c
    state[at.EXCESS], state[at.FREE] = h * r, 0.5 * G * r * r
    return state
