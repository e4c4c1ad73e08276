"""The response of a spring model to a drive, in stages that are reused while their parameters stay.

The band position follows from the stroke alone (``docs/model.md``), so a change of the thermal parameters
costs no more than a few cumulative sums. Same laws and figures as
:func:`bufferstand.model.simulation.simulate` (tested).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from bufferstand.model.simulation import band_history, lag_history
from bufferstand.model.spring import SPECTRUM_TAU_S, SpringModel, ViscousBranch
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]

_BLOCK = 30.0
_TOLERANCE_K = 1e-8
_MOST_ROUNDS = 40
_FINER = 8
"""Parts of a step between two nodes in which fast viscous branches follow the stroke."""


def relax(time_s: Floats, tau_s: float, first: float, added: Floats) -> Floats:
    """Return y with ``y1 = y0 exp(-dt / tau) + added``, shape (n,); ``added`` has shape (n - 1,)."""
    result = np.empty_like(time_s)
    result[0] = first
    if np.isinf(tau_s):
        result[1:] = first + np.cumsum(added)
        return result
    at = 0
    while at < added.size:
        end = max(at + 1, int(np.searchsorted(time_s, time_s[at] + _BLOCK * tau_s, side="right")) - 1)
        growth = np.exp(np.minimum((time_s[at + 1 : end + 1] - time_s[at]) / tau_s, 700.0))
        result[at + 1 : end + 1] = (result[at] + np.cumsum(added[at:end] * growth)) / growth
        at = end
    return result


@dataclass(frozen=True, eq=False)
class BandStage:
    """All that follows from stroke and curves alone; every array has shape (n,).

    ``released`` is the integral of F - F* over each step [J], shape (n - 1,).
    """

    stroke: Floats
    x: Floats
    band: Floats
    loading: Floats
    width: Floats
    middle: Floats
    excess: Floats
    free_energy: Floats
    released: Floats
    tables: BandTables

    @classmethod
    def of(cls, tables: BandTables, stroke_mm: Floats) -> BandStage:
        """Look everything up once."""
        x = np.clip(stroke_mm, 0.0, tables.end_mm)
        cells = tables.cells_of(x)
        band = band_history(tables, stroke_mm)
        width = tables.at(tables.width, cells)
        off_centre = band - tables.at(tables.centre, cells)
        return cls(
            stroke=stroke_mm,
            x=x,
            band=band,
            loading=tables.at(tables.loading, cells),
            width=width,
            middle=tables.at(tables.middle, cells),
            excess=width * off_centre,
            free_energy=0.5 * tables.at(tables.free_energy, cells) * off_centre**2,
            released=_released(tables, x, band, width),
            tables=tables,
        )

    @cached_property
    def half_dx(self) -> Floats:
        """Half the way of each step, shape (n - 1,)."""
        return np.asarray(0.5 * np.diff(self.x))


def _released(tables: BandTables, x: Floats, band: Floats, width: Floats) -> Floats:
    """Return the integral of F - F* over each step at the reference temperature, shape (n - 1,).

    h (p - p*) is a part that knows only the stroke, which is tabulated, less h (1 - p) (loading) or plus h p
    (unloading), which fall off nearly as an exponential: so the nodes may be far apart.
    """
    dx = np.diff(x)
    cells = tables.cells_of(x)
    loading_part, unloading_part = (
        np.diff(tables.at(_integral(values, tables.step_mm), cells))
        for values in (tables.width * (1.0 - tables.centre), tables.width * tables.centre)
    )
    rising = loading_part - dx * _log_mean(width * (1.0 - band))
    falling = dx * _log_mean(width * band) - unloading_part
    return np.where(dx > 0.0, rising, falling)


def _integral(values: Floats, step: float) -> Floats:
    return np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])


def _log_mean(values: Floats) -> Floats:
    """Return the mean over each step of what is exponential between the nodes, shape (n - 1,)."""
    total = values[1:] + values[:-1]
    ratio = np.divide(np.diff(values), total, out=np.zeros_like(total), where=total > 1e-12)
    ratio = np.clip(np.abs(ratio), 1e-4, 1.0 - 1e-9)
    return 0.5 * total * ratio / np.arctanh(ratio)


def spectrum_lags(
    time_s: Floats,
    x_mm: Floats,
    half: NDArray[np.intp] | None = None,
    times_s: Sequence[float] = SPECTRUM_TAU_S,
) -> Floats:
    """Return the lags [mm] of branches from rest, (branches, n): the flat spectrum's, or of ``times_s``.

    Nodes lie further apart than these branches take to relax. With ``half``, the number of the half stroke of
    each node, the stroke between them is a monotone cubic instead of a straight line.
    """
    if half is None or time_s.size < 3:
        return np.array([lag_history(time_s, x_mm, tau_s) for tau_s in times_s])
    fine_s, fine_mm = _between_nodes(time_s, x_mm, half)
    return np.array([lag_history(fine_s, fine_mm, tau_s)[::_FINER] for tau_s in times_s])


def _between_nodes(time_s: Floats, x_mm: Floats, half: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return times and strokes of the nodes and of points between them, each half stroke by itself."""
    inside = np.arange(_FINER) / _FINER
    fine_s = np.append((time_s[:-1, None] + np.diff(time_s)[:, None] * inside).ravel(), time_s[-1])
    fine_mm = np.append((x_mm[:-1, None] + np.diff(x_mm)[:, None] * inside).ravel(), x_mm[-1])
    starts = np.flatnonzero(np.diff(half, prepend=half[0] - 1))
    for first, last in zip(starts.tolist(), [*starts[1:].tolist(), time_s.size - 1], strict=True):
        if last - first >= 2:
            part = slice(first * _FINER, last * _FINER + 1)
            nodes = slice(first, last + 1)
            fine_mm[part] = PchipInterpolator(time_s[nodes], x_mm[nodes])(fine_s[part])
    return fine_s, fine_mm


