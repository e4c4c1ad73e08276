"""What follows of a finding: for every row, for means, uncertainties, extremes, trends, the document."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest

from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.document.build import evaluation_document, run_entry
from bufferstand.evaluation.facts.document_types import FindingKind
from bufferstand.evaluation.facts.finding import Finding
from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.plausibility.affected_figures import BOTH, ROWS, SpoiledFigures, read_from
from tests.evaluation.plausibility.records import STRETCH, found, harmonic, of_kind, static
from tests.evaluation.test_impact import impact
from tests.evaluation.test_nulls import unexplained
from tests.evaluation.test_proof import proof

CONCLUDED = {"pass", "conditional-pass", "conditional-fail", "fail", "invalid"}


def rows(run: RunEvaluation) -> dict[tuple[str, int | None], str]:
    return {(row.id, row.cycle): row.verdict for row in run.requirements}


@pytest.mark.parametrize("channel", ["force", "stroke", "stroke_2", "temperature_1"])
def test_every_row_of_a_static_test_hangs_on_its_channels(
    monkeypatch: pytest.MonkeyPatch, channel: str
) -> None:
    good = rows(static())
    found(monkeypatch, channel, (2,))
    run = static()
    bad, quantity = rows(run), channel.split("_", maxsplit=1)[0]
    assert bad.keys() == good.keys()
    for (identity, cycle), verdict in good.items():
        taken = quantity in read_from(identity) and cycle in (None, 2)
        if taken:
            assert bad[identity, cycle] == "inconclusive", identity
        elif quantity != "stroke" and not (quantity == "temperature" and cycle == 2):
            assert bad[identity, cycle] == verdict, identity
    reasons = [row.why for row in run.requirements if quantity in read_from(row.id) and row.cycle == 2]
    assert reasons
    assert all(STRETCH in why for why in reasons)
    assert run.verdict == "inconclusive"


def test_what_a_spoiled_stroke_governs_is_inconclusive_in_every_stroke(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found(monkeypatch, "stroke", (2,))
    run = static()
    governed = {row.verdict for row in run.requirements if not row.condition}
    assert governed == {"inconclusive"}  # how many strokes there were is not known


ROWS_OF_TESTS = {
    "static": lambda: static(preload_kN=5.0, speed_mm_per_s=80.0, temperature_C=30.0),  # many rows fail
    "static that passes": static,
    "impact": lambda: impact(scale=0.5, category="A", rebound=0.3, speed_km_h=9.0),
    "proof": proof,
}


@pytest.mark.parametrize("test", ROWS_OF_TESTS)
def test_no_row_concludes_anything_from_a_channel_that_a_finding_of_any_kind_spoils(
    monkeypatch: pytest.MonkeyPatch, test: str
) -> None:
    """Every kind of finding, every channel, each cycle and the record as a whole, against every row."""
    run = ROWS_OF_TESTS[test]()
    events = run.facts.kind in ("impact", "proof")
    numbers = [result.cycle.index for result in run.cycles]
    for channel in ("force", "stroke", "stroke_1", "temperature_1"):
        quantity = channel.split("_", maxsplit=1)[0]
        for cycles in ((), *((number,) for number in numbers), tuple(numbers)):
            for kind in get_args(FindingKind):
                finding = Finding(kind, channel, 0.0, 0.0, cycles, None, "", STRETCH, "spoils")
                spoiled = SpoiledFigures((finding,))
                for row in run.requirements:
                    of_cycle = None if events else row.cycle
                    hit = quantity in read_from(row.id) and (of_cycle is None or of_cycle in cycles)
                    assert (spoiled.of_row(row.id, of_cycle) is finding) == hit
        found(monkeypatch, channel, tuple(numbers))
        of_channel = [row for row in ROWS_OF_TESTS[test]().requirements if row.why and quantity in _read(row)]
        assert of_channel or quantity == "temperature"
        # A condition of another channel that is broken makes it invalid all the same.
        assert not (CONCLUDED - {"invalid"}) & {row.verdict for row in of_channel}
        monkeypatch.undo()


def _read(row: RequirementResult) -> tuple[str, ...]:
    """Return what a row is read from; what is answered by hand from nothing."""
    by_hand = row.verdict == "not-tested" and row.measured is None
    return () if by_hand else read_from(row.id)


@pytest.mark.parametrize("kind", get_args(FindingKind))
def test_a_finding_of_every_kind_takes_the_rows_of_its_channel(
    monkeypatch: pytest.MonkeyPatch, kind: FindingKind
) -> None:
    found(monkeypatch, "force", (1, 2, 3), kind=kind)
    run = static(preload_kN=5.0)
    of_force = {row.verdict for row in run.requirements if "force" in read_from(row.id)}
    assert of_force == {"inconclusive"}
    assert run.verdict == "inconclusive"


def test_a_failing_row_is_no_failure_where_its_channel_is_spoiled(monkeypatch: pytest.MonkeyPatch) -> None:
    assert rows(static(preload_kN=5.0))["preload", 1] == "fail"
    found(monkeypatch, "force", (1, 2, 3))
    run = static(preload_kN=5.0)
    assert "fail" not in rows(run).values()
    assert run.verdict == "inconclusive"
    spoiled = [row for row in run.requirements if row.id == "preload"]
    assert all(row.measured is not None for row in spoiled)
    assert all(row.expanded_uncertainty is None and row.conformance_probability is None for row in spoiled)


def test_a_condition_that_is_broken_otherwise_stays_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, "force", (1,))
    run = static(temperature_C=30.0)
    assert rows(run)["temperature-range", 1] == "fail"
    assert run.verdict == "invalid"


def test_a_broken_condition_of_a_spoiled_channel_makes_nothing_invalid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert static(speed_mm_per_s=80.0).verdict == "invalid"
    found(monkeypatch, "stroke", (1, 2, 3))
    run = static(speed_mm_per_s=80.0)
    assert run.verdict == "inconclusive"
    assert not CONCLUDED & {row.verdict for row in run.requirements if "stroke" in read_from(row.id)}


def test_noted_takes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    good = static()
    found(monkeypatch, "force", (1, 2, 3), "noted")
    run = static()
    assert rows(run) == rows(good)
    assert run.summary == good.summary
    assert any(STRETCH in text for text in run.warnings)


@pytest.mark.parametrize("channel", ["force", "stroke"])
def test_an_impact_with_a_spoiled_cycle_is_inconclusive(
    monkeypatch: pytest.MonkeyPatch, channel: str
) -> None:
    assert impact(scale=0.5, category="A", rebound=0.3, speed_km_h=9.0).verdict == "fail"
    found(monkeypatch, channel, (2,))  # the rebound: it may have been the impact
    run = impact(scale=0.5, category="A", rebound=0.3, speed_km_h=9.0)
    assert {row.verdict for row in run.requirements if row.id != "impact-speed"} == {"inconclusive"}
    assert rows(run)["impact-speed", None] == "pass"


def test_rows_of_a_proof_load(monkeypatch: pytest.MonkeyPatch) -> None:
    good = rows(proof())
    found(monkeypatch, "stroke", (1,))
    of_stroke = rows(proof())
    assert of_stroke["proof-load-f2", None] == good["proof-load-f2", None] == "pass"
    assert of_stroke["permanent-deformation", None] == "inconclusive"
    found(monkeypatch, "force", ())
    of_force = rows(proof())
    assert of_force["proof-load-f2", None] == of_force["permanent-deformation", None] == "inconclusive"
    by_hand = ("serviceable-condition", None)
    assert of_force[by_hand] == good[by_hand] == "not-tested"


def test_channels_of_all_figures_are_declared() -> None:
    read = {entry.name: entry.reads for entry in QUANTITIES}
    assert read["stroke_max_mm"] == read["frequency_Hz"] == {"stroke"}
    assert read["temperature_max_C"] == {"temperature"}
    assert all(read[name] == set(BOTH) for name in ("force_max_kN", "stored_energy_J", "loss_factor"))
    assert set(ROWS) >= {"cycle-count", "speed-limit", "temperature-range", "rest-after-assembly"}


def test_means_leave_spoiled_cycles_out_while_others_remain(monkeypatch: pytest.MonkeyPatch) -> None:
    good = harmonic()
    found(monkeypatch, "force", (2, 3))
    run = harmonic()
    assert run.summary.cycles_used == tuple(n for n in good.summary.cycles_used if n not in (2, 3))
    assert run.summary.values["damping"].expanded_uncertainty is not None
    assert not run.unfit
    assert any("cycles 2, 3: not among the means" in text for text in run.warnings)
    spoiled = run.cycles[1].expanded_uncertainty
    assert spoiled["stored_energy_J"] is None
    assert spoiled["stroke_max_mm"] is not None
    assert not unexplained(run)


def test_means_of_spoiled_cycles_alone_claim_no_uncertainty(monkeypatch: pytest.MonkeyPatch) -> None:
    good = harmonic()
    found(monkeypatch, "force", tuple(range(1, 8)))
    run = harmonic()
    assert run.summary.cycles_used == good.summary.cycles_used
    assert run.unfit
    damping, amplitude = run.summary.values["damping"], run.summary.values["amplitude_mm"]
    assert damping.value == good.summary.values["damping"].value
    assert damping.expanded_uncertainty is None
    assert damping.half_width_95 is None
    assert amplitude.expanded_uncertainty is not None  # read from the stroke alone
    assert not run.budget
    assert run.shared_errors is None
    assert not unexplained(run)


def test_spoiled_runs_are_no_points_of_a_trend(monkeypatch: pytest.MonkeyPatch) -> None:
    good = [harmonic(loss=0.6), harmonic(loss=0.7)]
    for number, run in enumerate(good):
        mean = replace(run.summary.values["frequency_Hz"], value=1.0 + number)
        values = {**run.summary.values, "frequency_Hz": mean}
        good[number] = replace(
            run,
            facts=replace(run.facts, id=f"h{number}"),
            summary=replace(run.summary, values=values),
        )
    assert evaluation_document(good)["trends"]
    assert not evaluation_document([good[0], replace(good[1], unfit=True)])["trends"]


def test_document_has_the_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, "force", (1,), start_s=0.5, end_s=0.75)
    run = harmonic()
    assert run_entry(run)["plausibility"] == [
        {
            "kind": "spike",
            "channel": "force",
            "start_s": 0.5,
            "end_s": 0.75,
            "cycles": [1],
            "size": 1.0,
            "unit": "kN",
            "text": STRETCH,
            "effect": "spoils",
        }
    ]
    assert of_kind(run, "spike")


def test_an_extreme_at_a_finding_is_doubtful(monkeypatch: pytest.MonkeyPatch) -> None:
    good = harmonic().extremes
    at_s = good["force_max_kN"].time_s
    assert at_s is not None
    assert not good["force_max_kN"].doubt
    found(monkeypatch, "force", (1,), start_s=at_s, end_s=at_s)
    extremes = harmonic().extremes
    assert extremes["force_max_kN"].doubt == STRETCH
    assert extremes["force_max_kN"].expanded_uncertainty is None
    assert extremes["force_min_kN"] == good["force_min_kN"]
