"""The families that runs are compared with, each with its parameters (sources: docs/families.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.families.band_laws import berg, bouc_wen, eq_4, eq_4_with_return_points
from bufferstand.model.families.data import GRID_TAU_S, FamilyData
from bufferstand.model.families.family import Branches, Family, Values, kept
from bufferstand.model.identification import LAWS, NAMES, Law
from bufferstand.model.spring import ViscousBranch

Floats = NDArray[np.float64]

_MAXWELL_TAU_S = (GRID_TAU_S[3], GRID_TAU_S[5], GRID_TAU_S[7], GRID_TAU_S[9])
_LENGTH = Law("length_mm", "mm", "x_0", "log", 4.0, 0.2, 60.0, 1.0, 4.0)


def _ours(name: str) -> Law:
    return LAWS[NAMES.index(name)]


def _none(_: Values, __: FamilyData) -> Branches:
    return np.empty(0), np.empty((0, 0))


def _kelvin_voigt(values: Values, data: FamilyData) -> Branches:
    # A share of 1 that lags by c v: c F'(x) v for the small times that damp a spring.
    return np.array([1.0]), (values["retardation_s"] * data.speed_mm_per_s)[None]


def _maxwell(values: Values, data: FamilyData) -> Branches:
    shares = np.array([values[f"share_{tau_s:.2g}_s"] for tau_s in _MAXWELL_TAU_S])
    return shares, data.grid_lags[[3, 5, 7, 9]]


def _fractional(values: Values, data: FamilyData) -> Branches:
    return values["share"] * cole_cole(values["order"], values["tau_s"]), data.grid_lags


def cole_cole(order: float, tau_s: float) -> Floats:
    """Return the shares of the grid's branches that make a fractional Zener element, shape (13,).

    Relaxation spectrum over ln tau: sin(pi a) / (2 pi (cosh(a ln(tau / tau_0)) + cos(pi a))), whose
    sum is about 1.
    """
    u = np.log(np.array(GRID_TAU_S) / tau_s)
    density = np.sin(np.pi * order) / (2.0 * np.pi * (np.cosh(order * u) + np.cos(np.pi * order)))
    return np.asarray(density * np.log(GRID_TAU_S[1] / GRID_TAU_S[0]), dtype=np.float64)


def _lag(values: Values, data: FamilyData) -> Floats:
    tau_s = values["tau_s"]
    return kept(data, "lag", [tau_s], lambda: data.lag(tau_s))[None]


def _own(values: Values, data: FamilyData) -> Branches:
    return np.array([values["beta"]]), _lag(values, data)


def _own_and_spectrum(values: Values, data: FamilyData) -> Branches:
    share = ViscousBranch(spectrum_per_decade=values["spectrum_per_decade"]).spectrum_share
    lags = np.concatenate([_lag(values, data), data.spectrum_lags])
    return np.array([values["beta"], *[share] * len(data.spectrum_lags)]), lags


_OWN = tuple(_ours(name) for name in ("transition_length_mm", "beta", "tau_s"))

FAMILIES = (
    Family(
        "kelvin-voigt",
        "Kelvin-Voigt on a nonlinear spring",
        (Law("retardation_s", "s", "c", "log", 0.02, 1e-4, 2.0, 1.0, 0.02),),
        _kelvin_voigt,
    ),
    Family(
        "maxwell",
        "generalised Maxwell on a nonlinear spring, four branches",
        tuple(
            Law(f"share_{tau_s:.2g}_s", "", f"beta({tau_s:.2g} s)", "linear", 0.1, 0.0, 3.0, 0.1, 0.0)
            for tau_s in _MAXWELL_TAU_S
        ),
        _maxwell,
    ),
    Family(
        "fractional-zener",
        "fractional Zener on a nonlinear spring",
        (
            Law("share", "", "beta", "linear", 0.8, 0.0, 6.0, 0.3, 0.0),
            Law("order", "", "alpha", "linear", 0.4, 0.08, 0.98, 0.2, 0.4),
            Law("tau_s", "s", "tau", "log", 1.0, 2e-3, 500.0, 1.5, 1.0),
        ),
        _fractional,
    ),
    Family(
        "berg",
        "Berg: friction and a Maxwell branch on a nonlinear spring",
        (_LENGTH, _ours("beta"), _ours("tau_s")),
        _own,
        band=lambda values, data: berg(data, values["length_mm"]),
    ),
    Family(
        "bouc-wen",
        "Bouc-Wen on a nonlinear spring",
        (
            _LENGTH,
            Law("sharpness", "", "n", "log", 1.0, 0.2, 10.0, 0.7, 1.0),
            Law("asymmetry", "", "gamma", "linear", 0.0, -0.5, 0.5, 0.3, 0.0),
        ),
        _none,
        band=lambda values, data: bouc_wen(
            data, values["length_mm"], values["sharpness"], values["asymmetry"]
        ),
    ),
    Family("ours", "eq. (4) with a viscous branch", _OWN, _own, by_tables=eq_4),
    Family(
        "ours-spectrum",
        "eq. (4) with a viscous branch and a flat spectrum",
        (*_OWN, _ours("spectrum_per_decade")),
        _own_and_spectrum,
        by_tables=eq_4,
    ),
    Family(
        "ours-return-points",
        "eq. (4) with return-point memory, branch and spectrum",
        (*_OWN, _ours("spectrum_per_decade")),
        _own_and_spectrum,
        by_tables=eq_4_with_return_points,
    ),
)
"""In the order in which they are fitted and shown."""
