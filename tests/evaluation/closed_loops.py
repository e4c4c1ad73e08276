"""Loops with known truth for the coverage study, and errors drawn from what the channels' facts say.

Nothing of the code under test is used here: truth is closed form (integrals of polynomials, and of
polynomials times a wave), errors are made from their physical descriptions (class, zero, hysteresis, smooth
deviation of a draw wire, noise, converter steps, skew, clock, thermometer).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Literal

import numpy as np
from numpy.polynomial import Polynomial

from bufferstand.evaluation.record.record import Temperature
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.signals import Floats

FORCE = ChannelUncertainty(accuracy_percent=0.5, reversibility_percent=0.75, zero=0.5, u_delay_s=2e-4)
WIRES = (
    ChannelUncertainty(linearity=0.5, zero=0.2, u_delay_s=0.0),
    ChannelUncertainty(linearity=0.5, zero=0.2, u_delay_s=0.0),
)
NOISE_KN, NOISE_MM = 0.15, 0.01
STEP_KN, STEP_MM = 9.5367431640625e-05, 500.0 / 65536.0
"""Converter steps of the force and of one draw wire."""
CLOCK_LIMIT = 1e-4
TEMPERATURE_C, TEMPERATURE_LIMIT_C = 21.0, 0.5
LOADING = Polynomial([20.0, 1.16, 0.0, 4.64e-4])
"""Loading branch: force [kN] over stroke [mm]."""


@dataclass(frozen=True)
class Progressive:
    """Progressive loading branch; unloading loses a share of the force that grows smoothly from the turns.

    ``harmonic``: a sine stroke low … high. ``static``: up and down at constant speed, with a rest between.
    """

    low_mm: float = 10.0
    high_mm: float = 80.0
    frequency_Hz: float = 0.5
    lost: float = 0.45
    kind: Literal["harmonic", "static"] = "harmonic"
    rest_s: float = 0.0

    @property
    def mean_mm(self) -> float:
        return 0.5 * (self.low_mm + self.high_mm)

    @property
    def half_mm(self) -> float:
        return 0.5 * (self.high_mm - self.low_mm)

    @property
    def peak_kN(self) -> float:  # noqa: N802 - the unit keeps its capitals
        """Largest force, where rising and falling are the same state."""
        return float(LOADING(self.high_mm))

    def loss(self) -> Polynomial:
        """Return the force lost on unloading over the stroke: nothing at the turns, most in the middle."""
        about = (Polynomial([0.0, 1.0]) - self.mean_mm) / self.half_mm
        return self.lost * LOADING * (1.0 - about**2)

    def slope(self, stroke_mm: float) -> float:
        return float(LOADING.deriv()(stroke_mm))

    def state(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Return the stroke, and whether it falls, at moments."""
        if self.kind == "harmonic":
            phase = np.mod(2.0 * np.pi * self.frequency_Hz * time_s, 2.0 * np.pi)
            return self.mean_mm - self.half_mm * np.cos(phase), phase > np.pi
        period = 1.0 / self.frequency_Hz
        way = np.mod(time_s, period + self.rest_s) / period
        up = np.where(way < 0.5, 2.0 * way, np.maximum(2.0 - 2.0 * way, 0.0))
        return self.low_mm + 2.0 * self.half_mm * up, way > 0.5

    def force(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Return the force, and whether it falls, at moments."""
        stroke, falling = self.state(time_s)
        return LOADING(stroke) - np.where(falling, self.loss()(stroke), 0.0), falling

    def first_harmonic(self) -> complex:
        """Return K* of the cycle without its rest."""
        if self.kind == "static":
            return self._of_triangle()
        in_cosine = Polynomial([self.mean_mm, -self.half_mm])
        cosine = Polynomial([0.0, 1.0])
        loading, lost = LOADING(in_cosine), self.loss()(in_cosine)
        # Both are polynomials in cos φ; the loss concerns the half period in which sin φ is negative.
        real = _mean_of_powers(loading * cosine) * 2.0 - _mean_of_powers(lost * cosine)
        imaginary = -_over(lost, -1.0, 1.0) / np.pi
        return complex(real, imaginary) / -self.half_mm

    def _of_triangle(self) -> complex:
        up = Polynomial([self.low_mm, 4.0 * self.half_mm])
        down = Polynomial([self.low_mm + 4.0 * self.half_mm, -4.0 * self.half_mm])
        force = _wave(LOADING(up), 0.0, 0.5) + _wave((LOADING - self.loss())(down), 0.5, 1.0)
        return force / (_wave(up, 0.0, 0.5) + _wave(down, 0.5, 1.0))

    def truth(self) -> dict[str, float]:
        low, high = self.low_mm, self.high_mm
        stored = _over(LOADING, low, high)
        absorbed = _over(self.loss(), low, high)
        stiffness = self.first_harmonic()
        omega = 2.0 * np.pi * self.frequency_Hz
        speed = omega * self.half_mm if self.kind == "harmonic" else 4.0 * self.half_mm * self.frequency_Hz
        grid = np.linspace(low, high, 100_001)
        return {
            "stored_energy_J": stored,
            "absorbed_energy_J": absorbed,
            "damping": absorbed / stored,
            "tangent_stiffness_kN_per_mm": self.slope(self.mean_mm),
            "secant_stiffness_kN_per_mm": float(LOADING(high) - LOADING(low)) / (high - low),
            "dynamic_stiffness_kN_per_mm": abs(stiffness),
            "storage_stiffness_kN_per_mm": stiffness.real,
            "loss_stiffness_kN_per_mm": stiffness.imag,
            "loss_factor": stiffness.imag / stiffness.real,
            "force_max_kN": float(LOADING(high)),
            "force_min_kN": float(np.min((LOADING - self.loss())(grid))),
            "stroke_min_mm": low,
            "stroke_max_mm": high,
            "prestress_mm": self.mean_mm,
            "amplitude_mm": self.half_mm,
            "frequency_Hz": self.frequency_Hz,
            "speed_loading_max_mm_per_s": speed,
            "speed_unloading_max_mm_per_s": speed,
            "temperature_start_C": TEMPERATURE_C,
            "temperature_max_C": TEMPERATURE_C,
        }


def _over(polynomial: Polynomial, first: float, last: float) -> float:
    whole = polynomial.integ()
    return float(whole(last) - whole(first))


def _mean_of_powers(polynomial: Polynomial) -> float:
    """Return the mean of a polynomial in cos φ over a period: ⟨cos²ᵏ⟩ = (2k over k) / 4ᵏ."""
    even = polynomial.coef[::2]
    return float(sum(c * comb(2 * k, k) / 4.0**k for k, c in enumerate(even)))


def _wave(polynomial: Polynomial, first: float, last: float) -> complex:
    """Return ∫ p(t) exp(-2πi t) dt, by parts."""
    rate = -2j * np.pi
    total, sign, derivative = 0j, 1.0, polynomial
    for order in range(polynomial.degree() + 1):
        for at, way in ((first, -1.0), (last, 1.0)):
            total += way * sign * derivative(at) * np.exp(rate * at) / rate ** (order + 1)
        sign, derivative = -sign, derivative.deriv()
    return complex(total)


def measured(
    loop: Progressive,
    random: np.random.Generator,
    *,
    cycles: float = 3.2,
    rate_Hz: float = 250.0,
    force: ChannelUncertainty = FORCE,
    wires: tuple[ChannelUncertainty, ...] = WIRES,
    noise: tuple[float, float] = (NOISE_KN, NOISE_MM),
    errors: np.random.Generator | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke and force as a chain with errors within the stated facts records them.

    ``errors``: what the channels' errors are drawn from, if other than noise and phase are. Runs whose errors
    come from generators of one seed were made with the same transducers.
    """
    shared = random if errors is None else errors
    period = 1.0 / loop.frequency_Hz + loop.rest_s
    time = np.arange(round(cycles * rate_Hz * period)) / rate_Hz
    clock = 1.0 + shared.uniform(-1.0, 1.0) * CLOCK_LIMIT
    # A static test starts and ends at rest; anything else anywhere.
    start = -random.uniform(0.2, 0.8) * loop.rest_s if loop.rest_s else random.uniform(0.0, period)
    true_time = time * clock + start
    skew = shared.normal(0.0, force.u_delay_s or 0.0)
    true_force, falling = loop.force(true_time - skew)
    peak = loop.peak_kN

    def within(limit: float | None) -> float:
        return float(shared.uniform(-1.0, 1.0)) * (limit or 0.0)

    reversal = 0.01 * within(force.reversibility_percent)
    recorded = true_force * (1.0 + 0.01 * within(force.accuracy_percent))
    recorded = recorded + np.where(falling, reversal * true_force * (1.0 - true_force / peak), 0.0)
    recorded = recorded + within(force.zero) + noise[0] * random.standard_normal(time.size)
    stroke, _ = loop.state(true_time)
    each_mm = noise[1] * np.sqrt(len(wires))
    read = []
    for wire in wires:
        one = stroke * (1.0 + 0.01 * within(wire.accuracy_percent))
        drum_mm = wire.drum_circumference_mm
        one = one + wire_deviation(stroke, wire.linearity or 0.0, shared, drum_mm) + within(wire.zero)
        read.append(_steps(one + each_mm * random.standard_normal(time.size), STEP_MM))
    return time, np.mean(read, axis=0), _steps(recorded, STEP_KN)


def thermometer(time_s: Floats, random: np.random.Generator) -> Temperature:
    """Return the readings of a sensor on the specimen with an error within its limit."""
    at = np.arange(0.0, float(time_s[-1]) + 1.0)
    read = TEMPERATURE_C + random.uniform(-1.0, 1.0) * TEMPERATURE_LIMIT_C
    return Temperature("temperature_1", at, np.full(at.size, read), accuracy_C=TEMPERATURE_LIMIT_C)


def _steps(value: Floats, step: float) -> Floats:
    return np.round(value / step) * step


def wire_deviation(
    stroke_mm: Floats, limit_mm: float, random: np.random.Generator, drum_mm: float | None = None
) -> Floats:
    """Return a smooth random deviation of a draw wire, 0 at contact: three waves of 240, 120 and 80 mm.

    With a drum, a fourth of its circumference. Amplitudes and phases are drawn so that the deviation at a
    stroke is normal with 0.46 of the limit.
    """
    total = np.zeros_like(stroke_mm)
    periods = (240.0, 120.0, 80.0) if drum_mm is None else (240.0, 120.0, 80.0, drum_mm)
    for period in periods:
        size = limit_mm * 0.46 * random.rayleigh() / np.sqrt(len(periods))
        angle = random.uniform(0.0, 2.0 * np.pi)
        total = total + size * (np.cos(2.0 * np.pi * stroke_mm / period + angle) - np.cos(angle))
    return total
