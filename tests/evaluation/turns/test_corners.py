"""Where a flank meets a dwell, of a stroke whose values are held over many rows."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.dwell_corners import corner_moment


def held(rows: int, start_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Return 10 mm/s for 2 s and a rest of 2 s at 100 samples a second, each value held over some rows."""
    time_s = np.arange(400) / 100.0
    value = start_mm + np.minimum(10.0 * time_s, 20.0)
    return time_s, np.repeat(value[::rows], rows)[: time_s.size]


@pytest.mark.parametrize(("rows", "told"), [(1, True), (8, False)])
def test_values_that_are_held_make_no_flank(rows: int, told: bool) -> None:
    """Six rows of one value rise by rounding: the rest once began anywhere in it, and u was 1e14 s."""
    for start_mm in np.linspace(0.1, 0.9, 20).tolist():
        time_s, value = held(rows, start_mm)
        first_in = int(np.argmax(value > start_mm + 19.9))
        found = corner_moment(time_s, value, first_in, start_mm + 20.0, 0.1, 1e-3)
        assert (found is not None) == told
        if found is not None:
            assert found[0] == pytest.approx(2.0, abs=1e-3)
            assert found[1] < 0.01
