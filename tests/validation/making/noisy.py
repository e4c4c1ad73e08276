"""Group ``noisy``: ellipses with noise, hum, converter steps and stated errors."""

from __future__ import annotations

import numpy as np

from tests.validation.making.closed_form import plain
from tests.validation.making.sines import ENERGIES, MOTION, PI, STIFFNESSES, Ellipse, agreed_means, sampled
from tests.validation.making.standard_set import StandardSet

_LEAN = ("dynamic_stiffness_kN_per_mm", "storage_stiffness_kN_per_mm")
_LOSSES = ("loss_stiffness_kN_per_mm", "loss_factor")


def noisy_sets() -> list[StandardSet]:
    """Return the sets of the group."""
    return [_white(5e-4, 3e-3), _white(2e-3, 1e-2), _hum(), _steps(), _coarse(), _wire_steps()]


def _base(cycles: float = 20.4) -> tuple[Ellipse, list[np.ndarray]]:
    ellipse = Ellipse()
    return ellipse, list(sampled(ellipse, 100.0, cycles))


def _white(share: float, tolerance: float) -> StandardSet:
    """Return white noise on both channels.

    Of one cycle u(W_a) = π √(2/N) √((σ_F x_a)² + (σ_x F_a)²); the tolerance is some four of it over 20.
    """
    ellipse, (time_s, stroke, force) = _base()
    noise = np.random.default_rng(20261123)
    stroke = stroke + noise.normal(0.0, share * 2.0 * ellipse.amplitude_mm, stroke.size)
    force = force + noise.normal(0.0, share * 2.0 * ellipse.force_kN, force.size)
    per_mille = f"{1e3 * share:g}".replace(".", "-")
    return StandardSet(
        f"noisy/white-{per_mille}-per-mille",
        f"White noise of {100 * share:g} % of the range on stroke and force",
        "200 samples a cycle, 20 cycles. Extreme samples overreach; turning points are to be fitted.",
        agreed_means(
            ellipse,
            {
                ENERGIES: tolerance,
                MOTION: tolerance / 3,
                _LEAN: tolerance,
                _LOSSES: tolerance,
                ("tangent_stiffness_kN_per_mm", "secant_stiffness_kN_per_mm"): 5 * tolerance,
            },
        ),
        [(name, values, min(decimals, 4)) for name, values, decimals in plain(time_s, stroke, force)],
    )


def _hum() -> StandardSet:
    """Return a force with 0.6 kN of 50 Hz, sampled at 200 Hz."""
    ellipse = Ellipse()
    time_s, stroke, force = sampled(ellipse, 200.0, 8.4)
    force = force + 0.6 * np.sin(2.0 * PI * 50.0 * time_s + 0.7)
    return StandardSet(
        "noisy/hum-50-hertz",
        "Hum of the mains on the force, 0.6 kN",
        "400 samples a cycle; over a cycle of 2 s the hum is a whole number of periods and adds no area.",
        agreed_means(ellipse, {ENERGIES: 2e-3, MOTION: 1e-3, _LEAN: 2e-3, _LOSSES: 4e-3}),
        plain(time_s, stroke, force),
    )


def _steps() -> StandardSet:
    """Return a force of a converter with 1000 kN / 65536 steps and a stroke of 500 mm / 65536 steps."""
    ellipse, (time_s, stroke, force) = _base(6.4)
    return StandardSet(
        "noisy/converter-16-bit",
        "Steps of a 16 bit converter on both channels",
        "Steps of 7.6 µm and 15 N.",
        agreed_means(ellipse, {ENERGIES: 1e-3, MOTION: 1e-3, STIFFNESSES: 1e-2}),
        plain(time_s, _stepped(stroke, 500.0 / 65536), _stepped(force, 1000.0 / 65536)),
    )


def _coarse() -> StandardSet:
    """Return a stroke in steps of 0.1 mm and a force in steps of 0.1 kN, as display values are logged."""
    ellipse, (time_s, stroke, force) = _base(10.4)
    return StandardSet(
        "noisy/rounded-values",
        "Values rounded to 0.1 mm and 0.1 kN",
        "As a logger writes what a display shows.",
        agreed_means(ellipse, {ENERGIES: 5e-3, MOTION: 2e-3, _LEAN: 5e-3, _LOSSES: 5e-3}),
        [
            (name, values, decimals)
            for (name, values, _), decimals in zip(
                plain(time_s, _stepped(stroke, 0.1), _stepped(force, 0.1)), (6, 1, 1), strict=True
            )
        ],
    )


def _wire_steps() -> StandardSet:
    """Return held samples: the stroke is renewed every fourth sample only."""
    ellipse = Ellipse()
    time_s, stroke, force = sampled(ellipse, 400.0, 4.4)
    held = stroke[(np.arange(stroke.size) // 4) * 4]
    # A value that is held for four samples is on average 1.5 samples old, and the force leads by that.
    late_s = 1.5 / 400.0
    turned = Ellipse(delta=ellipse.delta + 2.0 * PI * ellipse.frequency_Hz * late_s)
    return StandardSet(
        "noisy/held-samples",
        "Stroke renewed every fourth sample",
        "Held values are 1.5 samples late on average; agreed are the figures of the record as it is.",
        agreed_means(turned, {ENERGIES: 3e-3, MOTION: 1e-3, _LEAN: 3e-3, _LOSSES: 5e-3}),
        plain(time_s, held, force),
    )


def _stepped(values: np.ndarray, step: float) -> np.ndarray:
    return step * np.round(values / step)
