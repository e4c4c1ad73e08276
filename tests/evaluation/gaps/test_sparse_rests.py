"""Loggers that slow down or stop at rest: what was put into the rest is no reading."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.gaps.bridging import bridged
from bufferstand.evaluation.numerics.reversals import noise_sigma
from bufferstand.evaluation.record.record import Record, make_record

NOISE_MM = 0.02


def strokes_between_rests(seed: int, every: int) -> Record:
    """Return three strokes to 80 mm between rests of 20 s at 0, with one of `every` samples of a rest."""
    random = np.random.default_rng(seed)
    knots = np.cumsum([0.0, 20.0, 4.0, 4.0, 20.0, 4.0, 4.0, 20.0, 4.0, 4.0, 20.0])
    time = np.arange(0.0, knots[-1], 0.02)
    stroke = np.interp(time, knots, [0.0, 0.0, 80.0, 0.0, 0.0, 80.0, 0.0, 0.0, 80.0, 0.0, 0.0])
    since = np.min(np.mod(time - knots[[3, 6, 9], None], knots[-1]), axis=0)
    kept = (stroke > 0.0) | (since < 0.3) | (np.arange(time.size) % every == 0)
    read = stroke + NOISE_MM * random.standard_normal(time.size)
    force = 10.0 + 4.0 * stroke + 0.1 * random.standard_normal(time.size)
    return make_record(time[kept], read[kept], force[kept])


@pytest.mark.parametrize("every", [10, 50])
def test_the_noise_is_that_of_the_samples_that_were_read(every: int) -> None:
    record = bridged(strokes_between_rests(1, every)).record
    assert record.filled_s
    assert noise_sigma(record.as_read(record.stroke_mm)) == pytest.approx(NOISE_MM, rel=0.2)


def test_a_record_without_rests_to_be_filled_is_read_as_it_is() -> None:
    record = bridged(strokes_between_rests(1, 1)).record
    assert record.as_read(record.stroke_mm) is record.stroke_mm
    assert record.read.all()


@pytest.mark.slow
@pytest.mark.parametrize("every", [10, 50])
def test_the_level_of_a_rest_is_known_by_its_samples_that_were_read(every: int) -> None:
    inside, widest = [], 0.0
    for seed in range(25):
        record = bridged(strokes_between_rests(seed, every)).record
        for cycle in find_cycles(record):
            for turn, level in ((cycle.start, cycle.start.leave_mm), (cycle.end, cycle.end.stroke_mm)):
                inside.append(abs(level) <= 2.0 * turn.u_stroke_mm)
                widest = max(widest, turn.u_stroke_mm)
    assert len(inside) > 100
    assert np.mean(inside) > 0.90
    assert widest < 1.5 * NOISE_MM
