"""Records of few samples a cycle: evaluated, or not and said why; never a crash."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED


def sampled(shape: str, samples: float, phase: float, noise: float = 0.01) -> Record:
    """Return ten cycles of 20 mm with few samples each."""
    count = int(10 * samples) + 1
    p = phase + np.arange(count) / samples
    motion = {
        "sine": np.sin(2.0 * np.pi * p),
        "triangle": 1.0 - 4.0 * np.abs(np.mod(p, 1.0) - 0.5),
        "saw-tooth": 2.0 * np.mod(p, 1.0) - 1.0,
    }[shape]
    stroke = 20.0 + 10.0 * motion
    force = 3.0 * stroke + 10.0 * np.cos(2.0 * np.pi * p)
    stroke = stroke + noise * np.random.default_rng(1).standard_normal(count)
    return make_record(np.arange(count) * 0.1, stroke, force)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["harmonic", "static"])
@pytest.mark.parametrize("shape", ["sine", "triangle", "saw-tooth"])
@pytest.mark.parametrize("samples", [2.5, 5, 8, 10, 15])
def test_no_record_ends_the_evaluation(shape: str, samples: float, kind: str) -> None:
    for phase in (0.0, 0.3, 0.5):
        run = evaluate_run(
            sampled(shape, samples, phase),
            RunFacts("few", kind, **STATED),  # type: ignore[arg-type]
            Options(draws=100),
        )
        for result in run.cycles:
            assert result.cycle.complete or result.cycle.why
            assert result.cycle.complete == (result.quantities.absorbed_energy_J is not None)


def test_a_branch_without_samples_is_named() -> None:
    run = evaluate_run(sampled("saw-tooth", 15, 0.3), RunFacts("few", "harmonic"), Options(draws=0))
    assert run.cycles
    assert not any(r.cycle.complete for r in run.cycles)
    assert any("its unloading branch has 0 samples between the turning points" in w for w in run.warnings)


def test_three_samples_of_a_branch_are_enough_to_look_at_it_and_ten_a_cycle_too_few_for_its_energy() -> None:
    """The loop encloses nothing; read from ten samples it has -4 J, and 13 J from cycle to cycle."""
    run = evaluate_run(sampled("triangle", 10, 0.25), RunFacts("few", "harmonic"), Options(draws=0))
    inner = [r.cycle for r in run.cycles[1:-1]]
    assert len(inner) >= 8
    for cycle in inner:
        assert not cycle.complete
        (why,) = cycle.why
        assert why.startswith("what lies between its samples, 0.1 s apart, may ")


@pytest.mark.slow
def test_what_few_samples_may_hide_is_bounded() -> None:
    """Sines of 314.16 J, from so few samples that they are 1 % off, or from enough."""
    true_J = np.pi * 10.0 * 10.0
    complete = 0
    for samples, phase in ((16.3, 0.25), (20.7, 0.22), (30.3, 0.1), (60.7, 0.0), (120.3, 0.3)):
        run = evaluate_run(
            sampled("sine", samples, phase, noise=0.0),
            RunFacts("few", "harmonic", **STATED),  # type: ignore[arg-type]
            Options(draws=200),
        )
        for result in run.cycles:
            if not result.cycle.complete:
                continue
            complete += 1
            off_J = abs((result.quantities.absorbed_energy_J or 0.0) - true_J)
            assert off_J <= abs(result.gap_limits["absorbed_energy_J"]) + 1e-5 * true_J
            assert off_J <= 5e-3 * true_J
    assert complete >= 20
