"""The linear budget: agrees with the Monte Carlo propagation, adds up, and states every source."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bufferstand.evaluation.catalogue.every_quantity import MAIN
from bufferstand.evaluation.document.build import run_entry
from bufferstand.evaluation.facts.budget import Budget, budget_entry
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.signals import STATED, Ellipse, StaticTest

FORCE = ChannelUncertainty(accuracy_percent=1.0, reversibility_percent=1.5, zero=1.0, u_delay_s=1e-4)
WIRES = (ChannelUncertainty(linearity=0.5, zero=0.2, accuracy_percent=0.1, u_delay_s=2e-5),)


def harmonic(frequency: float, noise: float, force: ChannelUncertainty = FORCE) -> RunEvaluation:
    record = make_record(*Ellipse().columns(frequency, 1000.0, 8.4, noise=noise))
    facts = RunFacts("h", "harmonic", force_uncertainty=force, stroke_uncertainty=WIRES)
    return evaluate_run(record, facts, Options(draws=10_000))


def gapped() -> RunEvaluation:
    """Return a run by very good channels that lacks 0.08 s in two of its cycles."""
    columns = Ellipse().columns(0.5, 100.0, 5.4, noise=2e-5)
    lost = [start + n for start in (290, 493) for n in range(8)]
    record = make_record(*(np.delete(column, lost) for column in columns))
    force = ChannelUncertainty(accuracy_percent=0.005, reversibility_percent=0.01, zero=0.01, u_delay_s=1e-6)
    wire = ChannelUncertainty(linearity=0.005, zero=0.01, accuracy_percent=0.002, u_delay_s=0.0)
    facts = RunFacts("g", "harmonic", force_uncertainty=force, stroke_uncertainty=(wire,))
    return evaluate_run(record, facts, Options(draws=10_000))


RUNS: dict[str, Callable[[], RunEvaluation]] = {
    "gaps": gapped,
    "static": lambda: StaticTest().evaluate(draws=10_000),
    "0.5 Hz": lambda: harmonic(0.5, 2e-4),
    "2.5 Hz": lambda: harmonic(2.5, 5e-4),
    "no reversibility": lambda: harmonic(1.0, 5e-4, ChannelUncertainty(accuracy_percent=0.5, zero=0.5)),
}


@cache
def made(name: str) -> RunEvaluation:
    """Return the run of that name: made once a process, and not when the tests are collected."""
    return RUNS[name]()


@pytest.fixture
def run(request: pytest.FixtureRequest) -> RunEvaluation:
    return made(request.param)


every_run = pytest.mark.parametrize("run", RUNS, indirect=True)


def of(run: RunEvaluation, name: str) -> Budget:
    return next(b for b in run.budget if b.quantity == name)


@every_run
@pytest.mark.parametrize("name", MAIN.names)
def test_agrees_with_the_monte_carlo_propagation(run: RunEvaluation, name: str) -> None:
    budget = of(run, name)
    assert budget.u_monte_carlo is not None
    assert budget.u == pytest.approx(budget.u_monte_carlo, rel=0.05)
    assert budget.value == run.summary.values[name].value


@every_run
def test_contributions_add_up(run: RunEvaluation) -> None:
    assert [b.quantity for b in run.budget] == list(MAIN.names)
    for budget in run.budget:
        total = math.sqrt(sum(line.contribution**2 for line in budget.lines))
        assert total == pytest.approx(budget.u, rel=1e-9)
        for line in budget.lines:
            if line.sensitivity is not None:
                assert abs(line.sensitivity) * line.u == pytest.approx(line.contribution, rel=1e-9)


def test_what_is_not_on_record_is_a_line_of_each_result() -> None:
    """Rectangular, with the mean of the cycles' limits; a run that lacks nothing has no such line."""
    used = set(made("gaps").summary.cycles_used)
    cycles = [cycle for cycle in made("gaps").cycles if cycle.cycle.index in used]
    assert sum(bool(cycle.gap_limits) for cycle in cycles) >= 2
    shares = {}
    for budget in made("gaps").budget:
        limits = [cycle.gap_limits.get(budget.quantity, 0.0) for cycle in cycles]
        (line,) = [line for line in budget.lines if line.source == "what is not on record"]
        assert line.limit == pytest.approx(abs(sum(limits)) / len(cycles))
        assert line.distribution == "rectangular"
        assert line.contribution == pytest.approx(line.limit / math.sqrt(3.0))
        shares[budget.quantity] = line.contribution / budget.u
    assert max(shares.values()) > 0.3, "it counts here, so that agreeing with the draws says something"
    assert all("not on record" not in line.source for b in made("static").budget for line in b.lines)


