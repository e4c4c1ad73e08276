"""What a record holds besides: holds, residual strokes, settling, cumulated energy, runs of one specimen."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.archive.stored_run import keep
from bufferstand.evaluation.document.build import evaluation_document, run_entry, what_runs_say_together
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.report.source import evaluation_hash, without_paths
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.closed_loops import measured
from tests.evaluation.signals import BUFFER, CERTIFIED, STARTED, STATED, Ellipse, Floats, StaticTest
from tests.evaluation.test_coverage_across_runs import Specimen

HARMONIC = RunFacts("h", "harmonic", **STATED)  # type: ignore[arg-type]
STATIC = replace(HARMONIC, kind="static")
FEW = Options(draws=50)


def held(relaxing_kN: float = 0.0, creeping_mm: float = 0.0, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    """Return a stroke up to 60 mm, held for 100 s, and back; by so much a decade from 0.1 s on."""
    time = np.arange(0.0, 130.0, 0.02)
    top = np.interp(time, (0.0, 5.0, 15.0, 115.0, 125.0, 130.0), (0.0, 0.0, 60.0, 60.0, 0.0, 0.0))
    since = np.clip(time - 15.0, 0.0, 100.0)
    decades = np.log10(np.maximum(since, 0.1) / 0.1)
    share = top / 60.0
    random = np.random.default_rng(seed)
    stroke = top + creeping_mm * decades * share + 0.005 * random.standard_normal(time.size)
    force = 20.0 + 5.0 * top - relaxing_kN * decades * share + 0.1 * random.standard_normal(time.size)
    return time, stroke, force


def test_a_force_that_falls_while_the_stroke_rests_relaxes() -> None:
    run = evaluate_run(make_record(*held(relaxing_kN=12.0)), STATIC, FEW)
    (hold,) = run_entry(run)["holds"]
    assert hold["kind"] == "relaxation"
    assert hold["duration_s"] == pytest.approx(100.0, abs=1.0)
    slope = hold["force_per_decade_kN"]
    assert abs(slope["value"] + 12.0) < slope["expanded_uncertainty"] < 0.5
    assert hold["force_end_kN"] - hold["force_start_kN"] == pytest.approx(
        -12.0 * np.log10(975 / 17), rel=0.05
    )
    assert hold["stroke_end_mm"] == pytest.approx(hold["stroke_start_mm"], abs=0.01)


def test_a_stroke_that_grows_under_a_steady_force_creeps() -> None:
    run = evaluate_run(make_record(*held(creeping_mm=0.25)), STATIC, FEW)
    (hold,) = run_entry(run)["holds"]
    assert hold["kind"] == "creep"
    slope = hold["stroke_per_decade_mm"]
    assert abs(slope["value"] - 0.25) < slope["expanded_uncertainty"] < 0.05


def test_noise_alone_is_no_relaxation_within_its_uncertainty() -> None:
    inside = 0
    for seed in range(12):
        record = make_record(*held(seed=seed))
        (hold,) = run_entry(evaluate_run(record, STATIC, FEW))["holds"]
        slope = hold["force_per_decade_kN"]
        inside += abs(slope["value"]) <= slope["expanded_uncertainty"]
    assert inside >= 9


def test_a_residual_stroke_and_what_the_pause_takes_back() -> None:
    run = StaticTest(residual_mm=1.5).evaluate(draws=50)
    first = run_entry(run)["residual_strokes"][0]
    assert first["residual_mm"] == pytest.approx(1.5, abs=0.05)
    assert first["pause_s"] == pytest.approx(5.0, abs=0.2)
    assert abs(first["recovered_mm"]) < 0.05


def settling_run(share: float = 0.2, cycles: int = 30, gain: float = 1.0) -> RunEvaluation:
    """Return a run whose loss falls to its end by a share, with a time constant of five cycles.

    ``gain``: what the force channel makes of the force.
    """
    time = np.arange(cycles * 300 + 1) / 300.0
    loss = 0.6 * (1.0 + share * np.exp(-time / 5.0))
    angle = 2.0 * np.pi * time - 0.5 * np.pi
    stroke = 50.0 + 20.0 * np.sin(angle)
    force = 200.0 + 4.0 * (stroke - 50.0) + loss * 20.0 * np.cos(angle)
    return evaluate_run(make_record(time, stroke, gain * force), HARMONIC, Options(draws=50))


def test_absorbed_energy_settles() -> None:
    entry = run_entry(settling_run())
    (found,) = [one for one in entry["settling"] if one["quantity"] == "absorbed_energy_J"]
    assert found["relative_change"] == pytest.approx(1.0 / (1.0 + 0.2 * np.exp(-0.1)) - 1.0, rel=0.03)
    # 0.2 exp(-t / 5) = 0.02 at t = 5 ln 10 = 11.5
    assert 11 <= found["settled_at_cycle"] <= 13
    assert found["rate_per_cycle"] < 0.0
    assert abs(found["last"] - found["first"]) > found["expanded_uncertainty"]


def test_energies_add_up_and_what_was_not_evaluated_is_named() -> None:
    run = settling_run(0.0)
    entry = run_entry(run)["cumulated_energy_J"]
    each = [c.quantities.absorbed_energy_J for c in run.cycles]
    known = [value for value in each if value is not None]
    assert entry["absorbed"] == pytest.approx(sum(known))
    assert entry["absorbed"] == pytest.approx(len(known) * np.pi * 0.6 * 400.0, rel=1e-3)
    assert entry["cycles"] == len(known)
    assert entry["not_evaluated"] == [
        c.cycle.index for c in run.cycles if c.quantities.absorbed_energy_J is None
    ]
    assert entry["expanded_uncertainty"] > 0.0


def of_specimen(number: int, loss: float, specimen: str = "B1", **more: Any) -> RunEvaluation:
    facts = replace(
        HARMONIC,
        id=f"run-{number}",
        specimen=BUFFER | {"id": specimen},
        started=STARTED + timedelta(hours=number),
        **more,
    )
    columns = Ellipse(loss=loss).columns(1.0, 300.0, 6.5, noise=1e-4, seed=number)
    return evaluate_run(make_record(*columns), facts, Options(draws=200))


def test_runs_of_a_specimen_are_compared_before_and_after_in_their_order() -> None:
    runs = [of_specimen(2, 0.54), of_specimen(1, 0.60), of_specimen(3, 0.6, specimen="B2")]
    (found,) = evaluation_document(runs)["before_after"]
    assert found["specimen"] == "B1"
    assert found["before"]["run"] == "run-1"
    (after,) = found["after"]
    assert after["run"] == "run-2"
    change = after["changes"]["absorbed_energy_J"]
    assert change["relative_change"] == pytest.approx(-0.1, abs=0.005)
    assert change["beyond"]
    stiffness = after["changes"]["tangent_stiffness_kN_per_mm"]
    # Nothing changed: beyond U (2 u) it may be by chance once in twenty, beyond 2 U it is not.
    assert abs(stiffness["change"]) < 2.0 * stiffness["expanded_uncertainty"]
    kept = what_runs_say_together([keep(run).light() for run in runs])
    assert kept["before_after"] == [found], "the same from an archive's cache"


def test_the_preload_before_and_after_survives_the_cache() -> None:
    """Certified channels: what the preloads share leaves their difference."""
    runs = []
    for number, preload_kN in ((1, 15.0), (2, 13.0)):
        record = make_record(*StaticTest(preload_kN=preload_kN).columns())
        facts = replace(
            STATIC, **CERTIFIED, id=f"r{number}", specimen=BUFFER, started=STARTED + timedelta(hours=number)
        )
        runs.append(evaluate_run(record, facts, Options(draws=500)))
    (found,) = evaluation_document(runs)["before_after"]
    change = found["after"][0]["changes"]["preload_kN"]
    rows = [row for row in runs[0].requirements if row.id == "preload"]
    assert len(rows) == 3
    assert change["before"] == pytest.approx(sum(row.measured or 0.0 for row in rows) / 3.0)
    assert (
        abs(change["change"] + 2.0)
        < change["expanded_uncertainty"]
        < 0.5 * (rows[0].expanded_uncertainty or 0.0)
    )
    assert what_runs_say_together([keep(run).light() for run in runs])["before_after"] == [found]


def test_what_was_found_is_the_same_wherever_the_files_lie() -> None:
    """Runs are named again before and after, and under proof load; ``verify`` took the paths for results."""

    def found(folder: str) -> Any:
        steps = [
            of_specimen(n, 0.6 - 0.01 * n, path=f"{folder}/{n}.h5", kind=kind, proof_load=load)
            for n, kind, load in ((1, "harmonic", None), (2, "harmonic", None), (3, "proof", "F6"))
        ]
        return evaluation_document(steps)

    here, there = found("runs"), found("/elsewhere/runs")
    assert here["before_after"]
    assert here["proof_load_totals"]
    assert here != there
    assert without_paths(here) == without_paths(there)
    assert "path" not in repr(without_paths(here))
    assert evaluation_hash(here) == evaluation_hash(there) != evaluation_hash({**here, "before_after": []})


def test_proof_loads_of_a_specimen_are_added_over_runs() -> None:
    runs = [
        of_specimen(n, 0.6, kind="proof", proof_load=load) for n, load in ((1, "F6"), (2, "F6"), (3, "F1"))
    ]
    totals = evaluation_document(runs)["proof_load_totals"]
    assert [(one["specimen"], one["proof_load"]) for one in totals] == [("B1", "F1"), ("B1", "F6")]
    complete = [sum(c.cycle.complete for c in run.cycles) for run in runs]
    assert totals[1]["load_cycles"] == complete[0] + complete[1] > 4
    assert [one["run"] for one in totals[1]["runs"]] == ["run-1", "run-2"]
    assert what_runs_say_together([keep(run).light() for run in runs])["proof_load_totals"] == totals


@pytest.mark.parametrize("stated", [True, False])
def test_what_settles_is_as_sure_as_it_says(stated: bool) -> None:
    """Nothing changes but by noise: four cycles say little of it themselves."""
    facts = replace(HARMONIC, **(STATED if stated else {"force_uncertainty": None, "stroke_uncertainty": ()}))
    inside = []
    for seed in range(12):
        columns = Ellipse().columns(1.0, 200.0, 5.5, noise=5e-4, seed=seed)
        run = evaluate_run(make_record(*columns), facts, Options(draws=200))
        for found in run.history.settling:
            change = found.last - found.first
            inside.append(abs(change) <= (found.expanded_uncertainty or 0.0))
    assert len(inside) == 48
    # Four figures of a run are partly one error: 95 % of 24 independent ones, less 2.5 standard deviations.
    assert np.mean(inside) > 0.84


def test_a_wrong_scale_is_in_what_settles() -> None:
    """It is common to all cycles, but not to their difference: that is wrong by the same share."""
    right, wrong = (
        next(f for f in settling_run(gain=gain).history.settling if f.quantity == "absorbed_energy_J")
        for gain in (1.0, 1.0 + 0.01 * (STATED["force_uncertainty"].accuracy_percent or 0.0))
    )
    off_J = abs((wrong.last - wrong.first) - (right.last - right.first))
    assert 0.0 < off_J <= (wrong.expanded_uncertainty or 0.0)


def test_how_blunt_each_turn_is_read_is_in_what_settles() -> None:
    """Strokes that are alike, by a stand that rounds its tips alike, sampled here and there about them."""
    inside = []
    for seed in range(12):
        random = np.random.default_rng(seed)
        shape = Specimen(0.0, 100.0, 0.025, 0.45, "static", 20.0 + random.uniform(), rounded_s=0.05)
        rate_Hz = random.uniform(5.0, 20.0)
        record = make_record(*measured(shape, random, cycles=3.02, rate_Hz=rate_Hz, noise=(0.15, 0.002)))
        run = evaluate_run(record, replace(HARMONIC, kind="static"), Options(draws=100))
        found = next(f for f in run.history.settling if f.quantity == "stored_energy_J")
        inside.append(abs(found.last - found.first) <= (found.expanded_uncertainty or 0.0))
    assert np.mean(inside) > 0.7  # half of 40 without it, nine tenths with it
