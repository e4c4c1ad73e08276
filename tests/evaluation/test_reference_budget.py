"""The reference budget (docs/facts/standards.md), source by source and all together, on its own loop.

The loop is rebuilt from what the table states: 20 to 600 kN over 100 mm and W_s 19.4 kJ make a line and a
cubic, whose forces and slopes at 25, 60 and 100 mm are those the table's zero errors give; W_a 9.36 kJ is a
constant share of the loading force, reached within a few millimetres of the upper turning point.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.uncertainty.error_model import draw_errors
from bufferstand.evaluation.uncertainty.monte_carlo import CyclePropagation, force_draws, slope_draws
from bufferstand.evaluation.uncertainty.noise import Noise
from bufferstand.evaluation.uncertainty.other_draws import cycle_draws
from bufferstand.foundation.channels.channel import ChannelUncertainty

NAMES = ("W_s", "W_a", "D", "F(25)", "F(60)", "F(100)", "K_t")
AT_STATED_STROKE = "K(50)"
"""The table's K_t, at a stroke that is a number; the cycle's own is at its mean stroke, as measured."""
ENERGY = ("stored_energy_J", "absorbed_energy_J", "damping")


@cache
def propagation(noise_kN: float, noise_mm: float) -> CyclePropagation:
    """Three cycles at 5 mm/s, 50 Hz."""
    up = np.arange(0.0, 100.0, 0.1)
    stroke = np.concatenate([np.concatenate((up, 200.0 - (up + 100.0)))] * 3 + [[0.0]])
    rising = np.concatenate([np.concatenate((up >= 0.0, up < 0.0))] * 3 + [[False]])
    loading = 20.0 + 1.16 * stroke + 4.64e-4 * stroke**3
    grid = np.linspace(0.0, 100.0, 20001)
    curve = (20.0 + 1.16 * grid + 4.64e-4 * grid**3) * (1.0 - np.exp(-(100.0 - grid) / 5.0))
    share = 9360.0 / float(np.trapezoid(curve, grid))
    force = np.where(rising, loading, loading * (1.0 - share * (1.0 - np.exp(-(100.0 - stroke) / 5.0))))
    record = make_record(np.arange(stroke.size) / 50.0, stroke, force)
    return CyclePropagation(record, find_cycles(record)[1], Noise(noise_kN, noise_mm))


def relative(
    *,
    noise: tuple[float, float] = (0.0, 0.0),
    wires: int = 1,
    stroke: dict[str, float] | None = None,
    **force: float,
) -> dict[str, float]:
    """Return standard uncertainties in per cent of the values."""
    loop = propagation(*noise)
    wire = ChannelUncertainty(**({"linearity": 0.0} | (stroke or {})))
    draws = draw_errors(ChannelUncertainty(**({"accuracy_percent": 0.0} | force)), (wire,) * wires, 20000, 11)
    assert draws is not None
    drawn = cycle_draws(draws, loop)
    columns = [drawn[name] for name in ENERGY]
    for first, last, at in ((22.5, 27.5, 25.0), (57.5, 62.5, 60.0), (97.5, 100.0, 100.0)):
        reading = loop.fit(at, first, last, 2)
        assert reading is not None
        columns.append(force_draws(draws, reading))
    columns.append(drawn["tangent_stiffness_kN_per_mm"])
    stated = loop.read(50.0, 15.0)
    assert stated is not None
    columns.append(slope_draws(draws, stated))
    names = (*NAMES, AT_STATED_STROKE)
    return {n: 100.0 * float(np.std(c) / abs(np.mean(c))) for n, c in zip(names, columns, strict=True)}


def agrees(
    found: dict[str, float], expected: tuple[float | None, ...], rel: float, least: float = 0.0
) -> None:
    for name, value in zip(NAMES, expected, strict=True):
        if value is not None:
            assert found[name] == pytest.approx(value, rel=rel, abs=least), (name, found)


def test_the_loop_is_the_reference_loop() -> None:
    loop = propagation(0.0, 0.0).loop
    stored = float(np.trapezoid(loop.force_kN[loop.loading], loop.stroke_mm[loop.loading]))
    assert stored == pytest.approx(19400.0, rel=1e-3)
    closed = float(np.trapezoid(loop.force_kN, loop.stroke_mm))
    assert closed == pytest.approx(9360.0, rel=3e-3)


def test_all_sources_of_the_base_case() -> None:
    """Class 1, reversibility 1.5 %, zero 1 kN, one wire of ±0.5 mm with ±0.2 mm zero, noise, skew 1 ms."""
    found = relative(
        noise=(0.5, 0.02),
        stroke={"linearity": 0.5, "zero": 0.2},
        accuracy_percent=1.0,
        zero=1.0,
        reversibility_percent=1.5,
        u_delay_s=1e-3,
    )
    agrees(found, (0.9, 1.05, 0.73, 1.8, 1.5, 1.1, 1.8), rel=0.15)


def test_force_scale() -> None:
    agrees(relative(accuracy_percent=1.0), (0.58, 0.58, 0.0, 0.58, 0.58, 0.58, 0.58), rel=0.03, least=1e-4)


def test_force_zero() -> None:
    agrees(relative(zero=1.0), (0.30, 0.0, 0.30, 1.0, 0.3, 0.1, 0.0), rel=0.05, least=1e-3)


def test_reversibility() -> None:
    agrees(relative(reversibility_percent=1.5), (0.0, 0.62, 0.62, 0.0, 0.0, 0.0, 0.0), rel=0.15, least=1e-4)


def test_linearity() -> None:
    found = relative(stroke={"linearity": 0.5})
    agrees(found, (0.65, 0.64, 0.15, 1.0, 1.3, 0.9, 1.7), rel=0.15)
    assert found[AT_STATED_STROKE] == pytest.approx(1.7, rel=0.15)


def test_stroke_zero() -> None:
    """It moves the branch under a stated stroke, but not under the cycle's mean stroke, which moves along."""
    found = relative(stroke={"linearity": 0.0, "zero": 0.2})
    agrees(found, (0.0, 0.0, 0.0, 0.42, 0.38, 0.29, 0.0), rel=0.06, least=1e-4)
    assert found[AT_STATED_STROKE] == pytest.approx(0.33, rel=0.06)


