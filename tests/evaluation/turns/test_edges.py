"""Records that begin and end with the motion itself."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.record.record import make_record


@pytest.mark.parametrize("power", [1.0, 1.2, 2.0, 3.0])
@pytest.mark.parametrize("samples", [100, 1000])
@pytest.mark.parametrize("noise_mm", [0.0, 0.01])
def test_the_first_sample_is_the_turn(power: float, samples: int, noise_mm: float) -> None:
    """Two cycles that begin and end with the record, with more or less speed at once."""
    time = np.arange(2 * samples + 1) / samples
    noise = noise_mm * np.random.default_rng(0).standard_normal(time.size)
    stroke = 40.0 * np.abs(np.sin(np.pi * time)) ** power + noise
    cycles = find_cycles(make_record(time, stroke, stroke))
    assert [cycle.complete for cycle in cycles] == [True, True]
    assert cycles[0].stroke_min_mm == pytest.approx(0.0, abs=0.1)


@pytest.mark.slow
def test_a_stand_that_eases_out_of_its_rest_with_the_first_sample_hides_it_in_no_wide_window() -> None:
    """Strokes of 7 mm/s, 30 samples a second, 50 ms to full speed: a wide window does not see them."""
    inside, u_mm = [], []
    for seed in range(60):
        random = np.random.default_rng(seed)
        time = np.arange(0.0, 40.0, 1.0 / 30.0) + random.uniform(0.0, 1.0) / 30.0
        eased = np.where(time < 0.05, 0.5 * time**2 / 0.05, time - 0.025)
        stroke = np.minimum(7.0 * eased, 210.0 - 7.0 * eased).clip(0.0)
        read = stroke + 0.005 * random.standard_normal(time.size)
        start = find_cycles(make_record(time, read, read))[0].start
        assert start.method == "edge"
        inside.append(abs(start.leave_mm - stroke[0]) <= 2.0 * start.u_stroke_mm)
        u_mm.append(start.u_stroke_mm)
    assert np.median(u_mm) < 0.015
    assert np.mean(inside) > 0.88  # 95 % of 60 less 2.5 standard deviations


def test_a_record_that_begins_half_a_percent_late_begins_within_its_cycle() -> None:
    time = np.arange(0.05, 2.0, 0.001)
    stroke = 40.0 * np.sin(np.pi * time) ** 2
    cycles = find_cycles(make_record(time, stroke, stroke))
    assert not cycles[0].complete
    assert cycles[0].why == ("the record begins within it",)
