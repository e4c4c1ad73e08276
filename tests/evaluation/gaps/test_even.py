"""Stamps that scatter: of samples that were taken evenly, and of samples that were not."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.even_sampling import even_stamps
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED

RATE_HZ, SAMPLES = 200.0, 3000
NO_BREAKS = np.zeros(0, dtype=np.intp)


def scatter(share: float, seed: int = 0) -> np.ndarray:
    """Return how far stamps are from even ones [s]."""
    drawn = np.random.default_rng(seed).normal(0.0, share / RATE_HZ, SAMPLES)
    return np.clip(drawn, -0.45 / RATE_HZ, 0.45 / RATE_HZ)


def motion_mm(time_s: np.ndarray) -> np.ndarray:
    return 40.0 + 20.0 * np.sin(2.0 * np.pi * 0.5 * time_s)


@pytest.mark.parametrize("share", [0.03, 0.1, 0.2])
def test_stamps_that_the_stroke_does_not_follow_are_made_even(share: float) -> None:
    even = np.arange(SAMPLES) / RATE_HZ
    noise = np.random.default_rng(1).normal(0.0, 0.005, SAMPLES)
    found = even_stamps(even + scatter(share), motion_mm(even) + noise, NO_BREAKS)
    assert found is not None
    off = found.time_s - even
    assert np.std(off) < 0.1 * share / RATE_HZ
    assert "the stroke does not" in found.note


@pytest.mark.parametrize("share", [0.03, 0.1, 0.2])
def test_samples_that_were_taken_when_they_are_stamped_stay(share: float) -> None:
    stamps = np.arange(SAMPLES) / RATE_HZ + scatter(share)
    noise = np.random.default_rng(1).normal(0.0, 0.005, SAMPLES)
    assert even_stamps(stamps, motion_mm(stamps) + noise, NO_BREAKS) is None


def test_where_the_stroke_cannot_tell_the_stamps_stay() -> None:
    even = np.arange(SAMPLES) / RATE_HZ
    loud = motion_mm(even) + np.random.default_rng(1).normal(0.0, 2.0, SAMPLES)
    assert even_stamps(even + scatter(0.05), loud, NO_BREAKS) is None
    assert even_stamps(even, motion_mm(even), NO_BREAKS) is None, "they do not scatter"
    slower = np.concatenate((even[:1500], even[1500] + 5.0 * (even[1500:] - even[1500])))
    assert even_stamps(slower + scatter(0.1), motion_mm(slower), NO_BREAKS) is None, "it changed its rate"


def test_scattered_stamps_add_nothing_to_a_speed() -> None:
    """The largest speed of a sine of 20 mm at 0.5 Hz is 62.83 mm/s; by the stamps as they are, more."""
    even = np.arange(SAMPLES) / RATE_HZ
    stroke = motion_mm(even) + np.random.default_rng(1).normal(0.0, 0.005, SAMPLES)
    force = 2.0 * stroke + 5.0 * np.cos(2.0 * np.pi * 0.5 * even)
    run = evaluate_run(
        make_record(even + scatter(0.2), stroke, force),
        RunFacts("scattered", "harmonic", **STATED),  # type: ignore[arg-type]
        Options(draws=200),
    )
    speed = run.summary.values["speed_loading_max_mm_per_s"]
    assert speed.value is not None
    assert speed.expanded_uncertainty is not None
    assert abs(speed.value - 20.0 * np.pi) <= speed.expanded_uncertainty
    assert any("time stamps scatter by 0.00" in text for text in run.warnings)
