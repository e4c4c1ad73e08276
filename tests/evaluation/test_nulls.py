"""Every null of the document has a warning (or the requirement's own ``why``) that says why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.document.build import evaluation_document
from bufferstand.evaluation.facts.results import EXTREME_NAMES, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED, Ellipse, StaticTest

REASONS = {
    "cycles.temperature_C": ("no temperature",),
    "summary.temperature": ("no temperature", "no summary", "no cycle found"),
    "cycles.expanded_uncertainty": ("no expanded uncertaint",),
    "cycles": ("no energies nor other figures", "no damping", "no tangent", "no loss factor"),
    "summary": ("no summary", "no cycle found", "no expanded uncertaint", "no damping", "no loss factor"),
    "half_width_95": ("no summary", "no cycle found", "no expanded uncertaint", "no damping", "no loss"),
    "shared_errors": ("no summary", "no cycle found", "no expanded uncertaint"),
    "skew_sensitivity": ("no summary", "no cycle found", "no closed form", "no change of damping"),
    "draw_wires": ("draw wires",),
    "steps.extremes.temperature": ("no temperature", "no expanded uncertaint"),
    "steps.extremes": ("no value", "no expanded uncertaint"),
    "extremes.temperature": ("no temperature", "no expanded uncertaint"),
    "extremes.force": ("no cycle found", "no expanded uncertaint"),
    "extremes.stroke": ("no cycle found", "no expanded uncertaint"),
    "extremes.speed": ("no value", "no cycle found", "no expanded uncertaint"),
    "first_contact.": ("no first contact",),
    "holds": ("no expanded uncertaint",),
    "impact.": ("not on record: impact_", "no cycle found"),
}
NO_VALUES = (
    "settling", "cumulated_energy_J", "plausibility",
    "verdict", "purpose", "limit_set", "inspection", "budget", "requirements.cycle",
    "requirements.lower_limit", "requirements.upper_limit", "requirements.stroke_mm",
    *(f"{part}extremes.{name}.cycle" for name in EXTREME_NAMES for part in ("", "steps.")),
)  # fmt: skip
"""Null means «none» there, and of ``impact`` itself: no verdict is due, no limit on this side, the whole run,
no place, an infinite number, outside of all cycles."""


def nulls(value: Any, path: str = "") -> Iterator[str]:
    if value is None:
        yield path
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from nulls(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for inner in value:
            yield from nulls(inner, path)


def unexplained(run: RunEvaluation) -> set[str]:
    (entry,) = evaluation_document([run])["runs"]
    warnings = entry["warnings"]
    left = set()
    for path in set(nulls({key: value for key, value in entry.items() if key != "run"})):
        if path.startswith(NO_VALUES) or path in ("impact", "first_contact"):
            continue
        if path.startswith("requirements."):
            reasons: tuple[str, ...] = (
                "no measured value of",
                "no expanded uncertainty and conform",
                "no conf",
            )
        else:
            reasons = next(r for prefix, r in REASONS.items() if path.startswith(prefix))
        if not any(reason in text for reason in reasons for text in warnings):
            left.add(path)
    return left


def harmonic(stated: bool = True, warm: bool = True, **options: float) -> RunEvaluation:
    cycles = options.pop("cycles", 5.5)
    columns = Ellipse(**options).columns(1.0, 300.0, cycles)  # type: ignore[arg-type]
    at = np.arange(0.0, columns[0][-1], 0.5)
    sensors = [Temperature("temperature_1", at, np.full(at.size, 22.0), accuracy_C=0.5)] if warm else []
    facts = RunFacts("h", "harmonic", **(STATED if stated else {}))  # type: ignore[arg-type]
    return evaluate_run(make_record(*columns, temperatures=sensors), facts, Options(draws=100))


RUNS = {
    "as from the demo": harmonic(),
    "static": StaticTest().evaluate(draws=100),
    "static, short of the windows": StaticTest(top_mm=50.0, temperature_C=None).evaluate(draws=100),
    "static, nothing stated": StaticTest(stated=False, temperature_C=None).evaluate(draws=100),
    "import without temperature and uncertainty": harmonic(stated=False, warm=False),
    "two-sided": harmonic(mean_kN=0.0),
    "stored energy not positive": harmonic(mean_kN=-200.0),
    "stopped in the first cycle": harmonic(cycles=0.9),
    "impact": evaluate_run(
        make_record(*StaticTest(cycles=1).columns()), RunFacts("i", "impact"), Options(draws=50)
    ),
    "empty": evaluate_run(
        replace(make_record([0.0, 1.0], [0.0, 0.0], [0.0, 0.0])), RunFacts("e", "harmonic", status="stopped")
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_every_null_is_explained(name: str) -> None:
    assert unexplained(RUNS[name]) == set()


def test_a_reason_is_said_once() -> None:
    for run in RUNS.values():
        assert len(run.warnings) == len(set(run.warnings)) < 16


def test_cycles_without_a_reading_near_are_named() -> None:
    columns = Ellipse().columns(0.05, 20.0, 8.5)
    early = Temperature("temperature_1", np.arange(0.0, 60.0), np.full(60, 22.0))
    run = evaluate_run(make_record(*columns, temperatures=[early]), RunFacts("h", "harmonic"))
    text = "no highest temperature: temperature_1 has no reading from "
    assert any(w.startswith("cycles ") and text in w for w in run.warnings)
