"""Trends over frequency: grouped rightly, fitted rightly, confounding said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.evaluation.across_runs.trends import find_trends
from bufferstand.evaluation.facts.results import Measured, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import CERTIFIED, STATED, Ellipse


def run(
    name: str,
    frequency: float,
    *,
    prestress: float = 50.0,
    amplitude: float = 20.0,
    storage: float = 4.0,
    temperature: float = 22.0,
    specimen: str = "A",
    mean_kN: float = 250.0,
    facts: dict[str, object] | None = None,
) -> RunEvaluation:
    ellipse = Ellipse(mean_mm=prestress, amplitude_mm=amplitude, storage=storage, mean_kN=mean_kN)
    columns = ellipse.columns(frequency, 200.0 * frequency, 3.5)
    at = np.linspace(0.0, columns[0][-1], 20)
    sensor = Temperature("temperature_1", at, np.full(20, temperature))
    record = make_record(*columns, temperatures=[sensor])
    known = {**STATED, **CERTIFIED} if facts is None else facts
    whole = RunFacts(name, "harmonic", specimen={"id": specimen}, **known)  # type: ignore[arg-type]
    return evaluate_run(record, whole, Options(draws=100))


SWEEP = [run(f"r{f}", f, storage=4.0 + 0.3 * f) for f in (0.1, 0.5, 1.0, 2.0)]


def test_slope_is_recovered() -> None:
    trends = find_trends(SWEEP)
    assert [t.quantity for t in trends] == ["damping", "tangent_stiffness"]
    stiffness = trends[1]
    assert stiffness.slope_per_Hz == pytest.approx(0.3, rel=0.01)
    assert stiffness.intercept == pytest.approx(4.0, rel=0.001)
    assert stiffness.prestress_mm == pytest.approx(50.0, abs=0.01)
    assert stiffness.amplitude_mm == pytest.approx(20.0, abs=0.01)
    assert stiffness.runs == ("r0.1", "r0.5", "r1.0", "r2.0")
    assert stiffness.temperature_C == pytest.approx((22.0,) * 4)
    assert stiffness.warnings == ()
    assert all(u is not None and u > 0.0 for u in stiffness.expanded_uncertainty)


def test_order_of_the_runs_does_not_matter() -> None:
    assert find_trends(SWEEP[::-1]) == find_trends(SWEEP)


def test_band_against_textbook() -> None:
    """Least squares of four points that state no uncertainty: Student's t with two degrees of freedom."""
    runs = [run(f"r{f}", f, storage=k, facts={}) for f, k in ((0.5, 4.0), (1.0, 4.3), (1.5, 4.2), (2.0, 4.6))]
    trend = find_trends(runs)[1]
    f, y = np.array(trend.frequency_Hz), np.array(trend.values)
    slope, intercept = np.polyfit(f, y, 1)
    assert trend.slope_per_Hz == pytest.approx(slope)
    assert trend.intercept == pytest.approx(intercept)
    s = np.sqrt(np.sum((y - slope * f - intercept) ** 2) / 2.0)
    spread = np.sum((f - f.mean()) ** 2)
    assert trend.slope_u_per_Hz == pytest.approx(s / np.sqrt(spread))
    assert trend.slope_half_width_95_per_Hz == pytest.approx(4.302653 * trend.slope_u_per_Hz, rel=1e-5)
    assert trend.shared is None
    assert any("share do not show" in w for w in trend.warnings)
    expected = 4.302653 * s * np.sqrt(0.25 + (f - f.mean()) ** 2 / spread)
    np.testing.assert_allclose(np.array(trend.band, dtype=float), expected, rtol=1e-5)


def test_groups() -> None:
    runs = [
        *SWEEP[:2],
        run("other prestress", 0.5, prestress=80.0),
        run("other amplitude", 0.7, amplitude=10.0),
        run("other specimen", 1.0, specimen="B"),
    ]
    trends = find_trends(runs)
    constant = [t for t in trends if t.amplitude_mm is not None]
    assert [t.runs for t in constant] == [("r0.1", "r0.5")] * 2
    assert all("two points only" in t.warnings[0] for t in constant)
    assert all(width is not None and width > 0.0 for t in constant for width in t.band)
    assert all(t.scatter_u is None for t in constant)
    unknown = find_trends([run(f"r{f}", f, facts={}) for f in (0.5, 1.0)])
    assert all((t.band, t.slope_u_per_Hz) == ((None, None), None) for t in unknown)


def test_varying_amplitude_is_confounded() -> None:
    """Fig. 8b: stiffness over frequency at constant peak speed, so that the amplitude varies."""
    runs = [run(f"a{a}", 12.7 / a, amplitude=a) for a in (5.0, 10.0, 15.0, 30.0)]
    (trend,) = find_trends(runs)
    assert trend.quantity == "tangent_stiffness"
    assert trend.amplitude_mm is None
    assert len(trend.runs) == 4
    assert "amplitude varies from 5 to 30 mm" in trend.warnings[0]


def test_temperature_is_confounded() -> None:
    runs = [run("cold", 0.5), run("warm", 1.0, temperature=35.0), run("hot", 2.0, temperature=39.0)]
    for trend in find_trends(runs):
        assert any("temperature differs by 17.0 K" in w for w in trend.warnings)


def test_one_frequency_is_no_trend() -> None:
    assert find_trends([run("one", 1.0), run("two", 1.01)]) == ()
    assert find_trends([]) == ()


def test_temperature_that_follows_frequency_is_said_from_one_kelvin_on() -> None:
    following = [run(f"r{f}", f, temperature=22.0 + f) for f in (0.5, 1.0, 2.0)]
    for trend in find_trends(following):
        assert any("temperature differs by 1.5 K" in w and "frequency +1.00)" in w for w in trend.warnings)
    scattered = [run(f"r{f}", f, temperature=t) for f, t in ((0.5, 23.5), (1.0, 22.0), (1.5, 23.5))]
    assert all(trend.warnings == () for trend in find_trends(scattered))


def test_unknown_temperature_is_said() -> None:
    known, other = run("known", 0.5), run("unknown", 1.0)
    values = {**other.summary.values, "temperature_max_C": Measured(None)}
    unknown = replace(other, summary=replace(other.summary, values=values))
    for trend in find_trends([known, unknown]):
        assert any("no temperature of 1 of 2 runs" in w for w in trend.warnings)


def test_two_sided_loops_do_not_enter_the_damping_trend() -> None:
    two_sided = run("r1.5", 1.5, mean_kN=0.0)
    damping, stiffness = find_trends([*SWEEP, two_sided])
    assert "r1.5" not in damping.runs
    assert "r1.5" in stiffness.runs
    assert any("two-sided loops: r1.5" in w for w in damping.warnings)
    (only,) = find_trends([run(f"t{f}", f, mean_kN=0.0) for f in (0.5, 1.0, 2.0)])
    assert only.quantity == "tangent_stiffness"