@dataclass(frozen=True, eq=False)
class LagStage:
    """The viscous branches before their shares, shape (branches, n): the own one, then the spectrum's.

    The lags follow from the stroke alone; ``inner`` is the middle curve at the inner strokes.
    """

    lag: Floats
    inner: Floats
    inner_x: Floats

    @classmethod
    def of(
        cls,
        band: BandStage,
        time_s: Floats,
        viscous: ViscousBranch,
        first_mm: float = 0.0,
        half: NDArray[np.intp] | None = None,
    ) -> LagStage:
        """Follow the inner strokes of a model's branches; the own one's begins at ``first_mm``.

        The spectrum is left out where the model has none; ``half`` as for :func:`spectrum_lags`.
        """
        own = lag_history(time_s, band.x, viscous.tau_s, float(band.x[0]) - first_mm)
        fast = spectrum_lags(time_s, band.x, half) if viscous.spectrum_per_decade > 0.0 else None
        return cls.looked_up(band, own, fast)

    @classmethod
    def looked_up(cls, band: BandStage, own_mm: Floats, spectrum_mm: Floats | None) -> LagStage:
        """Return the stage of lags that are known: (n,) of the own branch, (branches, n) of the spectrum."""
        lag = own_mm[None] if spectrum_mm is None else np.concatenate([own_mm[None], spectrum_mm])
        inner_x = np.clip(band.x - lag, 0.0, band.tables.end_mm)
        cells = band.tables.cells_of(inner_x)
        return cls(lag, band.tables.at(band.tables.middle, cells), inner_x)

    def shares(self, viscous: ViscousBranch) -> Floats:
        """Return the share of each branch, shape (branches, 1)."""
        shares = [viscous.beta, *[viscous.spectrum_share] * (len(self.lag) - 1)]
        return np.array(shares)[:, None]


@dataclass(frozen=True, eq=False)
class Answer:
    """Force [kN], temperature of mass and of sensor [°C] at the nodes, shape (n,)."""

    force_kN: Floats
    temperature_C: Floats
    sensor_C: Floats


