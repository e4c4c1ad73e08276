"""Tips that are sharp are not taken for rounded ones because of noise."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.gaps.test_bounds import RANGE_MM, columns


@pytest.mark.parametrize("samples", [50, 100])
def test_a_sharp_tip_is_no_rounded_one(samples: int) -> None:
    """Triangles with noise of 0.05 % of their range, 400 turns: lowered ones would be 0.3 to 0.5 mm off."""
    random = np.random.default_rng((5, samples))
    errors = []
    for _ in range(10):
        time, stroke, force = columns("triangle", samples, 20.6, random.uniform(0.05, 0.95))
        stroke = stroke + 5e-4 * RANGE_MM * random.standard_normal(time.size)
        for cycle in find_cycles(make_record(time, stroke, force)):
            if cycle.complete:
                errors += [cycle.stroke_min_mm, cycle.stroke_max_mm - RANGE_MM]
    assert len(errors) > 300
    assert np.max(np.abs(errors)) < 0.15
