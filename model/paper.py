"""The paper's formulas as they stand, eqs. (3) to (9): force as state, explicit Euler in stroke.

For comparison only. Where they go wrong (large steps, small amplitudes, temperature at hold) is measured in
``docs/model.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PaperSimulation:
    """What the paper's model gives; every array has shape (n,).

    Parameters
    ----------
    force_kN, temperature_C : NDArray
        Force and spring temperature T_s.
    absorbed_J : NDArray
        W_a of eq. (9) since the first instant.
    """

    force_kN: Floats
    temperature_C: Floats
    absorbed_J: Floats


def simulate_paper(
    model: SpringModel,
    time_s: ArrayLike,
    stroke_mm: ArrayLike,
    *,
    temperature_C: float,
    ambient_C: float | None = None,
    isothermal: bool = False,
) -> PaperSimulation:
    """Return the history of eqs. (4), (5), (7), (8) and (9), starting on the unloading curve.

    Curves and parameters are the model's; its viscous branch, loss sensitivity and floor have no place in
    the paper. k_t is scaled with the curves, which the paper leaves open. Eq. (3) is the same with straight
    curves.

    Parameters
    ----------
    model : SpringModel
        The spring.
    time_s, stroke_mm : array_like
        Instants [s] and strokes [mm] within the tables, shape (n,).
    temperature_C, ambient_C : float
        Spring temperature at the first instant, and T_0 (the same if not given) [°C].
    isothermal : bool
        Keep the temperature.

    Returns
    -------
    PaperSimulation

    Raises
    ------
    ValueError
        If the stroke leaves the tables, where eq. (4) says nothing.
    ZeroDivisionError
        Where the formulas are 0/0: curves that meet (4), lambda = 0 (7).
    """
    t = np.asarray(time_s, dtype=np.float64)
    x = np.asarray(stroke_mm, dtype=np.float64)
    curves, law, node = model.curves, model.temperature, model.heat
    if x.min() < 0.0 or x.max() > curves.end_mm:
        raise ValueError(f"the stroke leaves 0 … {curves.end_mm:g} mm")
    ambient = temperature_C if ambient_C is None else ambient_C
    F_l, F_u = curves.loading(x).tolist(), curves.unloading(x).tolist()
    k_l, k_u = curves.loading_stiffness(x).tolist(), curves.unloading_stiffness(x).tolist()
    k_t = curves.transition_stiffness(x).tolist()
    fading = np.exp(-x / law.depth_mm).tolist()
    dx, dt = np.diff(x).tolist(), np.diff(t).tolist()

    T, absorbed = temperature_C, 0.0
    s, ds = _scale(model, T, fading[0])
    F = s * F_u[0]
    force, temperature, work = [F], [T], [0.0]
    for i, (step, duration) in enumerate(zip(dx, dt, strict=True)):
        low, high = s * F_u[i], s * F_l[i]
        slope_l, slope_u = s * k_l[i] + ds * F_l[i], s * k_u[i] + ds * F_u[i]
        F += step * slope(F, low, high, s * k_t[i], slope_l, slope_u, loading=step > 0.0)
        s, ds = _scale(model, T, fading[i + 1])
        power = max(0.0, -step) / duration * (s * F_l[i + 1] - F)  # eq. (8)
        absorbed += power * duration  # eq. (9)
        if not isothermal:
            gained = power / node.loss_W_per_K - (T - ambient)
            T += gained * (1.0 - math.exp(-node.loss_W_per_K * duration / node.capacity_J_per_K))  # eq. (7)
            s, ds = _scale(model, T, fading[i + 1])
        force.append(F)
        temperature.append(T)
        work.append(absorbed)
    return PaperSimulation(np.array(force), np.array(temperature), np.array(work))


def slope(
    force_kN: float, low_kN: float, high_kN: float, k_t: float, k_l: float, k_u: float, *, loading: bool
) -> float:
    """Return dF/dx [kN/mm] of eq. (4) between the curves ``low_kN`` = F_u and ``high_kN`` = F_l.

    Raises
    ------
    ZeroDivisionError
        Where the curves meet: there eq. (4) is 0/0.
    """
    if loading:
        return (high_kN - force_kN) / (high_kN - low_kN) * (k_t - k_l) + k_l
    return (force_kN - low_kN) / (high_kN - low_kN) * (k_t - k_u) + k_u


def _scale(model: SpringModel, temperature_C: float, fading: float) -> tuple[float, float]:
    """Return the factor of eq. (5) and its derivative by the stroke [1/mm]; ``fading`` is exp(-x / alpha)."""
    law = model.temperature
    soft = law.sensitivity_per_K * (temperature_C - law.reference_C)
    return 1.0 - soft * (1.0 - fading), -soft * fading / law.depth_mm