def test_skew() -> None:
    """2 v τ (F_max - F_min); W_s moves with it, so that damping moves less than the table's 0.06."""
    found = relative(u_delay_s=1e-3)
    agrees(found, (None, 0.06, None, None, None, None, None), rel=0.15)
    assert found["W_s"] < 0.02
    assert max(found["F(25)"], found["F(60)"], found["F(100)"], found["K_t"]) < 0.02


@pytest.mark.parametrize(
    ("scale", "reversibility", "linearity", "expected"),
    [
        (1.0, 1.5, 1.25, (1.3, 1.4, 0.77, 2.3, 2.3, 1.6, 3.0)),
        (0.5, 0.75, 0.5, (0.56, 0.66, 0.42, 1.3, 1.0, 0.8, 1.2)),
        (0.5, 0.75, 0.1, (0.35, 0.48, 0.39, 1.0, 0.5, 0.4, 0.4)),
    ],
    ids=["class 1, 0.25 %, 2 wires", "class 0.5, 0.1 %, 2 wires", "class 0.5, wires to 0.1 mm"],
)
def test_other_lines(
    scale: float, reversibility: float, linearity: float, expected: tuple[float, ...]
) -> None:
    """Damping within 15 %, the rest within 30 %: their zeros are not stated and taken as in the base."""
    found = relative(
        noise=(0.5, 0.02),
        wires=2,
        stroke={"linearity": linearity, "zero": 0.2},
        accuracy_percent=scale,
        zero=1.0,
        reversibility_percent=reversibility,
        u_delay_s=1e-3,
    )
    assert found["D"] == pytest.approx(expected[2], rel=0.15)
    agrees(found, expected, rel=0.30)