def test_shared_inputs_are_correlated() -> None:
    """The force scale is most of either energy's uncertainty and nothing of damping's."""
    run = made("0.5 Hz")
    stored, damping = of(run, "stored_energy_J"), of(run, "damping")
    scale = {b.quantity: b.lines[0] for b in (stored, damping)}
    assert scale["stored_energy_J"].source == "force: scale (class)"
    assert scale["stored_energy_J"].contribution == pytest.approx(
        0.01 / math.sqrt(3.0) * stored.value, rel=1e-6
    )
    assert scale["damping"].contribution < 1e-9
    independent = math.hypot(
        stored.u / stored.value, of(run, "absorbed_energy_J").u / of(run, "absorbed_energy_J").value
    )
    assert damping.u / damping.value < 0.9 * independent


def test_sensitivities_by_hand() -> None:
    """Zero of the force: W_s by the range of the stroke; skew: W_a by π K′ ω A² (docs/facts/standards.md)."""
    run = made("2.5 Hz")
    lines = {line.source: line for line in of(run, "stored_energy_J").lines}
    assert lines["force: zero"].sensitivity == pytest.approx(40.0, rel=1e-3)
    assert lines["force: zero"].u == pytest.approx(1.0 / math.sqrt(3.0))
    lines = {line.source: line for line in of(run, "absorbed_energy_J").lines}
    expected = np.pi * 4.0 * 400.0 * 2.0 * np.pi * 2.5
    assert abs(lines["skew of force to stroke"].sensitivity or 0.0) == pytest.approx(expected, rel=0.01)


def test_degrees_of_freedom() -> None:
    budget = of(made("0.5 Hz"), "damping")
    scatter = budget.lines[-1]
    assert scatter.source == "scatter between cycles"
    assert scatter.degrees_of_freedom == len(made("0.5 Hz").summary.cycles_used) - 1
    assert all(line.degrees_of_freedom is None for line in budget.lines[:-1])
    assert budget.degrees_of_freedom is not None
    assert budget.degrees_of_freedom > 30
    assert budget.coverage_factor_95 == pytest.approx(1.96, abs=0.1)


def test_in_the_document() -> None:
    entry = json.loads(json.dumps(run_entry(made("static")), allow_nan=False))
    assert entry["budget"] == json.loads(json.dumps(budget_entry(made("static").budget)))
    assert [b["quantity"] for b in entry["budget"]] == list(MAIN.names)
    assert {line["source"] for line in entry["budget"][0]["sources"]} >= {
        "force: scale (class)",
        "force: zero",
        "force: reversibility",
        "skew of force to stroke",
        "stroke: scale",
        "stroke: zero",
        "stroke: linearity",
        "noise and resolution",
        "turning points",
        "scatter between cycles",
    }


def test_no_facts_no_budget() -> None:
    assert StaticTest(stated=False).evaluate().budget == ()
    facts = replace(
        RunFacts("h", "harmonic"), **{**STATED, "force_uncertainty": ChannelUncertainty(zero=1.0)}
    )
    record = make_record(*Ellipse().columns(1.0, 200.0, 4.5))
    assert evaluate_run(record, facts, Options(draws=100)).budget == ()
