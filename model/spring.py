"""The spring model as one set of facts: curves, temperature law, heat and viscous branch.

Symbols: T_ref, c_ts, alpha of eq. (5); C, lambda, T_0 of eqs. (6), (7); c_eta, beta, tau are ours
(``docs/model.md``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.fit_uncertainty import FitUncertainty
from bufferstand.model.identified_range import IdentifiedRange
from bufferstand.model.tables import BandTables

NO_TIME = 1e-12
"""Durations below this share of a time constant are none: their quotients would be 0/0."""

SPECTRUM_TAU_S = tuple(1.6e-3 * 10.0 ** (0.25 + 0.5 * j) for j in range(6))
"""Relaxation times [s] of the flat spectrum: the middles of half decades from 1.6 ms to 1.6 s."""
_SPECTRUM_DECADES = 0.5  # that each of them stands for

HeatRule = Literal["loop-exact", "paper"]
"""``loop-exact``: from the free energy of the hysteresis, never negative; ``paper``: eq. (8)."""


def _demand(place: str, value: float, *, above: float | None = None, least: float | None = None) -> None:
    if (
        not math.isfinite(value)
        or (above is not None and value <= above)
        or (least is not None and value < least)
    ):
        bound = f"above {above:g}" if above is not None else f"{least:g} or more"
        raise BadInput(f"must be {bound}, got {value:g}", place=place)


@dataclass(frozen=True)
class TemperatureLaw:
    """How force and loss depend on the spring's temperature.

    Both curves are scaled by eq. (5), ``s = 1 - c_ts (T - T_ref) (1 - exp(-x / alpha))``; the softening
    ``c_ts (T - T_ref)`` goes no further than ``1 - floor``. The width between them is also scaled by
    ``e = 1 - c_eta (T - T_ref)``, not below 0.

    Parameters
    ----------
    reference_C : float
        T_ref of the curves [°C].
    sensitivity_per_K : float
        c_ts [1/K].
    depth_mm : float
        alpha [mm].
    loss_sensitivity_per_K : float
        c_eta [1/K]; 0 is the paper's law, which cannot lower the damping of a warm spring.
    floor : float
        Least s; eq. (5) alone falls to zero force at T_ref + 1/c_ts.
    valid_C : tuple of float, optional
        Lowest and highest temperature at which the law was identified.

    Raises
    ------
    BadInput
        If a parameter lies outside its range.
    """

    reference_C: float = 25.0
    sensitivity_per_K: float = 0.0
    depth_mm: float = 20.0
    loss_sensitivity_per_K: float = 0.0
    floor: float = 0.05
    valid_C: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        _demand("temperature.sensitivity_per_K", self.sensitivity_per_K, least=0.0)
        _demand("temperature.loss_sensitivity_per_K", self.loss_sensitivity_per_K, least=0.0)
        _demand("temperature.depth_mm", self.depth_mm, above=0.0)
        if not 0.0 < self.floor <= 1.0:
            raise BadInput(f"must lie above 0 and not above 1, got {self.floor:g}", place="temperature.floor")
        if self.valid_C is not None and not self.valid_C[0] <= self.valid_C[1]:
            raise BadInput("the first temperature must not exceed the second", place="temperature.valid_C")

    @property
    def softest(self) -> float:
        """The largest softening, 1 - floor."""
        return 1.0 - self.floor

    @property
    def spent_K(self) -> float:  # noqa: N802 - the unit's own letter
        """How much above the reference the softening ends [K]; infinite where there is none."""
        return self.softest / self.sensitivity_per_K if self.sensitivity_per_K > 0.0 else math.inf

    def softening(self, temperature_C: ArrayLike) -> NDArray[np.float64]:
        """Return c_ts (T - T_ref), at most the softest, so that ``s = 1 - softening * depth``; same shape."""
        warmer = np.asarray(temperature_C, dtype=np.float64) - self.reference_C
        return np.minimum(self.sensitivity_per_K * warmer, self.softest)

    def warning(self, lowest_C: float, highest_C: float) -> str | None:
        """Return a sentence if temperatures were met at which the law was not identified, else None."""
        if self.valid_C is None or (self.valid_C[0] <= lowest_C and highest_C <= self.valid_C[1]):
            return None
        return (
            f"temperatures of {lowest_C:.1f} … {highest_C:.1f} °C leave the {self.valid_C[0]:g} … "
            f"{self.valid_C[1]:g} °C for which the model was identified"
        )


@dataclass(frozen=True)
class HeatBalance:
    """Where the lost energy goes: one thermal mass (eqs. (6), (7)) and a sensor on it.

    Parameters
    ----------
    capacity_J_per_K : float
        C [J/K].
    loss_W_per_K : float
        lambda [W/K]; 0 is a perfectly insulated spring.
    rule : HeatRule
        How the lost energy of a step is counted.
    sensor_lag_s : float
        Time constant with which the sensor follows [s]; 0 is none.
    sensor_gain : float
        Share of the excess over the ambient that the sensor's place reaches.

    Raises
    ------
    BadInput
        If a parameter lies outside its range.
    """

    capacity_J_per_K: float
    loss_W_per_K: float = 0.0
    rule: HeatRule = "loop-exact"
    sensor_lag_s: float = 0.0
    sensor_gain: float = 1.0

    def __post_init__(self) -> None:
        _demand("heat.capacity_J_per_K", self.capacity_J_per_K, above=0.0)
        _demand("heat.loss_W_per_K", self.loss_W_per_K, least=0.0)
        _demand("heat.sensor_lag_s", self.sensor_lag_s, least=0.0)
        _demand("heat.sensor_gain", self.sensor_gain, least=0.0)

    def response(self, duration_s: float) -> tuple[float, float]:
        """Return share of the way to the ambient, and K per W, after ``duration_s`` of constant power.

        Eq. (7) as ``T1 = T - share (T - T_0) + per_watt Q``; both factors are finite for lambda = 0.
        """
        if self.loss_W_per_K == 0.0:
            return 0.0, duration_s / self.capacity_J_per_K
        share = -math.expm1(-self.loss_W_per_K * duration_s / self.capacity_J_per_K)
        return share, share / self.loss_W_per_K

    def step_factors(self, duration_s: float) -> tuple[float, float, float]:
        """Return share of the way to the ambient, K per J, and the share of its way that the sensor goes."""
        share, per_watt = self.response(duration_s)
        per_joule = per_watt / duration_s if duration_s > 0.0 else 1.0 / self.capacity_J_per_K
        follow = -math.expm1(-duration_s / self.sensor_lag_s) if self.sensor_lag_s > 0.0 else 1.0
        return share, per_joule, follow


@dataclass(frozen=True)
class ViscousBranch:
    """Overstress ``beta (F_m(x) - F_m(xi))`` whose inner stroke follows with ``xi' = (x - xi) / tau``.

    F_m = (F_l + F_u) / 2 falls nowhere, so that the branch can lose energy but never create it.
    A flat spectrum adds branches of the same form at the fixed times ``SPECTRUM_TAU_S``, all of one size:
    the force of a fast stroke then rises evenly with the logarithm of its frequency.

    Parameters
    ----------
    beta : float
        Share of the middle curve's force that an infinitely fast stroke adds; 0 is none.
    tau_s : float
        Relaxation time [s].
    spectrum_per_decade : float
        b: share that each decade of relaxation times from 1.6 ms to 1.6 s adds; 0 is no spectrum.

    Raises
    ------
    BadInput
        If a parameter lies outside its range.
    """

    beta: float = 0.0
    tau_s: float = 1.0
    spectrum_per_decade: float = 0.0

    def __post_init__(self) -> None:
        _demand("viscous.beta", self.beta, least=0.0)
        _demand("viscous.tau_s", self.tau_s, above=0.0)
        _demand("viscous.spectrum_per_decade", self.spectrum_per_decade, least=0.0)

    @property
    def spectrum_share(self) -> float:
        """Share of the middle curve's force that each branch of the spectrum adds."""
        return _SPECTRUM_DECADES * self.spectrum_per_decade

    @cached_property
    def branches(self) -> tuple[tuple[float, float], ...]:
        """Share and relaxation time [s] of each branch that is there: the own one, then the spectrum's."""
        own = ((self.beta, self.tau_s),) if self.beta > 0.0 else ()
        if self.spectrum_per_decade == 0.0:
            return own
        return own + tuple((self.spectrum_share, tau_s) for tau_s in SPECTRUM_TAU_S)

    def response(self, duration_s: float) -> tuple[float, float]:
        """Return factors (kept, added) of ``lag1 = kept lag0 + added dx`` for a stroke linear in time."""
        return _relaxation(self.tau_s, duration_s)

    def responses(self, duration_s: float) -> tuple[tuple[float, float], ...]:
        """Return :meth:`response` of each of :attr:`branches`."""
        return tuple(_relaxation(tau_s, duration_s) for _, tau_s in self.branches)


