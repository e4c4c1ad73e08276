"""From runs to a model: I11 and I12 of the model's test list, held-out cycles, and what runs cannot tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.model.identification.procedure import FitSettings, identify
from bufferstand.model.identification.suggested_runs import missing_runs, needed
from bufferstand.protocols.campaign_file.schema import load_campaign
from tests.model.identification.synthetic import (
    FINER,
    RATE_Hz,
    harmonic,
    measured,
    simulated,
    static,
    truth,
)
from tests.model.recipes import draw_hook

FINE_Hz = RATE_Hz * FINER


@pytest.fixture(scope="module")
def hook():
    """I11: the draw-hook spring of docs/facts/spring-model.md, slow strokes and loops at 25 and at 75 °C."""
    model = draw_hook()
    plan = [
        (25.0, [static(42.5, 5.0, FINE_Hz), 30.0, *loops(), 30.0, harmonic(20.0, 18.0, 1.0, 12, FINE_Hz)]),
        (75.0, [static(44.0, 5.0, FINE_Hz), 10.0, *loops()]),
    ]
    runs = [simulated(model, parts, start, 20.0)[0] for start, parts in plan]
    return identify(measured(7, runs), FitSettings(knots=10))


def loops():
    parts = []
    for mean in (12.0, 25.0, 35.0):
        for amplitude in (3.0, 6.0):
            parts += [harmonic(mean, amplitude, 0.5, 3, FINE_Hz), 5.0]
    return parts


def test_i11_recovers_the_law_of_temperature_of_the_draw_hook_spring(hook):
    found = {e.name: e for e in hook.estimates}
    assert found["sensitivity_per_K"].value == pytest.approx(0.01, rel=0.02)
    assert found["depth_mm"].value == pytest.approx(20.0, rel=0.05)
    assert found["loss_sensitivity_per_K"].value == pytest.approx(0.00167, abs=2e-4)
    assert found["transition_length_mm"].value == pytest.approx(3.0, rel=0.03)
    assert hook.model.curves.loading(np.array([42.5]))[0] == pytest.approx(593.0, rel=0.005)


def test_held_out_cycles_are_predicted(hook):
    assert len(hook.held_out) >= 3
    span = max(check.peak_force_kN for check in hook.cycles)
    for check in hook.held_out:
        assert abs(check.damping - check.predicted_damping) < 0.005
        assert check.rms_kN < 0.01 * span
        assert abs(check.peak_force_kN - check.predicted_peak_force_kN) < 0.01 * span


def test_i12_recovers_rate_effect_and_transition_while_the_spring_warms_up():
    """beta, tau and L from constant-amplitude sweeps in mixed order; the temperature is found with them."""
    sweep = [harmonic(60.0, 20.0, f, n, FINE_Hz) for f, n in ((1.27, 12), (0.08, 2), (0.32, 6), (0.04, 1))]
    parts = [part for motion in sweep for part in (motion, 10.0)]
    parts += [static(80.0, 20.0, FINE_Hz), 10.0, harmonic(30.0, 5.0, 0.5, 3, FINE_Hz)]
    pieces, _ = simulated(truth(), parts, 22.0, 20.0)
    made = identify(measured(3, [pieces]), FitSettings(knots=6, hold_out=False))
    found = {e.name: e for e in made.estimates}
    assert made.facts.warming_K > 3.0  # softening by as much as the whole rate effect
    assert found["beta"].value == pytest.approx(0.045, rel=0.08)
    assert found["tau_s"].value == pytest.approx(8.0, rel=0.25)
    assert found["transition_length_mm"].value == pytest.approx(4.0, rel=0.02)


@pytest.fixture(scope="module")
def cool_runs():
    """A slow stroke and a fast one, in a row, that hardly warm the spring."""
    parts = [static(60.0, 10.0, FINE_Hz), 60.0, harmonic(30.0, 4.0, 0.5, 2, FINE_Hz)]
    return identify(
        measured(1, [simulated(truth(), parts, 24.0, 23.0)[0]]), FitSettings(knots=6, hold_out=False)
    )


def test_says_plainly_what_the_runs_do_not_tell(cool_runs):
    why = {unknown.name: unknown.why for unknown in cool_runs.unknown}
    low, high = cool_runs.facts.temperature_C
    assert high - low < 2.0
    for name in ("sensitivity_per_K", "depth_mm", "loss_sensitivity_per_K"):
        assert f"all runs lie between {low:.0f} and {high:.0f} °C" in why[name]
    assert "transition_length_mm" not in why
    assert not {e.name for e in cool_runs.estimates if not e.identified} ^ set(why)
    assert cool_runs.model.temperature.sensitivity_per_K == 0.0


def test_what_runs_do_not_tell_has_no_interval(cool_runs):
    """Prior against posterior: a figure that rests on the form of the model alone is none of these runs."""
    for estimate in cool_runs.estimates:
        assert (estimate.low is None) == (estimate.high is None) == (not estimate.identified)
        if estimate.identified and estimate.of_prior is not None:
            assert 0.0 < estimate.of_prior < 0.5
            assert estimate.low <= estimate.value <= estimate.high


def test_equal_slow_strokes_tell_neither_transition_nor_temperature_nor_rate():
    """Issue 22: three slow strokes to one end fit with any L, and warm by what a drift could feign."""
    parts = [part for _ in range(3) for part in (static(90.0, 20.0, FINE_Hz), 5.0)]
    made = identify(
        measured(4, [simulated(truth(), parts, 24.0, 24.0)[0]]), FitSettings(knots=6, hold_out=False)
    )
    intervals = {e.name: e.low for e in made.estimates}
    why = {unknown.name: unknown for unknown in made.unknown}
    for name in ("transition_length_mm", "sensitivity_per_K", "beta", "tau_s", "spectrum_per_decade"):
        assert intervals[name] is None
        assert why[name].why
    assert "0 half strokes lie inside the curves" in why["transition_length_mm"].why
    assert why["transition_length_mm"].fitted
    assert all(e.low is not None for e in made.estimates if e.name.startswith("loading"))


def test_the_missing_runs_are_a_campaign_that_is_understood(cool_runs, tmp_path: Path):
    file = tmp_path / "missing.toml"
    file.write_text(missing_runs(cool_runs, stand="stand.toml", specimen='a "b".toml'), encoding="utf-8")
    campaign = load_campaign(file)
    assert campaign.content.campaign.specimen == 'a "b".toml'
    assert {unknown.name for unknown in needed(cool_runs)} >= {"sensitivity_per_K"}
    kinds = [step.kind for step in campaign.content.step]
    assert kinds[:2] == ["static", "sweep"]
    assert "warm up" in [step.name for step in campaign.content.step]
    reach = max(
        step.prestress_mm + step.amplitude_mm for step in campaign.content.step if step.kind == "harmonic"
    )
    assert reach <= cool_runs.facts.stroke_mm


def test_refuses_what_cannot_be_used():
    with pytest.raises(BadInput, match="no parameter “kapazität”"):
        identify([], FitSettings(without=("kapazität",)))
    still = [simulated(truth(), [np.zeros(int(FINE_Hz))], 24.0, 20.0)[0]]
    with pytest.raises(BadInput, match="nothing was compressed"):
        identify(measured(1, still))
