"""The Monte Carlo propagation against hand calculation and the reference budget (docs/facts/standards.md)."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.uncertainty.error_model import draw_errors, mean_of_wires, missing_facts
from bufferstand.evaluation.uncertainty.monte_carlo import (
    CyclePropagation,
    expanded,
    force_draws,
    slope_draws,
    turn_errors,
)
from bufferstand.evaluation.uncertainty.noise import Noise, record_noise
from bufferstand.evaluation.uncertainty.other_draws import cycle_draws
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.closed_loops import FORCE, WIRES, Progressive, measured
from tests.evaluation.signals import Ellipse, Floats, StaticTest

NOTHING = ChannelUncertainty(accuracy_percent=0.0, linearity=0.0)
RECORD = make_record(*StaticTest(top_mm=100.0, noise_mm=0.0, noise_kN=0.0).columns())
CYCLE = find_cycles(RECORD)[1]
LOOP = CyclePropagation(RECORD, CYCLE, Noise(0.0, 0.0))


def relative_u(
    force: ChannelUncertainty = NOTHING,
    wires: tuple[ChannelUncertainty, ...] = (NOTHING,),
    noise: Noise | None = None,
) -> dict[str, float]:
    """Return standard uncertainties as shares of the values."""
    draws = draw_errors(force, wires, 4000, 7)
    assert draws is not None
    loop = LOOP if noise is None else CyclePropagation(RECORD, CYCLE, noise)
    drawn: dict[str, Floats] = dict(cycle_draws(draws, loop))
    reading = loop.read(60.0, 2.5, 2)
    assert reading is not None
    drawn["force"], drawn["slope"] = force_draws(draws, reading), slope_draws(draws, reading)
    return {name: float(np.std(v) / abs(np.mean(v))) for name, v in drawn.items() if name != "stroke_min_mm"}


def test_nothing_wrong_nothing_uncertain() -> None:
    assert max(relative_u().values()) < 1e-4


def test_scale_cancels_in_damping() -> None:
    u = relative_u(force=ChannelUncertainty(accuracy_percent=1.0))
    expected = 0.01 / np.sqrt(3.0)
    for name in ("stored_energy_J", "absorbed_energy_J", "tangent_stiffness_kN_per_mm", "force", "slope"):
        assert u[name] == pytest.approx(expected, rel=0.03)
    assert u["damping"] < 1e-6
    assert u["loss_factor"] < 1e-6


def test_zero_moves_stored_energy_only() -> None:
    u = relative_u(force=ChannelUncertainty(accuracy_percent=0.0, zero=1.0))
    stored = float(np.mean(cycle_draws(_draws(NOTHING), LOOP)["stored_energy_J"]))
    assert u["stored_energy_J"] == pytest.approx(100.0 / np.sqrt(3.0) / stored, rel=0.03)
    assert u["absorbed_energy_J"] < 1e-4
    assert u["slope"] < 1e-9


def _draws(force: ChannelUncertainty):  # type: ignore[no-untyped-def]
    return draw_errors(force, (NOTHING,), 4000, 7)


def test_reversibility_rules_damping() -> None:
    u = relative_u(force=ChannelUncertainty(accuracy_percent=0.0, reversibility_percent=1.5))
    assert u["stored_energy_J"] < 1e-6
    assert u["damping"] == pytest.approx(u["absorbed_energy_J"], rel=0.02)
    assert 0.004 < u["damping"] < 0.009


def test_skew_acts_as_omega_tau() -> None:
    """The error of tan δ is about ω τ (docs/facts/standards.md)."""
    ellipse = Ellipse()
    record = make_record(*ellipse.columns(2.5, 2000.0, 3.4))
    loop = CyclePropagation(record, find_cycles(record)[1], Noise(0.0, 0.0))
    draws = draw_errors(ChannelUncertainty(accuracy_percent=0.0, u_delay_s=1e-4), (NOTHING,), 4000, 7)
    assert draws is not None
    drawn = cycle_draws(draws, loop)
    expected = 2.0 * np.pi * 2.5 * 1e-4
    assert np.std(drawn["loss_factor"]) == pytest.approx(expected * (1.0 + 0.15**2), rel=0.05)
    # ΔW_a = π K′ ω τ A²: 7 parts in a thousand of this loop.
    assert np.std(drawn["absorbed_energy_J"]) == pytest.approx(np.pi * 4.0 * 400.0 * expected, rel=0.05)


def test_two_wires_are_better_than_one() -> None:
    wire = ChannelUncertainty(linearity=0.5)
    one, two = relative_u(wires=(wire,)), relative_u(wires=(wire, wire))
    for name in ("stored_energy_J", "force", "slope"):
        assert two[name] == pytest.approx(one[name] / np.sqrt(2.0), rel=1e-3)


@pytest.mark.parametrize(
    ("loop", "share"),
    [(Progressive(), 1.0), (Progressive(0.0, 100.0, 0.025, 0.5, "static", 20.0), 1.45)],
    ids=["sine", "even"],
)
def test_a_largest_speed_is_stretched_where_it_is_largest(loop: Progressive, share: float) -> None:
    """Three waves in 120 mm, of 0.46 limit together, stretch by 0.92 % at a stroke (two wires of 0.5 mm).

    A sine is fastest at one stroke; even speed is largest wherever the waves stretch most (rms 1.34 %, by
    numbers).
    """
    nothing = (ChannelUncertainty(linearity=0.0, zero=0.0),)
    sure = ChannelUncertainty(accuracy_percent=0.0, zero=0.0)
    rate_Hz = 400.0 * loop.frequency_Hz
    random = np.random.default_rng(1)
    columns = measured(
        loop, random, cycles=3.02, rate_Hz=rate_Hz, force=sure, wires=nothing, noise=(1e-3, 1e-4)
    )
    facts = RunFacts("s", loop.kind, force_uncertainty=FORCE, stroke_uncertainty=WIRES)
    run = evaluate_run(make_record(*columns), facts, Options(draws=4000))
    speed = run.summary.values["speed_loading_max_mm_per_s"]
    assert speed.value is not None
    assert speed.expanded_uncertainty is not None
    rates = np.pi * np.array([1.0, 2.0, 3.0]) / 120.0
    stretch = 0.46 * 0.5 / np.sqrt(2.0) * np.sqrt(np.mean(rates**2))
    assert 0.5 * speed.expanded_uncertainty / speed.value == pytest.approx(share * stretch, rel=0.025)


def test_budget_of_the_reference() -> None:
    """The reference budget (docs/facts/standards.md): W_s 0.9 %, W_a 1.05 %, D 0.73 %, K_t 1.8 %."""
    u = relative_u(
        force=ChannelUncertainty(accuracy_percent=1.0, reversibility_percent=1.5, zero=1.0, u_delay_s=1e-3),
        wires=(ChannelUncertainty(linearity=0.5, zero=0.2),),
        noise=Noise(0.5, 0.02),
    )
    assert u["stored_energy_J"] == pytest.approx(0.009, rel=0.3)
    assert u["absorbed_energy_J"] == pytest.approx(0.0105, rel=0.35)
    assert u["damping"] == pytest.approx(0.0073, rel=0.35)
    assert u["force"] == pytest.approx(0.015, rel=0.35)
    assert u["tangent_stiffness_kN_per_mm"] == pytest.approx(0.018, rel=0.4)


@pytest.mark.slow
def test_noise_term_is_what_noise_does() -> None:
    """The predicted scatter of the energies is the one that repeated noisy records show."""
    ellipse = Ellipse()
    noisy = [make_record(*ellipse.columns(1.0, 400.0, 3.4, noise=2e-3, seed=k)) for k in range(40)]
    found: dict[str, list[float]] = {"stored_energy_J": [], "absorbed_energy_J": []}
    predicted: dict[str, float] = {}
    draws = _draws(NOTHING)
    for record in noisy:
        cycle = find_cycles(record)[1]
        loop = CyclePropagation(record, cycle, record_noise(record))
        stored, absorbed = loop.energies(draws, turn_errors(draws, cycle))
        found["stored_energy_J"].append(float(np.mean(stored)))
        found["absorbed_energy_J"].append(float(np.mean(absorbed)))
        predicted = {"stored_energy_J": float(np.std(stored)), "absorbed_energy_J": float(np.std(absorbed))}
    for name, values in found.items():
        assert np.std(values) == pytest.approx(predicted[name], rel=0.5)


@pytest.mark.slow
def test_same_seed_same_figures() -> None:
    force = ChannelUncertainty(accuracy_percent=1.0, zero=0.3)
    first, again = draw_errors(force, (NOTHING,), 100, 3), draw_errors(force, (NOTHING,), 100, 3)
    other = draw_errors(force, (NOTHING,), 100, 4)
    assert first is not None
    assert again is not None
    assert other is not None
    np.testing.assert_array_equal(first.force, again.force)
    assert not np.array_equal(first.force, other.force)


@pytest.mark.slow
def test_no_facts_no_draws() -> None:
    assert draw_errors(None, (NOTHING,), 10, 1) is None
    assert draw_errors(ChannelUncertainty(zero=1.0), (NOTHING,), 10, 1) is None
    assert draw_errors(NOTHING, (), 10, 1) is None
    assert draw_errors(NOTHING, (NOTHING, ChannelUncertainty()), 10, 1) is None
    assert mean_of_wires(()) is None


@pytest.mark.slow
def test_missing_facts_are_named() -> None:
    assert missing_facts(None, ()) == [
        "no expanded uncertainties: the force channel states no accuracy",
        "no expanded uncertainties: the stroke channel states neither accuracy nor linearity",
    ]
    partly = missing_facts(
        ChannelUncertainty(accuracy_percent=0.5, zero=0.1, u_delay_s=0.0),
        (ChannelUncertainty(linearity=0.1, zero=0.1, u_delay_s=0.0),),
    )
    assert partly == [
        "the force channel states no reversibility_percent: its part of the uncertainty is missing"
    ]


@pytest.mark.slow
def test_expanded_is_twice_the_standard_uncertainty() -> None:
    assert expanded(np.array([1.0, 3.0])) == 2.0


@pytest.mark.slow
def test_reading_out_of_reach() -> None:
    assert LOOP.read(100.5, 2.0) is None
    assert LOOP.fit(50.0, 200.0, 210.0, 2) is None
