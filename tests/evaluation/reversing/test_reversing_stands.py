"""Figures of a stand that needs time to reverse: those of its truth, and no others for longer reversals."""

from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.reversing.runs import Harmonic, Static
from tests.evaluation.reversing.study import Compared, compared

MOST_PERCENT = 0.05
"""So near the true frequency each cycle is, and the mean."""
SPEEDS = ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s")
MOST_SPEED_PERCENT = 6.0
"""Behind a dwell a piston catches up, and the largest slope over 5 % of a branch is where that begins: it
hangs on the sample from which the branch counts."""


@pytest.mark.parametrize("reversal_s", [0.0, 0.02, 0.03, 0.06])
@pytest.mark.parametrize("motion", [Harmonic(1.0, 10.0), Harmonic(1.7, 15.0)], ids=["1.0", "1.7"])
def test_sines(motion: Harmonic, reversal_s: float) -> None:
    found = compared(motion, reversal_s)
    assert len(found.cycles) == 7
    within_U(found, "frequency_Hz")
    assert np.max(np.abs(found.error_percent["frequency_Hz"])) <= MOST_PERCENT
    mean = found.mean_Hz
    assert mean is not None
    assert mean.value is not None
    assert mean.expanded_uncertainty is not None
    away_Hz = abs(mean.value - motion.frequency_Hz)
    assert away_Hz <= min(mean.expanded_uncertainty, 1e-2 * MOST_PERCENT * motion.frequency_Hz)
    assert mean.expanded_uncertainty <= 1e-2 * MOST_PERCENT * motion.frequency_Hz
    for name in found.error_percent:
        within_U(found, name)


@pytest.mark.parametrize("reversal_s", [0.0, 0.03, 0.06])
def test_strokes_without_rests(reversal_s: float) -> None:
    found = compared(Static(50.0), reversal_s)
    assert len(found.cycles) == 4
    # The first begins at rest and the last ends there, with corners that the stand eases.
    assert np.max(np.abs(found.error_percent["frequency_Hz"][1:-1])) <= MOST_PERCENT
    for name, error in found.error_percent.items():
        if name in SPEEDS:
            assert np.max(np.abs(error)) <= MOST_SPEED_PERCENT
        elif name != "frequency_Hz":
            within_U(found, name)


def test_how_long_a_stand_reverses_does_not_change_strokes_between_rests() -> None:
    found = [compared(Static(100.0, pause_s=1.0), reversal_s) for reversal_s in (0.0, 0.02, 0.06)]
    for one in found:  # the corners are eased, which is in their u
        within_U(one, "frequency_Hz")
    durations = [np.array([r.cycle.duration_s for r in one.cycles[1:]]) for one in found]
    # At the top the stand stands for its reversal, and catches up afterwards: the way back ends when it did.
    for other in durations[1:]:
        np.testing.assert_allclose(other, durations[0], rtol=1e-2 * MOST_PERCENT)


def within_U(found: Compared, name: str) -> None:  # noqa: N802 - U is U
    """See that U holds a figure: of seven cycles 95 of 100 may leave one outside, but not by far."""
    over = found.over_U(name)
    assert np.count_nonzero(over > 1.0) <= 1, (name, over)
    assert np.max(over) <= 1.5, (name, over)
