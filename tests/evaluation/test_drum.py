"""The drum of a draw wire: a wave of its own in the budget, and the slope K_t covered with it."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.uncertainty.error_model import (
    drum_periods_mm,
    mean_of_wires,
    stroke_term_slopes,
    stroke_terms,
)
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.closed_loops import FORCE, WIRES, Progressive, measured

TANGENT = "tangent_stiffness_kN_per_mm"
LOOP = Progressive()


def wires(*drums_mm: float | None) -> tuple[ChannelUncertainty, ...]:
    return tuple(
        wire.model_copy(update={"drum_circumference_mm": drum})
        for wire, drum in zip(WIRES, drums_mm, strict=True)
    )


def run(stated: tuple[ChannelUncertainty, ...], seed: int, draws: int = 400) -> RunEvaluation:
    columns = measured(LOOP, np.random.default_rng(seed), wires=stated)
    facts = RunFacts("d", "harmonic", force_uncertainty=FORCE, stroke_uncertainty=stated)
    return evaluate_run(make_record(*columns), facts, Options(draws=draws, seed=seed))


def test_the_deviation_at_a_stroke_is_as_large_as_without_a_drum() -> None:
    """0.46 of the limit in each wire, of two 0.46 / √2: now of four waves instead of three."""
    for stated in (wires(None, None), wires(150.0, 150.0), wires(150.0, None), wires(150.0, 100.0)):
        facts = mean_of_wires(stated)
        assert facts is not None
        assert sum(wave.joint_u_mm**2 for wave in facts.waves) == pytest.approx((0.46 * 0.5) ** 2 / 2.0)
    assert drum_periods_mm(wires(100.0, 150.0)) == (150.0, 100.0)
    assert drum_periods_mm(wires(None, None)) == ()


def test_terms_and_their_slopes_agree() -> None:
    at, step = 37.0, 1e-5
    both = stroke_terms(np.array([at - step, at + step]), (150.0, 20.0))
    slopes = stroke_term_slopes(at, (150.0, 20.0))
    assert both.shape == (12, 2)
    np.testing.assert_allclose((both[1:, 1] - both[1:, 0]) / (2.0 * step), slopes[1:], rtol=1e-6)
    assert np.all(stroke_terms(np.zeros(1), (150.0,))[2:] == 0.0)


def test_a_shorter_wave_makes_the_slope_less_sure_in_draws_and_budget_alike() -> None:
    found = []
    for drum in (None, 100.0, 50.0, 20.0):
        result = run(wires(drum, drum), 1, 2000)
        (budget,) = [one for one in result.budget if one.quantity == TANGENT]
        assert budget.u_monte_carlo == pytest.approx(budget.u, rel=0.08)
        found.append(budget.u / budget.value)
        assert result.shared_errors is not None
        assert any(name.startswith("drum") for name in result.shared_errors.errors) == (drum is not None)
    assert found[0] < 1.05 * found[1] < found[2] < found[3]


def test_the_statement_is_optional_and_leaves_no_trace_where_it_is_missing() -> None:
    assert "drum_circumference_mm" not in WIRES[0].model_dump()
    assert wires(150.0, 150.0)[0].model_dump()["drum_circumference_mm"] == 150.0


def covered(drum_mm: float, seeds: range) -> tuple[float, float]:
    hits, shares = [], []
    for seed in seeds:
        figure = run(wires(drum_mm, drum_mm), seed).summary.values[TANGENT]
        assert figure.value is not None
        assert figure.half_width_95 is not None
        error = figure.value - LOOP.truth()[TANGENT]
        hits.append(abs(error) <= figure.half_width_95)
        shares.append(1.96 * error / figure.half_width_95)
    return float(np.mean(hits)), float(np.sqrt(np.mean(np.square(shares))))


@pytest.mark.slow
def test_a_dose_of_coverage() -> None:
    hit, share = covered(50.0, range(60))
    assert hit >= 0.85
    assert 0.75 <= share <= 1.25


@pytest.mark.long
@pytest.mark.parametrize("drum_mm", [200.0, 150.0, 100.0, 50.0, 20.0])
def test_the_slope_is_covered(drum_mm: float) -> None:
    hit, _ = covered(drum_mm, range(5000, 6000))
    print(drum_mm, f"{100.0 * hit:.1f}")
    assert 0.93 <= hit <= 0.97
