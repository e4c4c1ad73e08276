"""Proof loads: force reached, permanent deformation, what the inspector says, and what is not known."""

from __future__ import annotations

from datetime import date
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.inspection import Inspection, InspectionFinding, InspectionHead
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.requirements.limit_set import LimitSet, shipped_limit_set
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED


def with_tolerance(name: str, tolerance_mm: float) -> LimitSet:
    """Return the shipped set with the manufacturer's tolerance filled in for one load."""
    limits = shipped_limit_set()
    assert limits.proof is not None
    loads = tuple(
        load.model_copy(update={"permanent_deformation_max_mm": tolerance_mm}) if load.id == name else load
        for load in limits.proof.load
    )
    return limits.model_copy(update={"proof": limits.proof.model_copy(update={"load": loads})})


def inspected(result: str) -> Inspection:
    head = InspectionHead(specimen="B", inspector="N. N.", date=date(2026, 1, 15))
    return Inspection(inspection=head, item=(InspectionFinding(id="serviceable-condition", result=result),))  # type: ignore[arg-type]


def proof(
    peak_kN: float = 520.0,
    residual_mm: float = 0.3,
    load: str | None = "F2",
    *,
    limits: LimitSet | None = None,
    inspection: Inspection | None = None,
    relieved: tuple[bool, bool] = (True, True),
    loads: int = 1,
    **options: Any,
) -> RunEvaluation:
    """Evaluate a proof load of 20 mm stroke that leaves a residual stroke."""
    rate, leg = 100, 400
    stroke, force = [np.zeros(2 * rate if relieved[0] else 1)], [np.zeros(2 * rate if relieved[0] else 1)]
    for number in range(loads):
        low = residual_mm if number else 0.0
        rise = np.linspace(0.0, 1.0, leg)
        stroke += [low + (20.0 - low) * rise, 20.0 - (20.0 - residual_mm) * rise]
        force += [peak_kN * rise, peak_kN * (1.0 - rise) ** 2]
    if relieved[1]:
        stroke.append(np.full(3 * rate, residual_mm))
        force.append(np.zeros(3 * rate))
    else:
        stroke[-1], force[-1] = stroke[-1][: leg // 2], force[-1][: leg // 2]
    if not relieved[0]:
        force[1] = np.maximum(force[1], 30.0)
        force[0] = np.full(1, 30.0)
    random = np.random.default_rng(5)
    x, f = np.concatenate(stroke), np.concatenate(force)
    record = make_record(
        np.arange(x.size) / rate,
        x + 0.002 * random.standard_normal(x.size),
        f + 0.05 * random.standard_normal(x.size),
    )
    facts = RunFacts("proof-1", "proof", specimen={"id": "B", "kind": "buffer", "max_stroke_mm": 105.0},
                     proof_load=load, **STATED)  # type: ignore[arg-type]  # fmt: skip
    found = () if inspection is None else (inspection,)
    return evaluate_run(record, facts, Options(draws=100, inspections=found, **options), limits)


def verdicts(run: RunEvaluation) -> dict[str, str]:
    return {row.id: row.verdict for row in run.requirements}


F2 = with_tolerance("F2", 1.0)
GOOD = {"proof-load-f2": "pass", "permanent-deformation": "pass", "serviceable-condition": "pass"}


def test_proof_load_borne() -> None:
    run = proof(limits=F2, inspection=inspected("in-order"))
    assert verdicts(run) == GOOD
    assert run.verdict == "pass"
    rows = {row.id: row for row in run.requirements}
    assert rows["proof-load-f2"].measured == pytest.approx(520.0, rel=6e-3)
    assert rows["proof-load-f2"].condition
    assert rows["permanent-deformation"].measured == pytest.approx(0.3, abs=0.002)
    # U of the force: 2/√3 of 0.5 % of 520 kN and 0.3 kN.
    assert rows["proof-load-f2"].expanded_uncertainty == pytest.approx(3.01, rel=0.02)
    assert rows["permanent-deformation"].expanded_uncertainty is not None
    assert run.inspection is not None
    assert len(run.inspection["sha256"]) == 64


def test_without_the_manufacturers_tolerance_it_is_inconclusive() -> None:
    run = proof(inspection=inspected("in-order"))
    assert verdicts(run) == {**GOOD, "permanent-deformation": "inconclusive"}
    row = run.requirements[1]
    assert row.measured == pytest.approx(0.3, abs=0.002)
    assert (row.upper_limit, row.conformance_probability) == (None, None)
    assert "to be filled in" in row.why
    assert run.verdict == "inconclusive"


@pytest.mark.parametrize(
    ("changes", "identity", "verdict"),
    [
        ({"residual_mm": 1.4}, "permanent-deformation", "fail"),
        ({"inspection": inspected("defect")}, "serviceable-condition", "fail"),
        ({"inspection": inspected("fill-in")}, "serviceable-condition", "not-tested"),
        ({"inspection": None}, "serviceable-condition", "not-tested"),
        ({"relieved": (False, True)}, "permanent-deformation", "inconclusive"),
        ({"relieved": (True, False)}, "permanent-deformation", "inconclusive"),
    ],
)
def test_one_thing_wrong(changes: dict[str, Any], identity: str, verdict: str) -> None:
    run = proof(**({"limits": F2, "inspection": inspected("in-order")} | changes))
    assert verdicts(run) == {**GOOD, identity: verdict}
    assert run.verdict == ("inconclusive" if verdict == "not-tested" else verdict)


def test_a_force_not_reached_is_inconclusive_and_no_failure_of_the_specimen() -> None:
    run = proof(peak_kN=480.0, limits=F2, inspection=inspected("in-order"))
    assert verdicts(run) == {**GOOD, "proof-load-f2": "inconclusive", "permanent-deformation": "inconclusive"}
    assert "stopped short" in run.requirements[0].why
    bent = proof(peak_kN=480.0, residual_mm=1.8, limits=F2, inspection=inspected("in-order"))
    assert verdicts(bent)["permanent-deformation"] == "fail"
    assert bent.verdict == "fail"


def test_guard_band() -> None:
    near = {"limits": F2, "inspection": inspected("in-order"), "decision_rule": "guard-band"}
    assert verdicts(proof(peak_kN=503.0, **near))["proof-load-f2"] == "conditional-pass"
    assert verdicts(proof(residual_mm=0.97, **near))["permanent-deformation"] == "conditional-pass"
    assert verdicts(proof(residual_mm=1.03, **near))["permanent-deformation"] == "conditional-fail"


@pytest.mark.parametrize("load", [None, "F9"])
def test_unknown_load(load: str | None) -> None:
    run = proof(load=load)
    assert verdicts(run) == {"proof-load": "inconclusive"}
    assert "F1, F2, F3, F4, F5, F6" in run.requirements[0].why


FORCES = {"F1": 2500.0, "F2": 500.0, "F3": 200.0, "F4": 2500.0, "F5": 250.0, "F6": 250.0}


@pytest.mark.slow
@pytest.mark.parametrize("load", FORCES)
def test_forces_of_the_source(load: str) -> None:
    over = verdicts(proof(peak_kN=1.05 * FORCES[load], load=load))
    assert over[f"proof-load-{load.lower()}"] == "pass"
    assert (
        verdicts(proof(peak_kN=0.95 * FORCES[load], load=load))[f"proof-load-{load.lower()}"]
        == "inconclusive"
    )
    assert ("permanent-deformation" in over) == (load in ("F1", "F2", "F3", "F5"))
    assert ("serviceable-condition" in over) == (load in ("F1", "F2", "F3", "F5"))
    assert ("load-cycles" in over) == (load == "F6")


def test_the_garbled_words_on_f5_are_not_printed() -> None:
    load = shipped_limit_set().proof_load("F5")
    assert load is not None
    assert "450" not in load.text
    assert all("450" not in row.requirement + row.why for row in proof(load="F5").requirements)


@pytest.mark.slow
def test_durability_cycles() -> None:
    run = proof(peak_kN=260.0, load="F6", loads=4, residual_mm=0.1)
    assert verdicts(run) == {"proof-load-f6": "pass", "load-cycles": "inconclusive"}
    limits = shipped_limit_set()
    assert limits.proof is not None
    six = limits.proof.load[-1].model_copy(update={"cycles_min": 4})
    own = limits.model_copy(update={"proof": limits.proof.model_copy(update={"load": (six,)})})
    for count, verdict in ((3, "inconclusive"), (4, "pass"), (5, "pass")):
        counted = proof(peak_kN=260.0, load="F6", loads=count, residual_mm=0.1, limits=own)
        assert verdicts(counted)["load-cycles"] == verdict
