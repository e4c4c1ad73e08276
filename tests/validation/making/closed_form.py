"""Group ``closed-form``: loops whose every figure is a closed form, without noise."""

from __future__ import annotations

import numpy as np

from tests.validation.making.sines import (
    ENERGIES,
    FORCES,
    MOTION,
    PI,
    STIFFNESSES,
    Ellipse,
    agreed_means,
    sampled,
)
from tests.validation.making.standard_set import (
    Agreed,
    FloatArray,
    StandardSet,
    complete_cycles,
    summary,
)

TIME, STROKE, FORCE = "time [s]", "stroke [mm]", "force [kN]"


def plain(time_s: FloatArray, stroke: FloatArray, force: FloatArray) -> list[tuple[str, FloatArray, int]]:
    """Return the columns of a plain record."""
    return [(TIME, time_s, 6), (STROKE, stroke, 5), (FORCE, force, 5)]


def closed_form_sets() -> list[StandardSet]:
    """Return the sets of the group."""
    return [
        *(_ellipse(samples, share) for samples, share in ((20, 5e-3), (100, 5e-4), (1000, 1e-4))),
        _wide(),
        _elastic(),
        _two_sided(),
        _harmonics(),
        _parallelogram(),
        _progressive(),
        _relaxing(),
    ]


def _ellipse(samples: int, share: float) -> StandardSet:
    ellipse = Ellipse()
    time_s, stroke, force = sampled(ellipse, samples * ellipse.frequency_Hz, 4.6)
    return StandardSet(
        f"closed-form/ellipse-{samples}",
        f"Ellipse, {samples} samples a cycle",
        "Sine stroke, linear viscoelastic force. Begins and ends within a cycle.",
        [
            *agreed_means(
                ellipse, {ENERGIES: share, STIFFNESSES: 4 * share, FORCES: 4 * share, MOTION: share}
            ),
            summary("frequency_Hz", ellipse.frequency_Hz, "f", share=share),
            summary("stroke_distortion", 0.0, "a pure sine", absolute=10 * share),
        ],
        plain(time_s, stroke, force),
    )


def _wide() -> StandardSet:
    """Return an ellipse that loses much: sin δ = 0.5."""
    ellipse = Ellipse(
        mean_mm=20.0, amplitude_mm=5.0, frequency_Hz=2.5, mean_kN=40.0, force_kN=25.0, delta=PI / 6
    )
    time_s, stroke, force = sampled(ellipse, 1000.0, 5.5, 0.1)
    return StandardSet(
        "closed-form/ellipse-wide",
        "Wide ellipse at 2.5 Hz, δ = 30°",
        "Loss factor 0.577; 400 samples a cycle.",
        agreed_means(ellipse, {ENERGIES: 1e-4, STIFFNESSES: 1e-3, FORCES: 1e-3, MOTION: 1e-4}),
        plain(time_s, stroke, force),
    )


def _elastic() -> StandardSet:
    ellipse = Ellipse(delta=0.0)
    time_s, stroke, force = sampled(ellipse, 200.0, 4.6)
    stored = ellipse.values()["stored_energy_J"]
    return StandardSet(
        "closed-form/elastic",
        "Spring without loss",
        "The loop encloses no area: what is found of it is the method's own error.",
        [
            summary("absorbed_energy_J", 0.0, "no loss", absolute=2e-5 * stored[0]),
            summary("damping", 0.0, "no loss", absolute=2e-5),
            summary("stored_energy_J", *stored, share=1e-5),
        ],
        plain(time_s, stroke, force),
    )


def _two_sided() -> StandardSet:
    """Return a damper that pulls as it pushes: area and harmonics count, damping says nothing."""
    ellipse = Ellipse(mean_mm=0.0, amplitude_mm=25.0, frequency_Hz=1.0, mean_kN=0.0, force_kN=8.0, delta=1.3)
    time_s, stroke, force = sampled(ellipse, 500.0, 5.2)
    names = ("storage_stiffness_kN_per_mm", "loss_stiffness_kN_per_mm", "dynamic_stiffness_kN_per_mm")
    return StandardSet(
        "closed-form/two-sided",
        "Two-sided damper",
        "Force and stroke change sign; the loop area exceeds the stored energy.",
        [
            *agreed_means(ellipse, {("absorbed_energy_J",): 1e-4, names: 1e-4}),
            summary("amplitude_mm", 25.0, "x_a", share=1e-4),
        ],
        plain(time_s, stroke, force),
        specimen={"kind": "draw-gear", "max_stroke_mm": 30.0},
    )


