"""Fitted turning points: right where extreme samples overreach."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.cycles.turn_neighbourhood import Reversals, TurnKind
from bufferstand.evaluation.cycles.turning_points import fit_turning_points
from bufferstand.evaluation.facts.cycle import TurningPoint
from bufferstand.evaluation.numerics.reversals import noise_sigma
from bufferstand.evaluation.numerics.shape_fits import points_of, smooth_fits
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Floats

TIME = np.arange(0.0, 2.0, 0.001)


def fitted(stroke: Floats, index: int, kind: TurnKind = "upper") -> TurningPoint:
    ends = np.array([[0, stroke.size - 1]])
    reversals = Reversals(np.array([index]), ends, np.array([kind == "upper"]), np.ones((1, 2), dtype=bool))
    return fit_turning_points(TIME, stroke, reversals, noise_sigma(stroke))[0]


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


def test_like_turns_share_a_window() -> None:
    """0.8 % of second harmonic: a window of another width at the other end would make a cycle too long."""
    shares = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        phase = 2.0 * np.pi * np.arange(9 * 1178) / 1178.0 + random.uniform(0.0, 6.0)
        stroke = 50.0 - 15.0 * (np.cos(phase) + 0.008 * np.cos(2.0 * phase + 1.0))
        stroke = stroke + 0.0067 * random.standard_normal(phase.size)
        cycles = find_cycles(make_record(np.arange(phase.size) / 1e3, stroke, stroke))
        whole = [c for c in cycles if c.steady and "edge" not in (c.start.method, c.end.method)]
        shares += [(c.duration_s - 1.178) / np.hypot(c.start.u_leave_s, c.end.u_time_s) for c in whole]
    assert len(shares) > 20
    assert 0.6 < np.sqrt(np.mean(np.square(shares))) < 1.5


@pytest.mark.slow
def test_a_coarse_sine_has_no_dwell() -> None:
    """100 samples a cycle: four samples about a turn are near it, and six within nine times as much."""
    for seed in range(24):
        random = np.random.default_rng(seed)
        phase = 2.0 * np.pi * np.arange(2000) * 1.003 / 100.0 + random.uniform(0.0, 6.0)
        stroke = 45.0 - 35.0 * np.cos(phase) + 0.01 * random.standard_normal(phase.size)
        for cycle in find_cycles(make_record(np.arange(phase.size) / 50.0, stroke, stroke)):
            assert "plateau" not in (cycle.start.method, cycle.top.method, cycle.end.method)


def test_even_flanks_are_no_converter() -> None:
    """A clean trapezoid whose corners lie midway between samples moves in steps of one size and its half."""
    phase = 0.25 + np.arange(316) / 50.0
    stroke = 50.0 + 20.0 * np.interp(np.mod(phase + 0.1, 1.0), [0, 0.2, 0.5, 0.7, 1.0], [-1, -1, 1, 1, -1])
    inner = find_cycles(make_record(0.4 * phase, stroke, stroke))[1:-1]
    assert {turn.method for cycle in inner for turn in (cycle.start, cycle.end)} == {"reversal"}
    assert {cycle.top.method for cycle in inner} == {"plateau"}
    assert all(cycle.steady for cycle in inner)


@pytest.mark.parametrize("late", [-0.2, 0.0, 0.15])
def test_a_quartic_through_a_sine_knows_what_it_misses(late: float) -> None:
    """5/231 of z⁶ / 720, over a fifth of the stroke 1e-5 of it: of 35 mm 0.7 µm, alike at all turns."""
    half = float(np.arccos(1.0 - 2.0 * 0.2))
    phase = np.linspace(-1.0, 1.0, 81) * half + late * half
    one = np.ones(1, dtype=np.intp)
    points = points_of(phase, np.cos(phase), np.ones(1), 0 * one, 81 * one)
    assert smooth_fits(points, 1e-6).value[0] == pytest.approx(1.0, abs=6e-6)
