"""What a skew does to the damping: the law that a polled run states, beside simulated loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.poll_skew import damping_error
from bufferstand.model.file import load_model
from bufferstand.model.simulation import band_history, force_history, lag_histories
from tests.drivers.conftest import SAMPLE_STAND

MODELS = SAMPLE_STAND.parent / "models"
POINTS = 20_000


def test_by_hand() -> None:
    """D = 0.232 of a spring that is just relieved: tan δ = 0.170 (docs/facts/standards.md)."""
    sine = 4.0 * 0.232 / (np.pi * (2.0 - 0.232))
    tangent = sine / np.sqrt(1.0 - sine**2)
    assert tangent == pytest.approx(0.170, abs=0.001)
    assert damping_error(0.232, 1.0, 1e-3) == pytest.approx(0.884 * 2e-3 * np.pi / tangent, rel=1e-12)
    assert damping_error(0.232, 1.0, 1e-3) == pytest.approx(0.0328, abs=0.0001)


def test_more_frequency_and_skew_cost_more_and_more_damping_and_prestress_less() -> None:
    assert damping_error(0.3, 2.5, 1e-4) == pytest.approx(2.5 * damping_error(0.3, 1.0, 1e-4))
    assert damping_error(0.3, 1.0, 2e-4) == pytest.approx(2.0 * damping_error(0.3, 1.0, 1e-4))
    assert damping_error(0.4, 1.0, 1e-4) < damping_error(0.2, 1.0, 1e-4)
    assert damping_error(0.3, 1.0, 1e-4, 1.5) < damping_error(0.3, 1.0, 1e-4)


@pytest.mark.parametrize("damping", [0.0, -0.1, 1.2])
def test_what_no_sine_loop_can_have_is_refused(damping: float) -> None:
    with pytest.raises(ValueError, match="no sine loop"):
        damping_error(damping, 1.0, 1e-4)


@pytest.mark.parametrize(
    ("model", "mean_mm", "amplitude_mm", "within"),
    [
        ("category-a-elastomer", 20.0, 19.9, 0.05),
        ("category-a-elastomer", 20.0, 15.0, 0.05),
        ("category-a-elastomer", 50.0, 10.0, 0.05),
        ("category-a-elastomer", 78.0, 15.0, 0.05),
        ("category-a-elastomer", 40.0, 39.9, 0.15),  # F is progressive: no sine any more
        ("draw-hook-elastomer", 20.0, 19.9, 0.25),
    ],
)
def test_the_law_agrees_with_loops_of_the_shipped_models(
    model: str, mean_mm: float, amplitude_mm: float, within: float
) -> None:
    """And the percentage that a polled run states, 3.3 per Hz and ms, is no smaller than any of theirs."""
    spring = load_model(Path(MODELS / f"{model}.toml"))
    time_s = np.arange(3 * POINTS + 1) / POINTS
    stroke = mean_mm - amplitude_mm * np.cos(2.0 * np.pi * time_s)
    lag = lag_histories(spring.viscous, time_s, stroke)
    force = np.asarray(force_history(spring, stroke, band_history(spring.tables, stroke), lag, 25.0))
    last = slice(2 * POINTS, 3 * POINTS + 1)
    up = slice(2 * POINTS, 2 * POINTS + POINTS // 2 + 1)

    def damping(late_s: float) -> float:
        late = np.interp(time_s - late_s, time_s, force)
        return float(np.trapezoid(late[last], stroke[last]) / np.trapezoid(late[up], stroke[up]))

    own = damping(0.0)
    found = (damping(-1e-4) - damping(1e-4)) / (2e-4 * own) * 1e-3  # earlier by 1 ms, at 1 Hz
    harmonic = 2.0 * np.mean(force[last][:-1] * np.exp(-2j * np.pi * time_s[last][:-1]))
    ratio = float(np.mean(force[last])) / abs(harmonic)
    assert damping_error(own, 1.0, 1e-3, ratio) == pytest.approx(found, rel=within)
    assert 0.005 < found < 0.033
