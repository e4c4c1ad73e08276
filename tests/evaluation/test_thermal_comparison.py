"""Runs at other temperatures: the paper's Fig. 9 from the shipped draw-hook model, and what is compared."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.across_runs.temperature_comparison import (
    TemperatureComparison,
    compare_temperatures,
)
from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.facts.channel_identity import ChannelIdentity
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.model.file import load_model
from bufferstand.model.simulation import simulate
from tests.evaluation.signals import CERTIFIED, STATED, Ellipse

MODELS = Path(__file__).resolve().parents[2] / "sample_runs" / "models"
HOOK = load_model(MODELS / "draw-hook-elastomer.toml")
RATE = 100.0
SPEED = 5.0


def static(name: str, temperature_C: float, top_mm: float, cycles: int = 1, **facts: object) -> RunEvaluation:
    """Evaluate static strokes of the draw-hook spring, simulated at one temperature."""
    half = round(top_mm / SPEED * RATE)
    rise = np.linspace(0.0, top_mm, half + 1)
    pause = np.zeros(round(3.0 * RATE))
    stroke = np.concatenate([pause, *([rise, rise[-2::-1], pause] * cycles)])
    time = np.arange(stroke.size) / RATE
    force = simulate(HOOK, time, stroke, temperature_C=temperature_C, isothermal=True).force_kN
    sensor = Temperature("temperature_1", time, np.full(time.size, temperature_C), accuracy_C=0.5)
    record = make_record(time, stroke, force, temperatures=[sensor])
    given = {"specimen": {"id": "hook", "kind": "draw-gear"}, **STATED, **CERTIFIED, **facts}
    return evaluate_run(record, RunFacts(name, "static", **given), Options(draws=300))  # type: ignore[arg-type]


OTHER_CELL = {
    "force_identity": ChannelIdentity("another", "another zero", "another delay", "certificate"),
    "stroke_identities": (ChannelIdentity("others", "others' zero", "others' delay", "certificate"),) * 2,
}
COLD, WARM = static("cold", 25.0, 42.5), static("warm", 75.0, 44.5)


def fig_9() -> TemperatureComparison:
    (comparison,) = compare_temperatures([WARM, COLD])
    return comparison


def test_figure_9_as_recorded() -> None:
    """Paper: 593 kN at 42.5 mm and 39 % (25 °C); 374 kN at 44.5 mm and 37 % (75 °C)."""
    found = fig_9()
    (warm,) = found.runs
    cold = found.reference
    assert (cold.run, cold.temperature_C) == ("cold", pytest.approx(25.0))
    assert (cold.end_stroke_mm, cold.end_force_kN) == pytest.approx((42.5, 593.0), rel=2e-3)
    assert cold.damping == pytest.approx(0.39, abs=0.002)
    assert (warm.run, warm.temperature_C) == ("warm", pytest.approx(75.0))
    assert (warm.end_stroke_mm, warm.end_force_kN) == pytest.approx((44.5, 374.0), rel=2e-3)
    assert warm.damping == pytest.approx(0.37, abs=0.002)


def test_figure_9_at_equal_stroke() -> None:
    """About -45 % of dissipation; docs/facts/standards.md: 0.0082 to 0.0089 per kelvin at equal stroke."""
    (warm,) = fig_9().runs
    assert (warm.from_mm, warm.to_mm) == pytest.approx((0.0, 42.5), abs=0.02)
    absorbed, force = warm.changes["absorbed_energy_J"], warm.changes["end_force_kN"]
    assert absorbed.relative_change == pytest.approx(-0.45, abs=0.03)
    assert force.reference == pytest.approx(593.0, rel=2e-3)
    assert force.relative_change_per_K == pytest.approx(-0.0086, abs=0.0004)
    assert force.relative_change_per_K == pytest.approx((force.relative_change or 0.0) / 50.0, rel=1e-6)
    # Limits of 0.5 K at both sensors: U of 50 K is 0.82 K.
    assert force.expanded_uncertainty is not None
    assert force.expanded_uncertainty_per_K is not None
    assert force.relative_change_per_K is not None
    expected = np.hypot(force.expanded_uncertainty / 50.0, force.relative_change_per_K * 0.8165 / 50.0)
    assert force.expanded_uncertainty_per_K == pytest.approx(expected, rel=1e-4)
    # Scale and linearity are the same in both, and leave the change; zeros and reversal do not quite.
    assert 0.0005 < force.expanded_uncertainty < 0.003


def test_errors_that_both_runs_share_cancel_in_a_change() -> None:
    """The same loop, warmer in name only: scale and linearity leave the change, another cell's do not."""
    same = compare_temperatures([COLD, replace(WARM, mean_loop=WARM.mean_loop)])[0].runs[0]
    apart = static("apart", 75.0, 44.5, **OTHER_CELL)
    independent = compare_temperatures([COLD, apart])[0].runs[0]
    for name in ("end_force_kN", "stored_energy_J", "absorbed_energy_J"):
        own, upper = (run.changes[name].expanded_uncertainty for run in (same, independent))
        assert own is not None
        assert upper is not None
        assert own < 0.75 * upper, name
        half_width = same.changes[name].half_width_95
        assert half_width is not None
        assert 0.8 * own < half_width < 1.0 * own


