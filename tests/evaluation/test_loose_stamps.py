"""Stamps of a computer that was starved: by how much they wander, and what that makes of a force."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.plausibility.signal_comparison.force_sensors import _by_stamps
from bufferstand.evaluation.record.signals import _wander_s

TIME_S = np.arange(0.0, 20.0, 0.004)


def test_even_stamps_do_not_wander_whatever_their_rate_and_holes() -> None:
    assert _wander_s(TIME_S) < 1e-9
    assert _wander_s(1.002 * TIME_S) < 1e-9
    assert _wander_s(np.delete(TIME_S, slice(2000, 2300))) < 1e-9


def test_stamps_that_come_late_wander_by_as_much() -> None:
    late_s = np.interp(TIME_S, [0.0, 9.0, 10.0, 11.0, 20.0], [0.0, 0.0, 0.05, 0.0, 0.0])
    assert _wander_s(TIME_S + late_s) == pytest.approx(0.05, rel=0.15)


def test_a_sine_moved_by_some_milliseconds_leaves_two_pi_f_t_of_itself() -> None:
    force = np.sin(2.0 * np.pi * 1.0 * TIME_S)
    assert _by_stamps(TIME_S, force, 0.01) == pytest.approx(2.0 * np.pi * 0.01, rel=0.02)
    assert _by_stamps(TIME_S, force, 0.0) == 0.0
