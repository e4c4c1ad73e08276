"""What is looked at first for leaps never passes over one that the look itself would find."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.plausibility.jumps import sample_steps as leaps
from bufferstand.evaluation.plausibility.jumps.sample_steps import largest_leaps, may_leap
from bufferstand.evaluation.plausibility.run_view.samples import Samples


@pytest.mark.parametrize("seed", range(40))
def test_no_leap_is_passed_over(seed: int) -> None:
    random = np.random.default_rng(seed)
    time_s = np.cumsum(random.uniform(1.0, random.choice([1.0, 1.3, 3.0]), 500)) / 100.0
    value = 50.0 * np.sin(time_s * random.uniform(1.0, 10.0)) + random.uniform(0.0, 2.0) * random.random(500)
    value[random.integers(20, 480) :] += random.uniform(-20.0, 20.0)
    channel = Samples("force", time_s, value)
    found = largest_leaps(channel, (), 3)
    for leap in found:
        assert may_leap(channel, 0.999 * abs(leap.size))


def test_a_smooth_force_with_noise_is_told_by_how_unlike_its_steps_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its largest step alone would not tell, and every sample would be looked at over one sample's width."""
    time_s = np.arange(20_000) / 1000.0
    noise = np.random.default_rng(3).uniform(-0.2, 0.2, time_s.size)
    channel = Samples("force", time_s, 400.0 * np.sin(2.0 * np.pi * time_s) + noise)
    widths = []
    look = leaps._left

    def counted(channel: Samples, part: slice, width: int) -> object:
        widths.append(width)
        return look(channel, part, width)

    monkeypatch.setattr(leaps, "_left", counted)
    assert not may_leap(channel, 2.0)
    assert set(widths) == {4}