def test_same_stroke_simulated_agrees_with_the_cut() -> None:
    """The longer warm loop, cut at 42.5 mm with its turn moved there, is one that turns there."""
    turned = compare_temperatures([COLD, static("warm", 75.0, 42.5)])[0].runs[0]
    cut = fig_9().runs[0]
    for name in ("end_force_kN", "stored_energy_J"):
        assert cut.changes[name].value == pytest.approx(turned.changes[name].value, rel=2e-3)
    assert cut.changes["absorbed_energy_J"].value == pytest.approx(
        turned.changes["absorbed_energy_J"].value, rel=0.02
    )


@pytest.mark.slow
def test_cycles_of_a_static_test_are_averaged() -> None:
    many = compare_temperatures([static("a", 25.0, 40.0, 3), static("b", 45.0, 40.0, 3)])[0].runs[0]
    one = compare_temperatures([static("a", 25.0, 40.0), static("b", 45.0, 40.0)])[0].runs[0]
    for name, change in many.changes.items():
        assert change.relative_change == pytest.approx(one.changes[name].relative_change, abs=2e-3)


def harmonic(name: str, temperature: float, **options: float) -> RunEvaluation:
    softer = 1.0 - 0.008 * (temperature - 20.0)
    frequency = options.pop("frequency", 1.0)
    shape = Ellipse(**{"mean_kN": 250.0 * softer, "storage": 4.0 * softer, "loss": 0.6 * softer} | options)
    columns = shape.columns(frequency, 200.0 * frequency, 4.5)
    at = np.linspace(0.0, columns[0][-1], 20)
    record = make_record(*columns, temperatures=[Temperature("t", at, np.full(20, temperature))])
    return evaluate_run(record, RunFacts(name, "harmonic", specimen={"id": "A"}), Options(draws=50))


def test_harmonic_runs_of_one_step() -> None:
    runs = [harmonic("warm", 40.0), harmonic("cold", 20.0), harmonic("near", 23.0), harmonic("mid", 30.0)]
    (found,) = compare_temperatures(runs)
    assert found.reference.run == "cold"
    assert [r.run for r in found.runs] == ["mid", "warm"]  # 23 °C is too near to say anything
    assert found.step["frequency_Hz"] == pytest.approx(1.0, rel=1e-3)
    for run, change in zip(found.runs, (-0.08, -0.16), strict=True):
        for name in ("stored_energy_J", "absorbed_energy_J"):
            assert run.changes[name].relative_change == pytest.approx(change, rel=0.01)
            assert run.changes[name].relative_change_per_K == pytest.approx(-0.008, rel=0.01)
        assert run.changes["damping"].relative_change == pytest.approx(0.0, abs=1e-3)
    assert any("no expanded uncertainty" in w for w in found.warnings)


@pytest.mark.slow
def test_other_steps_and_specimens_are_not_compared() -> None:
    cold = harmonic("cold", 20.0)
    others = [
        harmonic("amplitude", 40.0, amplitude_mm=10.0),
        harmonic("prestress", 40.0, mean_mm=60.0),
        harmonic("frequency", 40.0, frequency=1.2),
    ]
    assert compare_temperatures([cold, *others]) == ()
    warm = harmonic("warm", 40.0)
    assert len(compare_temperatures([cold, warm])) == 1
    foreign = replace(warm, facts=replace(warm.facts, specimen={"id": "B"}))
    assert compare_temperatures([cold, foreign]) == ()
    assert compare_temperatures([]) == ()


@pytest.mark.slow
def test_two_sided_loops_have_no_damping_to_compare() -> None:
    (found,) = compare_temperatures([harmonic(n, t, mean_kN=0.0) for n, t in (("c", 20.0), ("w", 40.0))])
    assert found.runs[0].changes["damping"].value is None
    assert found.reference.damping is None
    assert any("not meaningful for two-sided loops" in w for w in found.warnings)


@pytest.mark.slow
def test_in_the_document() -> None:
    document = evaluation_document([COLD, WARM])
    (entry,) = document["temperature_comparisons"]
    assert entry["specimen"] == "hook"
    assert entry["step"]["kind"] == "static"
    assert entry["runs"][0]["changes"]["absorbed_energy_J"]["relative_change"] < -0.4
    assert entry["warnings"] == []