def _harmonics() -> StandardSet:
    """Return a distorted stroke with a force that is a parabola of it and a part in phase with its speed.

    x = x_m + x_a (-cos θ + b cos 2θ), F = F_m + k u + q u² + c dx/dθ with u = x - x_m.
    W_a = c ∫ (dx/dθ)² dθ = c π x_a² (1 + 4 b²).
    """
    mean, a, b, f_hz = 30.0, 10.0, 0.05, 1.0
    k, q, c, f_m = 3.0, 0.03, 0.4, 60.0
    count, rate = 2300, 500.0
    time_s = np.arange(count) / rate
    theta = 2.0 * PI * (f_hz * time_s + 0.25)
    u = a * (-np.cos(theta) + b * np.cos(2.0 * theta))
    rate_of = a * (np.sin(theta) - 2.0 * b * np.sin(2.0 * theta))
    force = f_m + k * u + q * u**2 + c * rate_of
    low, high = a * (-1.0 + b), a * (1.0 + b)
    absorbed = c * PI * a**2 * (1.0 + 4.0 * b**2)
    # The half cycle from θ = 0 to π: ∫ (dx/dθ)² over it is one half of that over the cycle.
    stored = f_m * (high - low) + k * (high**2 - low**2) / 2 + q * (high**3 - low**3) / 3 + absorbed / 2
    return StandardSet(
        "closed-form/distorted",
        "Distorted stroke with 5 % of second harmonic",
        "Progressive force with a part in phase with the speed. Range and mean are those of the turns.",
        [
            summary("absorbed_energy_J", absorbed, "c π x_a² (1 + 4 b²)", share=1e-4),
            summary("stored_energy_J", stored, "∫ F dx from θ = 0 to π", share=1e-4),
            summary("damping", absorbed / stored, "W_a / W_s", share=1e-4),
            summary("amplitude_mm", a, "half the range: x_a", share=1e-4),
            summary("prestress_mm", mean + a * b, "mean of the turning points: x_m + b x_a", share=1e-4),
            summary("stroke_distortion", b, "second over first harmonic", absolute=2e-3),
        ],
        plain(time_s, mean + u, force),
    )


