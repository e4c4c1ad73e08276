"""Wrong units and signs, and specimens at the ends of the field that have neither."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static
from tests.evaluation.signals import BUFFER, STATED, Ellipse

SPECIMEN = {"kind": "buffer", "category": "A", "max_stroke_mm": 105.0}


def scaled(force: float = 1.0, stroke: float = 1.0) -> Any:
    return lambda t, x, f: (t, stroke * x, force * f)


def swings(ellipse: Ellipse, change: Any = None, **facts: Any) -> RunEvaluation:
    columns = ellipse.columns(1.0, 200.0, 5.2, noise=2e-4)
    columns = columns if change is None else change(*columns)
    about = replace(RunFacts("h1", "harmonic", specimen=SPECIMEN), **{**STATED, **facts})
    return evaluate_run(make_record(*columns), about, Options(draws=0))


@pytest.mark.parametrize(
    ("force", "stroke", "channel"),
    [
        (1000.0, 1.0, "force"),  # N called kN
        (224.809, 1.0, "force"),  # lbf called kN
        (10.0, 1.0, "force"),
        (0.001, 1.0, "force"),  # MN called kN
        (1.0, 0.001, "stroke"),  # m called mm
        (1.0, 1.0 / 25.4, "stroke"),  # in called mm
        (1.0, 10.0, "stroke"),
        (1.0, 1000.0, "stroke"),  # µm called mm
    ],
)
def test_units_of_a_static_test(force: float, stroke: float, channel: str) -> None:
    run = static(scaled(force, stroke))
    assert [(found.kind, found.channel) for found in run.findings] == [("unit", channel)]
    assert run.verdict in ("inconclusive", None)
    assert not {row.verdict for row in run.requirements} & {"pass", "fail", "invalid"} - {"pass"}


def few(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
    """Return six samples a cycle in metres: no cycle has figures."""
    return t[::33], 0.001 * x[::33], f[::33]


def test_metres_where_no_cycle_has_figures() -> None:
    run = swings(Ellipse(), few)
    assert not any(result.cycle.complete for result in run.cycles)
    assert [(found.kind, found.channel) for found in run.findings] == [("unit", "stroke")]


def test_inches_where_no_stroke_has_figures() -> None:
    run = static(lambda t, x, f: (t[::400], x[::400] / 25.4, f[::400]), speed_mm_per_s=6.0)
    assert run.cycles
    assert not any(result.cycle.complete for result in run.cycles)
    assert [(found.kind, found.channel) for found in run.findings] == [("unit", "stroke")]
    right = static(lambda t, x, f: (t[::400], x[::400], f[::400]), speed_mm_per_s=6.0)
    assert not of_kind(right, "unit")


@pytest.mark.parametrize(("stroke", "kinds"), [(1.0 / 25.4, {"clipped", "unit"}), (1.0, {"clipped"})])
def test_inches_where_every_force_is_clipped(stroke: float, kinds: set[str]) -> None:
    """What is cut off makes a specimen softer, not stiffer: too stiff for any it is all the same."""
    run = static(lambda t, x, f: (t, stroke * x, np.minimum(f, 480.0)))
    assert {found.kind for found in run.findings} == kinds
    assert not {row.verdict for row in run.requirements if row.id == "full-release"} & {"fail"}


@pytest.mark.parametrize(("factor", "kinds"), [(1.0 / 25.4, {"clipped", "unit"}), (1.0, {"clipped"})])
@pytest.mark.parametrize("share", [0.85, 0.7])
def test_inches_where_every_stroke_is_clipped(share: float, factor: float, kinds: set[str]) -> None:
    """Up to where it is clipped, the stroke is as stiff as a specimen is."""
    run = static(lambda t, x, f: (t, factor * np.minimum(x, share * np.max(x)), f))
    assert {found.kind for found in run.findings} == kinds


@pytest.mark.parametrize(
    ("damper_kN", "spring_kN", "found"),
    [(900.0, 0.0, True), (900.0, 600.0, True), (4.0, 0.0, False), (150.0, 900.0, False)],
)
def test_pounds_of_a_damper(damper_kN: float, spring_kN: float, found: bool) -> None:
    """At 50 mm/s; a spring that works both ways, which takes up some of its work, is none."""
    time_s = np.arange(4000) / 200.0
    record = make_record(
        time_s,
        16.0 * np.sin(np.pi * time_s),
        damper_kN * np.cos(np.pi * time_s) + spring_kN * np.sin(np.pi * time_s),
    )
    facts = RunFacts("d", "harmonic", specimen={"kind": "buffer", "max_stroke_mm": 105.0})
    run = evaluate_run(record, facts, Options(draws=0))
    assert [(one.kind, one.channel) for one in run.findings] == [("unit", "force")] * found


def test_a_force_that_relaxes_at_rest_is_no_unit() -> None:
    """The stroke hums by 10 µm, which makes cycles of it."""

    def held(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        hum = 0.01 * np.sin(2.0 * np.pi * t)
        return few(t, 1e3 * (60.0 + hum), 500.0 - 40.0 * np.log1p(t))

    run = swings(Ellipse(), held)
    assert len(run.cycles) > 4
    assert not any(result.cycle.complete for result in run.cycles)
    assert not of_kind(run, "unit")


@pytest.mark.parametrize("preload_kN", [0.0, 50.0])
@pytest.mark.parametrize(("soft", "cubic"), [(0.4, 0.0), (1.0, 1.2e-5)])
def test_any_static_spring_is_none(preload_kN: float, soft: float, cubic: float) -> None:
    """From 90 kN to 1450 kN at full stroke."""
    run = static(lambda t, x, f: (t, x, soft * f), preload_kN=preload_kN, cubic=cubic)
    assert not of_kind(run, "unit")


def test_without_facts_of_the_specimen_only_absolute_bounds_apply() -> None:
    assert not of_kind(static(scaled(10.0), cubic=1e-6, specimen={}), "unit")
    assert of_kind(static(scaled(1000.0), specimen={}), "unit")
    pads = Ellipse(mean_mm=0.4, amplitude_mm=0.2, storage=400.0, loss=50.0)
    assert not of_kind(swings(pads, specimen={}), "unit")


@pytest.mark.parametrize(("force", "stroke"), [(1000.0, 1.0), (1.0, 0.001)])
def test_units_of_a_harmonic_run(force: float, stroke: float) -> None:
    for ellipse in (Ellipse(), Ellipse(storage=0.8, loss=0.15, mean_kN=20.0, amplitude_mm=5.0)):
        assert of_kind(swings(ellipse, scaled(force, stroke)), "unit")
        assert not of_kind(swings(ellipse), "unit")


def test_the_range_of_the_stand_and_the_plan() -> None:
    assert of_kind(swings(Ellipse(), scaled(10.0), force_limit_kN=600.0), "unit")
    assert not of_kind(swings(Ellipse(), force_limit_kN=200.0), "unit")
    assert of_kind(swings(Ellipse(), scaled(1.0, 1 / 25.4), step={"amplitude_mm": 20.0}), "unit")
    assert not of_kind(swings(Ellipse(), step={"amplitude_mm": 5.0}), "unit")


@pytest.mark.parametrize(("force", "stroke", "channel"), [(-1.0, 1.0, "force"), (1.0, -1.0, "stroke")])
@pytest.mark.parametrize("begins_s", [0.0, 8.0])
def test_a_sign_that_is_turned(force: float, stroke: float, channel: str, begins_s: float) -> None:
    def change(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        late = t >= begins_s
        return t[late], stroke * x[late], force * f[late]

    run = static(change)
    (found,) = run.findings
    assert (found.kind, found.channel) == ("sign", channel)
    assert "negative" in found.text
    assert {row.verdict for row in run.requirements if row.stroke_mm is not None} <= {"inconclusive"}
    assert [f.channel for f in of_kind(swings(Ellipse(), scaled(force, stroke)), "sign")] == [channel]


def test_both_signs_turned() -> None:
    run = static(scaled(-1.0, -1.0))
    assert [found.channel for found in of_kind(run, "sign")] == ["force", "stroke"]
    pulled = {**BUFFER, "kind": "draw-gear"}
    assert not of_kind(static(scaled(-1.0, -1.0), specimen=pulled), "sign")


def test_a_damper_that_works_both_ways() -> None:
    both = Ellipse(mean_mm=0.0, mean_kN=0.0, storage=0.2, loss=2.0)
    assert not of_kind(swings(both), "sign")
    assert [found.channel for found in of_kind(swings(both, scaled(-1.0)), "sign")] == ["force"]
    friction = swings(both, lambda t, x, _: (t, x, 40.0 * np.sign(np.gradient(x, t))))
    assert not of_kind(friction, "sign")


@pytest.mark.parametrize("which", ["area", "force"])
def test_a_cycle_that_is_unlike_the_others(which: str) -> None:
    def change(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        # from lower turn to lower turn: sin(2πt + 1) = -1 at t = 3.5908
        inside = (t > 3.5908) & (t < 4.5908)
        line = 100.0 + 4.0 * (x - 50.0)
        return t, x, np.where(inside, line + 1.4 * (f - line) if which == "area" else f * 1.1 - 2.0, f)

    run = harmonic(change, cycles=8.2, noise=1e-4)
    (found,) = of_kind(run, "unlike")
    assert len(found.cycles) == 1
    assert found.cycles[0] not in run.summary.cycles_used
    assert not of_kind(harmonic(cycles=8.2), "unlike")
