"""What lies between the samples of cycles that have few: bounded by half of them, or without figures."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.gaps.coarse_sampling import SMOOTH_SHARE, halves_bound, no_less_than_usual
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.made_to_order import MadeTest, OneCycle
from tests.evaluation.signals import BUFFER, STARTED, STATED

STATIC = RunFacts("static", "static", specimen=dict(BUFFER), started=STARTED, **STATED)  # type: ignore[arg-type]


def every(step: int, first: int = 0) -> RunEvaluation:
    """Return a static test of which the logger kept one of so many samples."""
    record = MadeTest((OneCycle(),) * 3).record()
    kept = slice(first, None, step)
    thinned = make_record(
        record.time_s[kept].copy(),
        record.stroke_mm[kept].copy(),
        record.force_kN[kept].copy(),
        temperatures=record.temperatures,
    )
    return evaluate_run(thinned, STATIC, Options(draws=200))


UNSEEN = pytest.mark.xfail(strict=True, reason="a recovery within a step looks like a jump from either half")


@pytest.mark.parametrize("step", [4, pytest.param(8, marks=UNSEEN), 16, 32])
def test_a_cycle_of_few_samples_is_within_its_bound_or_has_no_figures(step: int) -> None:
    whole = every(1)
    evaluated = 0
    for first in (0, step // 2):
        run = every(step, first)
        assert len(run.cycles) == 3, "a stroke happened, evaluated or not"
        for one, other in zip(whole.cycles, run.cycles, strict=True):
            if not other.cycle.complete:
                assert any("what lies between its samples" in why for why in other.cycle.why)
                continue
            evaluated += 1
            true_J, found_J = one.quantities.absorbed_energy_J, other.quantities.absorbed_energy_J
            assert true_J is not None
            assert found_J is not None
            bound_J = abs(other.gap_limits.get("absorbed_energy_J", 0.0))
            assert abs(found_J - true_J) <= max(bound_J, 1e-3 * true_J)
    assert step == 4 or evaluated == 0


def test_no_requirement_fails_or_passes_on_a_stroke_of_few_samples() -> None:
    rows = [row for row in every(32).requirements if not row.condition]
    assert rows
    assert {row.verdict for row in rows} == {"inconclusive"}


def test_a_jump_within_a_step_is_bounded_by_both_halves() -> None:
    """Of F from 0 to 1 anywhere in a step h, the area is wrong by up to h / 2; the halves differ by h."""
    rng = np.random.default_rng(0)
    for at in rng.uniform(3.0, 6.0, 50):
        x = np.arange(10.0)
        force = (x > at).astype(float)
        areas = [float(np.trapezoid(force[part], x[part])) for part in (slice(None), slice(0, None, 2))]
        odd = np.concatenate(([0], np.arange(1, 10, 2)))
        even = np.append(np.arange(0, 10, 2), 9)
        areas[1:] = [float(np.trapezoid(force[part], x[part])) for part in (even, odd)]
        bound = halves_bound(areas[1] - areas[0], areas[2] - areas[0], 1.0)
        assert abs(areas[0] - (9.0 - at)) <= abs(bound) + 1e-12


def test_a_bound_is_never_far_below_those_of_like_cycles() -> None:
    bounds = {1: {"a": 4.0}, 2: {"a": -0.1}, 3: {"a": 5.0}, 4: {"a": 0.1}}
    ranges = {1: 50.0, 2: 50.1, 3: 49.9, 4: 5.0}
    assert no_less_than_usual(bounds, ranges) == {
        1: {"a": 4.0},
        2: {"a": -4.0},
        3: {"a": 5.0},
        4: {"a": 0.1},
    }
    assert SMOOTH_SHARE == 1.0 / (2.0**4 - 1.0)