def triangle(time_s: FloatArray, low: float, high: float, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return a triangular stroke that begins at its lower turn, and whether it rises."""
    phase = (time_s / period_s) % 1.0
    rising = phase < 0.5
    return low + (high - low) * np.where(rising, 2.0 * phase, 2.0 - 2.0 * phase), rising


def _parallelogram() -> StandardSet:
    """Return a spring with dry friction: F = F_0 + k (x - x_0) ± F_r; W_a = 2 F_r (x_1 - x_0)."""
    low, high, period, base, k, friction = 10.0, 50.0, 16.0, 60.0, 2.5, 12.0
    time_s = np.arange(round(4.6 * period * 40.0)) / 40.0
    stroke, rising = triangle(time_s + 0.3 * period, low, high, period)
    force = base + k * (stroke - low) + np.where(rising, friction, -friction)
    span = high - low
    stored = (base + friction) * span + 0.5 * k * span**2
    absorbed = 2.0 * friction * span
    return StandardSet(
        "closed-form/parallelogram",
        "Dry friction: the force jumps at the turns",
        "Triangular stroke, sharp turns. The force at a turn is that of the loading branch's own end.",
        [
            summary("absorbed_energy_J", absorbed, "2 F_r (x_1 - x_0)", share=2e-3),
            summary("stored_energy_J", stored, "∫ F dx of the loading branch", share=5e-4),
            summary("damping", absorbed / stored, "W_a / W_s", share=2e-3),
            summary("secant_stiffness_kN_per_mm", k, "loading branch, end to end: k", share=5e-3),
            summary("tangent_stiffness_kN_per_mm", k, "k", share=1e-3),
            summary("force_max_kN", base + friction + k * span, "F_0 + F_r + k (x_1 - x_0)", share=2e-3),
            summary("stroke_max_mm", high, "x_1", absolute=0.01),
            summary("stroke_min_mm", low, "x_0", absolute=0.01),
        ],
        plain(time_s, stroke, force),
    )


def _progressive() -> StandardSet:
    """Return F_l = 20 + x + 0.0005 x³, less c (x - x_0)(x_1 - x) unloading: W_a = c (x_1 - x_0)³ / 6."""
    low, high, period, c = 5.0, 85.0, 32.0, 0.05
    time_s = np.arange(round(4.7 * period * 25.0)) / 25.0
    stroke, rising = triangle(time_s + 0.2 * period, low, high, period)
    upper = 20.0 + stroke + 5e-4 * stroke**3
    force = np.where(rising, upper, upper - c * (stroke - low) * (high - stroke))
    stored = 20.0 * (high - low) + (high**2 - low**2) / 2.0 + 5e-4 * (high**4 - low**4) / 4.0
    absorbed = c * (high - low) ** 3 / 6.0
    mean = 0.5 * (low + high)
    ends = [20.0 + x + 5e-4 * x**3 for x in (low, high)]
    return StandardSet(
        "closed-form/progressive",
        "Progressive spring on a triangular stroke",
        "Cubic loading branch; both branches meet at the turns. 800 samples a cycle.",
        [
            summary("stored_energy_J", stored, "∫ (20 + x + 0.0005 x³) dx", share=2e-4),
            summary("absorbed_energy_J", absorbed, "c (x_1 - x_0)³ / 6", share=5e-4),
            summary("damping", absorbed / stored, "W_a / W_s", share=5e-4),
            summary("tangent_stiffness_kN_per_mm", 1.0 + 1.5e-3 * mean**2, "1 + 0.0015 x_m²", share=1e-3),
            summary("secant_stiffness_kN_per_mm", (ends[1] - ends[0]) / (high - low), "ends", share=1e-3),
            summary("force_max_kN", ends[1], "F_l(x_1)", share=2e-3),
            summary("force_min_kN", _least(low, high, c), "least of the unloading branch", absolute=0.4),
        ],
        plain(time_s, stroke, force),
    )


def _least(low: float, high: float, c: float) -> float:
    stroke = np.linspace(low, high, 200_001)
    return float(np.min(20.0 + stroke + 5e-4 * stroke**3 - c * (stroke - low) * (high - stroke)))


def _relaxing() -> StandardSet:
    """Return cycles that dwell 2 s at the top while the force relaxes from F_l to F_l - 15 kN.

    Unloading is 15 kN below loading, but for the last 10 mm, where it joins it: the dwell at constant stroke
    adds no area. W_a = 15 (x_1 - x_0) - 15 · 10 / 2.
    """
    low, high, ramp, dwell, drop, join = 10.0, 60.0, 8.0, 2.0, 15.0, 10.0
    period = 2.0 * ramp + dwell
    rate = 50.0
    time_s = np.arange(round(4.5 * period * rate)) / rate
    phase = (time_s + 0.25 * period) % period
    rising, resting = phase < ramp, (phase >= ramp) & (phase < ramp + dwell)
    share = np.where(rising, phase / ramp, np.where(resting, 1.0, (period - phase) / ramp))
    stroke = low + (high - low) * share
    upper = 25.0 + 3.0 * (stroke - low)
    relaxed = drop * (1.0 - np.exp(-(phase - ramp) / 0.4)) / (1.0 - np.exp(-dwell / 0.4))
    below = drop * np.clip((stroke - low) / join, 0.0, 1.0)
    force = np.where(rising, upper, np.where(resting, upper - relaxed, upper - below))
    span = high - low
    stored = 25.0 * span + 1.5 * span**2
    absorbed = drop * span - 0.5 * drop * join
    agreed: list[Agreed] = [
        summary("stored_energy_J", stored, "∫ F_l dx", share=5e-4),
        summary("absorbed_energy_J", absorbed, "15 (x_1 - x_0) - 75", share=2e-3),
        summary("damping", absorbed / stored, "W_a / W_s", share=2e-3),
        summary("force_max_kN", 25.0 + 3.0 * span, "F_l(x_1), before it relaxes", share=2e-3),
        summary("secant_stiffness_kN_per_mm", 3.0, "loading branch, end to end", share=5e-3),
        complete_cycles(3, "lower turns on record: 4"),
    ]
    return StandardSet(
        "closed-form/relaxing-dwell",
        "Dwell at the top while the force relaxes",
        "A fall of the force at constant stroke adds no area; the greatest force is that before the dwell.",
        agreed,
        plain(time_s, stroke, force),
    )