def _relaxation(tau_s: float, duration_s: float) -> tuple[float, float]:
    if duration_s <= NO_TIME * tau_s:
        return 1.0, 1.0
    share = -math.expm1(-duration_s / tau_s)
    return 1.0 - share, share * tau_s / duration_s


@dataclass(frozen=True)
class SpringModel:
    """A buffer's or draw gear's spring: everything that the simulation, prediction and export need.

    Parameters
    ----------
    name : str
        What it is.
    curves : Curves
        Envelope and transition at ``temperature.reference_C``.
    temperature, heat, viscous
        The three laws beside it.
    origin : str
        How the figures were obtained.
    sense : str
        What positive stroke and force are of this specimen: ``compression`` (buffer) or ``extension``.
    identified : IdentifiedRange, optional
        Where it was identified; None if nobody says.
    fit : FitUncertainty, optional
        How well the fit knows its parameters; None if nobody says.

    Raises
    ------
    BadInput
        If the curves end before the stroke at which the model was identified.
    """

    name: str
    curves: Curves
    temperature: TemperatureLaw
    heat: HeatBalance
    viscous: ViscousBranch = ViscousBranch()
    origin: str = ""
    sense: Literal["compression", "extension"] = "compression"
    identified: IdentifiedRange | None = None
    fit: FitUncertainty | None = None

    def __post_init__(self) -> None:
        if self.identified is not None:
            self.identified.check(self.curves)

    @property
    def stated_fit(self) -> FitUncertainty:
        """How well the fit knows its parameters.

        Raises
        ------
        BadInput
            If nobody says.
        """
        if self.fit is None:
            raise BadInput(
                f"the model “{self.name}” does not say how well it is known",
                place="fit",
                remedy="fit it again from its runs (model fit): the file then has [fit]",
            )
        return self.fit

    def width_scale(self, temperature_C: ArrayLike) -> NDArray[np.float64]:
        """Return e = 1 - c_eta (T - T_ref), between 0 and what leaves F_u >= 0; same shape."""
        law = self.temperature
        warmer = np.asarray(temperature_C, dtype=np.float64) - law.reference_C
        return np.clip(1.0 - law.loss_sensitivity_per_K * warmer, 0.0, self.tables.width_scale_max)

    def warnings(self, lowest_C: float, highest_C: float) -> tuple[str, ...]:
        """Return what must be known of figures that this model gives between two temperatures [°C]."""
        found = [self.temperature.warning(lowest_C, highest_C)]
        if self.tables.energy_source_mm is not None:
            found.append(
                f"small loops about {self.tables.energy_source_mm:.2f} mm create energy: eq. (4) is not "
                "passive on these curves, whose transition changes too fast there"
            )
        return tuple(sentence for sentence in found if sentence is not None)

    def warnings_of(
        self,
        time_s: NDArray[np.float64],
        stroke_mm: NDArray[np.float64],
        temperature_C: NDArray[np.float64],
    ) -> tuple[str, ...]:
        """Return what must be known of figures along a history of strokes and temperatures, shape (n,)."""
        found = self.warnings(float(temperature_C.min()), float(temperature_C.max()))
        if self.identified is None:
            return found
        return (*found, *self.identified.warnings(self.curves, time_s, stroke_mm))

    @property
    def statements(self) -> tuple[str, ...]:
        """Where the model was identified and what stands beyond, in words; empty if nobody says."""
        return () if self.identified is None else self.identified.statements(self.curves)

    @cached_property
    def tables(self) -> BandTables:
        """The curves on a fine uniform grid, as the exact step needs them; made once."""
        return BandTables.of(self.curves, self.temperature.depth_mm)
