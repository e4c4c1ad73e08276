"""Fitted turning points: right where extreme samples overreach."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.motion import TurningPoint
from evaluation.reversals import noise_sigma
from evaluation.turn_sides import Reversal, TurnKind
from evaluation.turning import fit_turning_points
from tests.evaluation.signals import Floats

TIME = np.arange(0.0, 2.0, 0.001)


def fitted(stroke: Floats, index: int, kind: TurnKind = "upper") -> TurningPoint:
    reversal = Reversal(index, (0, stroke.size - 1), kind)
    return fit_turning_points(TIME, stroke, [reversal], noise_sigma(stroke))[0]


def test_smooth_turn_in_noise_beats_the_extreme_sample() -> None:
    errors, extremes = [], []
    for seed in range(20):
        noise = 0.02 * np.random.default_rng(seed).standard_normal(TIME.size)
        stroke = 20.0 * np.sin(np.pi * TIME / 2.0 + 0.0) + noise
        index = int(np.argmax(stroke))
        turn = fitted(stroke, index)
        assert turn.method == "polynomial"
        errors.append(turn.stroke_mm - 20.0)
        extremes.append(stroke[index] - 20.0)
    assert np.mean(extremes) > 0.04
    assert abs(np.mean(errors)) < 0.002
    assert np.std(errors) < 0.005


def test_smooth_turn_without_noise() -> None:
    turn = fitted(20.0 * np.sin(np.pi * TIME / 2.0 + 0.1), 936)
    assert turn.stroke_mm == pytest.approx(20.0, abs=1e-6)
    assert turn.time_s == pytest.approx(1.0 - 0.2 / np.pi, abs=1e-5)


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_triangular_turn(shift: float, noise: float) -> None:
    at = 1.0 + 0.001 * shift
    slope_down = 30.0
    stroke = 50.0 - np.where(at > TIME, 50.0 * (at - TIME), slope_down * (TIME - at))
    stroke = stroke + noise * np.random.default_rng(4).standard_normal(TIME.size)
    turn = fitted(stroke, int(np.argmax(stroke)))
    assert turn.stroke_mm == pytest.approx(50.0, abs=1e-6 + noise / 2)
    assert turn.time_s == pytest.approx(at, abs=1e-7 + noise / 20)


def test_lower_turn_is_the_mirror() -> None:
    stroke = 20.0 * np.sin(np.pi * TIME / 2.0 + 0.1)
    up, down = fitted(stroke, 936), fitted(-stroke, 936, "lower")
    assert down.stroke_mm == pytest.approx(-up.stroke_mm)
    assert down.time_s == pytest.approx(up.time_s)


def test_dwell() -> None:
    stroke = np.clip(100.0 * np.minimum(TIME, 2.0 - TIME), 0.0, 60.0)
    turn = fitted(stroke, 1000)
    assert turn.method == "plateau"
    assert turn.stroke_mm == pytest.approx(60.0)
    assert turn.time_s == pytest.approx(0.6, abs=0.002)
    assert turn.leave_s == pytest.approx(1.4, abs=0.002)
    assert turn.dwell_s == pytest.approx(0.8, abs=0.004)


def test_creep_during_a_dwell() -> None:
    creep = 0.3 * (TIME - 0.6)
    stroke = np.where(
        TIME < 0.6, 100.0 * TIME, np.where(TIME < 1.4, 60.0 + creep, 60.24 - 100.0 * (TIME - 1.4))
    )
    turn = fitted(stroke, int(np.argmax(stroke)))
    assert turn.method == "plateau"
    assert turn.stroke_mm == pytest.approx(60.0, abs=0.05)
    assert turn.leave_mm == pytest.approx(60.24, abs=0.05)


def test_one_sided_turn() -> None:
    stroke = 20.0 * np.cos(np.pi * TIME / 2.0 + 0.02)
    turn = fitted(stroke, 0)
    assert turn.method == "edge"
    assert turn.stroke_mm == pytest.approx(20.0, abs=1e-4)
    assert turn.time_s == pytest.approx(-0.04 / np.pi, abs=1e-3)
    assert fitted(20.0 * np.cos(np.pi * TIME / 2.0 + 0.3), 0).method == "cut"