def answer(
    model: SpringModel,
    time_s: Floats,
    band: BandStage,
    lag: LagStage,
    *,
    start_C: float,
    sensor_start_C: float,
    ambient_C: float,
    near_C: Floats | None = None,
    isothermal: bool = False,
) -> Answer:
    """Return force and temperatures at the nodes.

    Parameters
    ----------
    model : SpringModel
        Its thermal law, heat balance and viscous shares; curves enter by the stages.
    time_s : array, shape (n,)
    band, lag : BandStage, LagStage
        Of the same nodes.
    start_C, sensor_start_C : float
        Temperature of the mass and of the sensor at the first node.
    ambient_C : float
    near_C : array, shape (n,), optional
        Temperatures of the mass that are nearly right, to begin with; saves rounds.
    isothermal : bool
        Keep the first temperature, whatever the heat.
    """
    law, alpha = model.temperature, model.temperature.depth_mm
    depth, inner_depth = -np.expm1(-band.x / alpha), -np.expm1(-lag.inner_x / alpha)
    if isothermal:
        T = np.full_like(time_s, start_C)
    else:
        ends = (start_C, ambient_C)
        T = _temperatures(model, time_s, band, lag, (depth, inner_depth), ends, near_C)
    soft = law.softening(T)
    s, s_inner = 1.0 - soft * depth, 1.0 - soft * inner_depth
    width = band.width * np.clip(
        1.0 - law.loss_sensitivity_per_K * (T - law.reference_C), 0.0, band.tables.width_scale_max
    )
    force = s * (band.loading - (1.0 - band.band) * width)
    force += np.sum(lag.shares(model.viscous) * (s * band.middle - s_inner * lag.inner), axis=0)
    force = np.where(band.stroke > 0.0, np.maximum(force, 0.0), 0.0)
    force += model.curves.stop_stiffness_kN_per_mm * np.maximum(band.stroke - band.x, 0.0)
    place = ambient_C + model.heat.sensor_gain * (T - ambient_C)
    if model.heat.sensor_lag_s > 0.0:
        sensor = place - lag_history(time_s, place, model.heat.sensor_lag_s, float(place[0]) - sensor_start_C)
    else:
        sensor = place
    return Answer(force, T, sensor)


def _temperatures(
    model: SpringModel,
    time_s: Floats,
    band: BandStage,
    lag: LagStage,
    depths: tuple[Floats, Floats],
    ends_C: tuple[float, float],
    near_C: Floats | None,
) -> Floats:
    """Return the temperature of the mass by successive approximation: the heat depends on it but little.

    Each round is eq. (7) in one cumulative sum; the error falls like (c_ts ΔT)^n / n!.
    """
    law, node = model.temperature, model.heat
    depth, inner_depth = depths
    start_C, ambient_C = ends_C
    mean_depth = 0.5 * (depth[1:] + depth[:-1])
    if node.rule == "paper":
        held = band.width * (1.0 - band.band)
        plain = -(held[1:] + held[:-1]) * np.minimum(band.half_dx, 0.0)
        soften = mean_depth * plain
    else:
        plain = band.released - np.diff(band.free_energy)
        soften = mean_depth * band.released - np.diff(depth * band.free_energy)
    lags = 0.5 * lag.shares(model.viscous) * (lag.lag[:, 1:] + lag.lag[:, :-1])
    viscous = np.sum(lags * np.diff(lag.inner), axis=0)
    viscous_soften = np.sum(lags * np.diff(inner_depth * lag.inner), axis=0)
    dt = np.diff(time_s)
    tau = node.capacity_J_per_K / node.loss_W_per_K if node.loss_W_per_K > 0.0 else np.inf
    ratio = dt / tau
    small = ratio < 1e-9
    per_joule = np.where(small, 1.0, -np.expm1(-ratio) / np.where(small, 1.0, ratio)) / node.capacity_J_per_K
    T = np.full_like(time_s, start_C) if near_C is None else near_C
    for _ in range(_MOST_ROUNDS):
        soft = law.softening(T[:-1])
        heat = np.maximum(np.maximum.accumulate(np.cumsum(plain - soft * soften)), 0.0)
        gained = np.diff(heat, prepend=0.0)
        if law.loss_sensitivity_per_K:
            e = 1.0 - law.loss_sensitivity_per_K * (T[:-1] - law.reference_C)
            gained = gained * np.clip(e, 0.0, band.tables.width_scale_max)
        gained = gained + np.maximum(viscous - soft * viscous_soften, 0.0)
        new = ambient_C + relax(time_s, tau, start_C - ambient_C, gained * per_joule)
        change = float(np.max(np.abs(new - T)))
        T = new
        if change < _TOLERANCE_K:
            break
    return T
