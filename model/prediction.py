"""What a step of a test will do, before it is done: force, energies, heating. Fast enough for a planner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.simulation import band_history, force_history, lag_histories, lag_history
from bufferstand.model.spring import HeatBalance, SpringModel

Floats = NDArray[np.float64]

_POINTS = 1000  # per half cycle; the energies then err by less than 1e-5


@dataclass(frozen=True)
class CyclePrediction:
    """One loading and unloading at one temperature.

    Parameters
    ----------
    peak_force_kN : float
        Largest force.
    stored_energy_J : float
        Area under the loading branch between the turning points (EN 15551).
    absorbed_energy_J : float
        Area of the loop.
    damping : float
        Absorbed by stored energy; 0 where nothing is stored.
    lower_force_kN : float
        Force at the lower turning point.
    """

    peak_force_kN: float
    stored_energy_J: float
    absorbed_energy_J: float
    damping: float
    lower_force_kN: float = 0.0


@dataclass(frozen=True)
class StaticPrediction(CyclePrediction):
    """One slow stroke from contact to a limit and back.

    Parameters
    ----------
    end_stroke_mm : float
        Stroke at which it turns.
    """

    end_stroke_mm: float = 0.0


def predict_harmonic(
    model: SpringModel, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
) -> CyclePrediction:
    """Predict the settled loop of ``prestress + amplitude sin`` at one temperature.

    Parameters
    ----------
    model : SpringModel
        The spring.
    prestress_mm, amplitude_mm : float
        Mean stroke, and half the range.
    frequency_Hz : float
        Frequency, above 0.
    temperature_C : float
        Temperature of the spring.

    Returns
    -------
    CyclePrediction
        Of the loop that repeats itself; band position and overstress of it are solved for, not waited for.

    Raises
    ------
    ValueError
        If amplitude or frequency is not above 0.
    """
    if not (amplitude_mm > 0.0 and frequency_Hz > 0.0):
        raise ValueError("amplitude and frequency must be above 0")
    phase = np.linspace(-np.pi / 2, 3 * np.pi / 2, 2 * _POINTS + 1)
    stroke = prestress_mm + amplitude_mm * np.sin(phase)
    time = (phase - phase[0]) / (2.0 * np.pi * frequency_Hz)
    # p after a cycle is linear in p before it, and so is the lag: two points, one fixed point.
    ends = [float(band_history(model.tables, stroke, start)[-1]) for start in (0.0, 1.0)]
    gain = ends[1] - ends[0]
    band = band_history(model.tables, stroke, ends[0] / (1.0 - gain) if gain < 1.0 else 0.5)
    lag = _settled_lag(model, time, stroke)
    force = force_history(model, stroke, band, lag, temperature_C)
    return CyclePrediction(*_energies(stroke, force), lower_force_kN=float(force[0]))


def predict_static(
    model: SpringModel,
    force_limit_kN: float,
    stroke_limit_mm: float,
    speed_mm_per_s: float,
    temperature_C: float,
) -> StaticPrediction:
    """Predict one stroke at constant speed from contact to the first limit and back, at one temperature.

    Parameters
    ----------
    model : SpringModel
        The spring, at rest before.
    force_limit_kN, stroke_limit_mm : float
        Where it turns, whichever comes first.
    speed_mm_per_s : float
        Speed in both directions, above 0.
    temperature_C : float
        Temperature of the spring.

    Returns
    -------
    StaticPrediction

    Raises
    ------
    ValueError
        If a limit or the speed is not above 0.
    """
    if not (force_limit_kN > 0.0 and stroke_limit_mm > 0.0 and speed_mm_per_s > 0.0):
        raise ValueError("force limit, stroke limit and speed must be above 0")
    end = stroke_limit_mm
    rise = np.linspace(0.0, end, _POINTS + 1)
    force = _static_force(model, rise, speed_mm_per_s, temperature_C)
    if np.any(force >= force_limit_kN):
        above = int(np.argmax(force >= force_limit_kN))
        share = (force_limit_kN - force[above - 1]) / (force[above] - force[above - 1])
        end = float(rise[above - 1] + share * (rise[above] - rise[above - 1]))
        rise = np.linspace(0.0, end, _POINTS + 1)
    stroke = np.concatenate([rise, rise[-2::-1]])
    force = _static_force(model, stroke, speed_mm_per_s, temperature_C)
    return StaticPrediction(*_energies(stroke, force), end_stroke_mm=end)


def predict_forces(model: SpringModel, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:
    """Predict the force [kN] along a path of strokes from rest at one temperature, shape (n,).

    Parameters
    ----------
    model : SpringModel
        The spring, without overstress and on its unloading curve before the first instant.
    time_s, stroke_mm : NDArray, shape (n,)
        Instants [s], not falling, and the strokes there [mm]; linear between them.
    temperature_C : float
        Temperature of the spring.
    """
    x = np.clip(stroke_mm, 0.0, model.tables.end_mm)
    lags = lag_histories(model.viscous, time_s, x)
    return force_history(model, stroke_mm, band_history(model.tables, stroke_mm), lags, temperature_C)


def heat_step(
    heat: HeatBalance, start_C: float, ambient_C: float, power_W: float, duration_s: float
) -> float:
    """Return the temperature [°C] after ``duration_s`` of constant power (eqs. (6), (7), exact).

    Parameters
    ----------
    heat : HeatBalance
        The spring's thermal mass.
    start_C, ambient_C : float
        Temperature at the beginning, and of the surroundings.
    power_W : float
        Mean power that is absorbed: absorbed energy of a cycle times frequency.
    duration_s : float
        Duration, 0 or more.
    """
    share, per_watt = heat.response(duration_s)
    return start_C - share * (start_C - ambient_C) + per_watt * power_W


def _settled_lag(model: SpringModel, time_s: Floats, stroke_mm: Floats) -> Floats:
    """Return the lags of the viscous branches over a cycle that repeats itself, shape (branches, n)."""
    x = np.clip(stroke_mm, 0.0, model.tables.end_mm)
    lags = lag_histories(model.viscous, time_s, x)
    for k, (kept, _) in enumerate(model.viscous.responses(float(time_s[-1]))):
        tau_s = model.viscous.branches[k][1]
        lags[k] = lag_history(time_s, x, tau_s, float(lags[k, -1]) / (1.0 - kept))
    return lags


def _static_force(model: SpringModel, stroke: Floats, speed: float, temperature_C: float) -> Floats:
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(stroke)))]) / speed
    return predict_forces(model, time, stroke, temperature_C)


def _energies(stroke: Floats, force: Floats) -> tuple[float, float, float, float]:
    """Return peak force, stored and absorbed energy and damping; the first half of the points is loading."""
    work = 0.5 * (force[1:] + force[:-1]) * np.diff(stroke)
    stored, absorbed = float(work[: len(work) // 2].sum()), float(work.sum())
    return float(force.max()), stored, absorbed, absorbed / stored if stored > 0.0 else 0.0
