"""A channel at other moments: the filter and the spline are one curve."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from bufferstand.evaluation.numerics import cubic_splines as splines
from bufferstand.evaluation.numerics.cubic_splines import moved

ROOT = Path(__file__).resolve().parents[2]
EVALUATE = """
import sys
from pathlib import Path
from bufferstand.evaluation.document.build import evaluate_file
from bufferstand.evaluation.facts.run_facts import Options
assert evaluate_file(Path(sys.argv[1]), Options(draws=0)).cycles
print(*sorted(name for name in sys.modules if name.split('.')[0] in ('scipy', 'pandas')))
"""


@settings(max_examples=40, deadline=None)
@given(
    size=st.integers(160, 700),
    steps=st.floats(-2.0, 2.0),
    begin_s=st.floats(0.0, 1e4),
    seed=st.integers(0, 1000),
)
def test_even_samples_at_a_delay_are_the_spline_through_them(
    size: int, steps: float, begin_s: float, seed: int
) -> None:
    """Of noise, which bends most, and at both ends too, where the moments lie beyond the points."""
    value = np.random.default_rng(seed).normal(size=size)
    since_s = np.arange(size) * 1e-3
    wanted = CubicSpline(since_s, value)(since_s + 1e-3 * steps)
    found = moved(begin_s + since_s, value, begin_s + since_s + 1e-3 * steps)
    assert found == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("change", ["jitter", "drift", "far", "few", "other"])
def test_other_samples_take_the_spline_itself(monkeypatch: pytest.MonkeyPatch, change: str) -> None:
    """Uneven points, a delay that changes, moments far away or of another number: never the filter."""
    random = np.random.default_rng(1)
    time = np.arange(100 if change == "few" else 400) * 1e-3
    later = time + 8e-4
    if change == "jitter":
        time = time + random.choice([0.0, 1e-6], time.size)
    elif change == "drift":
        later = later + 1e-6 * np.arange(time.size)
    elif change == "far":
        later = time + 2.1e-3
    elif change == "other":
        later = later[5:-5]
    value = random.normal(size=time.size)

    def no_filter(*_: object, **__: object) -> None:
        raise AssertionError("the filter is for even points at one delay")

    monkeypatch.setattr(splines, "_weights", no_filter)
    assert np.array_equal(moved(time, value, later), CubicSpline(time, value)(later))


def test_a_sine_comes_back_at_its_moments() -> None:
    """What was sampled 0.8 ms late is the sine again at the stroke's instants: to (ω h)⁴ / 384."""
    time = np.arange(5000) * 1e-3
    omega = 2.0 * np.pi * 2.5
    found = moved(time - 8e-4, np.sin(omega * (time - 8e-4)), time)
    assert found[:-1] == pytest.approx(np.sin(omega * time)[:-1], abs=1e-9)


@pytest.mark.slow
def test_a_run_of_even_samples_waits_for_no_scipy() -> None:
    """To import it takes longer than to evaluate the run, in every process that does."""
    run = ROOT / "sample_runs/runs/005-harmonic-20mm-20mm-1.27Hz.h5"
    done = subprocess.run(
        [sys.executable, "-c", EVALUATE, str(run)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""
