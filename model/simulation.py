"""The spring over a whole stroke history at once: force, heat and temperature as arrays.

The band position depends on the stroke history only (``docs/model.md`` § 1), so that it costs one exponential
over each half stroke; temperature is one linear recurrence after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.model.isothermal import band_position
from bufferstand.model.spring import NO_TIME, SpringModel, ViscousBranch
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Simulation:
    """A simulated history; every array has shape (n,), one value per given instant.

    Parameters
    ----------
    force_kN, temperature_C, sensor_temperature_C, band : NDArray
        Force, temperature of the mass and of the sensor, band position p.
    heat_J, work_J : NDArray
        Energy lost in the spring, and work done on it, since the first instant.
    warnings : tuple of str
        What a reader of these figures must know.
    """

    force_kN: Floats
    temperature_C: Floats
    sensor_temperature_C: Floats
    heat_J: Floats
    work_J: Floats
    band: Floats
    warnings: tuple[str, ...] = ()


def band_history(tables: BandTables, stroke_mm: Floats, initial_band: float = 0.0) -> Floats:
    """Return the band position p at every stroke, shape (n,); exact, whatever the distance of the strokes.

    Loading ``1 - p1 = (1 - p0) exp(-(A1 - A0))``, unloading ``p1 = p0 exp(-(B0 - B1))``; ``initial_band`` is
    p at the first stroke.
    """
    return band_position(tables, stroke_mm, initial_band)


def lag_history(time_s: Floats, stroke_mm: Floats, tau_s: float, initial_lag_mm: float = 0.0) -> Floats:
    """Return x - xi [mm] for ``xi' = (x - xi) / tau`` and a stroke linear between the instants, shape (n,).

    Summed in blocks of 300 time constants, so that no exponential leaves the range of the numbers.
    """
    dt = np.diff(time_s)
    share = -np.expm1(-dt / tau_s)
    some = dt > NO_TIME * tau_s
    added = np.diff(stroke_mm) * np.divide(share * tau_s, dt, out=np.ones_like(dt), where=some)
    lag = np.empty_like(stroke_mm)
    lag[0] = initial_lag_mm
    first = 0
    while first < len(dt):
        last = max(first + 1, int(np.searchsorted(time_s, time_s[first] + 300.0 * tau_s, side="right")) - 1)
        growth = np.exp(np.minimum((time_s[first + 1 : last + 1] - time_s[first]) / tau_s, 700.0))
        lag[first + 1 : last + 1] = (lag[first] + np.cumsum(added[first:last] * growth)) / growth
        first = last
    return lag


def lag_histories(viscous: ViscousBranch, time_s: Floats, stroke_mm: Floats) -> Floats:
    """Return :func:`lag_history` of every branch from rest [mm], shape (branches, n)."""
    lags = [lag_history(time_s, stroke_mm, tau_s) for _, tau_s in viscous.branches]
    return np.array(lags).reshape(len(lags), len(stroke_mm))


def simulate(
    model: SpringModel,
    time_s: ArrayLike,
    stroke_mm: ArrayLike,
    *,
    temperature_C: float,
    ambient_C: float | None = None,
    isothermal: bool = False,
    initial_band: float = 0.0,
) -> Simulation:
    """Return force, heat and temperature of a spring that is driven through a stroke history.

    Parameters
    ----------
    model : SpringModel
        The spring, without overstress at the first instant.
    time_s, stroke_mm : array_like
        Instants [s], not falling, and the stroke there [mm], shape (n,); linear between them.
    temperature_C : float
        Temperature at the first instant [°C].
    ambient_C : float, optional
        Temperature of the surroundings [°C]; the spring's own at the first instant if not given.
    isothermal : bool
        Keep the temperature, whatever the heat.
    initial_band : float
        Band position p at the first instant.

    Returns
    -------
    Simulation
        The same figures as :class:`bufferstand.model.stepper.SpringStepper` gives step by step.

    Raises
    ------
    ValueError
        If the arrays differ in shape or are empty, or time falls.
    """
    t = np.asarray(time_s, dtype=np.float64)
    stroke = np.asarray(stroke_mm, dtype=np.float64)
    if t.ndim != 1 or t.shape != stroke.shape or len(t) == 0:
        raise ValueError(f"time and stroke must be of one length, got shapes {t.shape} and {stroke.shape}")
    if np.any(np.diff(t) < 0.0):
        raise ValueError("time must not fall")
    ambient = temperature_C if ambient_C is None else ambient_C
    lags = lag_histories(model.viscous, t, np.clip(stroke, 0.0, model.tables.end_mm))
    history = _History.of(model, stroke, band_history(model.tables, stroke, initial_band), lags)
    if isothermal:
        T = sensed = np.full_like(t, temperature_C)
        heat = history.isothermal_heat(model, temperature_C)
    else:
        T, sensed, heat = _temperatures(model, t, history, temperature_C, ambient)
    force = history.force(model, T)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke))])
    return Simulation(force, T, sensed, heat, work, history.band, model.warnings_of(t, stroke, T))


def force_history(
    model: SpringModel, stroke_mm: Floats, band: Floats, lag_mm: Floats, temperature_C: ArrayLike
) -> Floats:
    """Return the force [kN] of known states, shape (n,): stroke, band position, lags of the viscous branches.

    ``lag_mm`` has shape (branches, n), or (n,) where there is one branch or none; ``temperature_C`` is one
    temperature, or one for each stroke.
    """
    return _History.of(model, stroke_mm, band, lag_mm).force(model, temperature_C)


@dataclass(frozen=True)
class _History:
    """All that follows from the stroke alone, shape (n,): looked up once, used at every temperature."""

    stroke: Floats
    x: Floats
    band: Floats
    loading: Floats
    width: Floats
    middle: Floats
    depth: Floats
    excess: Floats  # F - F*, at the reference temperature
    free_energy: Floats  # G (p - p*)² / 2
    lags: Floats  # shape (branches, n), like the two below
    inner_force: Floats  # F_m(xi)
    inner_depth: Floats

    @classmethod
    def of(cls, model: SpringModel, stroke_mm: Floats, band: Floats, lag_mm: Floats) -> _History:
        tables = model.tables
        x = np.clip(stroke_mm, 0.0, tables.end_mm)
        cells = tables.cells_of(x)
        width = tables.at(tables.width, cells)
        off_centre = band - tables.at(tables.centre, cells)
        lags = np.atleast_2d(lag_mm) if model.viscous.branches else np.empty((0, len(x)))
        if len(lags) != len(model.viscous.branches):
            raise ValueError(f"{len(lags)} lags for {len(model.viscous.branches)} viscous branches")
        inner = tables.cells_of(np.clip(x - lags, 0.0, tables.end_mm))
        return cls(
            stroke=stroke_mm,
            x=x,
            band=band,
            loading=tables.at(tables.loading, cells),
            width=width,
            middle=tables.at(tables.middle, cells),
            depth=tables.at(tables.depth, cells),
            excess=width * off_centre,
            free_energy=0.5 * tables.at(tables.free_energy, cells) * off_centre**2,
            lags=lags,
            inner_force=tables.at(tables.middle, inner),
            inner_depth=tables.at(tables.depth, inner),
        )

    def force(self, model: SpringModel, temperature_C: ArrayLike) -> Floats:
        """Return the force [kN] at the temperatures, contact loss and stop included."""
        soft = model.temperature.softening(temperature_C)
        s, s_inner = 1.0 - soft * self.depth, 1.0 - soft * self.inner_depth
        middle = s * self.middle
        width = self.width * model.width_scale(temperature_C)
        force = s * (self.loading - (1.0 - self.band) * width)
        for (beta, _), s_in, inner in zip(model.viscous.branches, s_inner, self.inner_force, strict=True):
            force += beta * (middle - s_in * inner)
        force = np.where(self.stroke > 0.0, np.maximum(force, 0.0), 0.0)
        return force + model.curves.stop_stiffness_kN_per_mm * np.maximum(self.stroke - self.x, 0.0)

    def losses(self, viscous: ViscousBranch) -> list[list[tuple[float, float]]]:
        """Return for each branch and step two energies [J]: at softening s the loss is first - s second."""
        force, softer = self.inner_force, self.inner_depth * self.inner_force
        found = []
        for k, (beta, _) in enumerate(viscous.branches):
            weight = 0.5 * beta * (self.lags[k, 1:] + self.lags[k, :-1])
            columns = (weight * np.diff(force[k]), weight * np.diff(softer[k]))
            found.append(list(zip(*(column.tolist() for column in columns), strict=True)))
        return found

    def isothermal_heat(self, model: SpringModel, temperature_C: float) -> Floats:
        """Return the energy [J] lost since the first instant at one temperature."""
        soft = model.temperature.softening(temperature_C)
        s = 1.0 - soft * self.depth
        dx = np.diff(self.x)
        if model.heat.rule == "paper":
            held = s * self.width * (1.0 - self.band)
            band_heat = np.cumsum(0.5 * (held[1:] + held[:-1]) * np.maximum(-dx, 0.0))
        else:
            excess, psi = s * self.excess, s * self.free_energy
            released = np.cumsum(0.5 * (excess[1:] + excess[:-1]) * dx - np.diff(psi))
            band_heat = np.maximum(np.maximum.accumulate(released), 0.0)
        inner = (1.0 - soft * self.inner_depth) * self.inner_force
        lost = band_heat * model.width_scale(temperature_C)
        for (beta, _), lag, force in zip(model.viscous.branches, self.lags, inner, strict=True):
            lost += np.cumsum(np.maximum(0.5 * beta * (lag[1:] + lag[:-1]) * np.diff(force), 0.0))
        return np.concatenate([[0.0], lost])


def _temperatures(
    model: SpringModel, time_s: Floats, history: _History, start_C: float, ambient_C: float
) -> tuple[Floats, Floats, Floats]:
    """Return temperatures of mass and sensor and the heat so far: eq. (7), step after step."""
    law, node = model.temperature, model.heat
    reference, c_ts, softest = law.reference_C, law.sensitivity_per_K, law.softest
    c_eta, e_max = law.loss_sensitivity_per_K, model.tables.width_scale_max
    paper, gain = node.rule == "paper", node.sensor_gain
    half_dx = 0.5 * np.diff(history.x)
    held = history.width * (1.0 - history.band) if paper else history.excess
    strokes = -np.minimum(half_dx, 0.0) if paper else half_dx
    psi = np.zeros_like(history.free_energy) if paper else history.free_energy
    factors = _durations(model, np.diff(time_s))

    T = sensed = start_C
    lost = owed = 0.0
    rows = [(T, sensed, lost)]
    g0, m0, psi0 = float(history.depth[0]), float(held[0]), float(psi[0])
    columns = (strokes, history.depth[1:], held[1:], psi[1:])
    losses = list(zip(*history.losses(model.viscous), strict=True)) or [()] * len(strokes)
    steps = zip(*(column.tolist() for column in columns), losses, *factors, strict=True)
    for dx, g, m, p, branches, share, per_joule, follow in steps:
        warmer = T - reference
        soft = min(c_ts * warmer, softest)
        s0, s1 = 1.0 - soft * g0, 1.0 - soft * g
        q = (s0 * m0 + s1 * m) * dx - s1 * p + s0 * psi0 + owed
        owed = min(q, 0.0)
        q = max(q, 0.0)
        if c_eta:
            q *= min(max(1.0 - c_eta * warmer, 0.0), e_max)
        for cold, softer in branches:
            q += max(cold - soft * softer, 0.0)
        lost += q
        T += q * per_joule - (T - ambient_C) * share
        sensed += (ambient_C + gain * (T - ambient_C) - sensed) * follow
        rows.append((T, sensed, lost))
        g0, m0, psi0 = g, m, p
    table = np.array(rows)
    return table[:, 0], table[:, 1], table[:, 2]


def _durations(model: SpringModel, dt_s: Floats) -> tuple[list[float], list[float], list[float]]:
    """Return for each step share and K per J of eq. (7), and how far the sensor follows."""
    lengths, places = np.unique(dt_s, return_inverse=True)
    node = model.heat
    made = [node.step_factors(float(dt)) for dt in lengths]
    table = np.array(made, dtype=np.float64).reshape(-1, 3)[places]
    return table[:, 0].tolist(), table[:, 1].tolist(), table[:, 2].tolist()
