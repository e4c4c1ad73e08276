"""The matrix: each record breaks one requirement or one condition, and gets that verdict and no other.

Every verdict of every row of a run is compared, for each id of docs/evaluation/requirements.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.document_types import Verdict
from bufferstand.evaluation.facts.results import RunEvaluation
from tests.evaluation.made_to_order import GOOD_CYCLE, MadeTest, bent, ids, measured, table, usual
from tests.evaluation.signals import BUFFER, later

GOOD = MadeTest()
GOOD_RUN = GOOD.evaluate()
GOOD_TABLE = table(GOOD_RUN)
REQUIREMENTS = (
    "preload", "force-at-25mm", "force-at-60mm", "force-at-100mm", "stored-energy", "absorbed-energy-ratio",
)  # fmt: skip
CONDITIONS = (
    "temperature-range", "speed-limit", "cycle-count", "pause-limit", "rest-after-assembly",
    "immediate-unloading", "full-release", "full-stroke",
)  # fmt: skip
CYCLES = (1, 2, 3)


def expected(**changes: Verdict) -> dict[tuple[str, int | None], str]:
    """Return the table of the good test with rows changed: ``id_with_underscores__cycle=verdict``."""
    result: dict[tuple[str, int | None], str] = dict(GOOD_TABLE)
    for key, verdict in changes.items():
        name, _, cycle = key.partition("__")
        result[name.replace("_", "-"), int(cycle) if cycle else None] = verdict
    return result


def with_invalid(broken: str, cycles: tuple[int | None, ...], governed: tuple[int, ...]) -> dict[Any, str]:
    """Return the table of a test whose condition is broken in some cycles and governs those of some."""
    result: dict[tuple[str, int | None], str] = dict(GOOD_TABLE)
    for cycle in cycles:
        result[broken, cycle] = "fail"
    for name in REQUIREMENTS:
        for cycle in governed:
            result[name, cycle] = "invalid"
    return result


def test_good_test_has_every_id_of_the_contract_and_passes() -> None:
    assert set(GOOD_TABLE.values()) == {"pass"}
    assert set(ids(GOOD_RUN, condition=False)) == set(REQUIREMENTS)
    assert set(ids(GOOD_RUN, condition=True)) == set(CONDITIONS)
    assert GOOD_RUN.verdict == "pass"
    for rule in ("simple", "guard-band"):
        assert set(table(GOOD.evaluate(decision_rule=rule)).values()) == {"pass"}


# ── conditions ─────────────────────────────────────────────────────────────────────────────────────────────
SPECIMEN = tuple({**BUFFER, "elastic_system": "rubber-steel"}.items())
ALL = (1, 2, 3)
BROKEN: dict[str, tuple[MadeTest, str, tuple[int | None, ...], tuple[int, ...]]] = {
    "cold at the start of the first": (
        GOOD.changed(1, temperature_C=(14.8, 20.0)), "temperature-range", (1,), (1,)),
    "warm during the second only": (
        GOOD.changed(2, temperature_C=(20.0, 25.3)), "temperature-range", (2,), (2,)),
    "cold during the third only": (
        GOOD.changed(3, temperature_C=(20.0, 14.7)), "temperature-range", (3,), (3,)),
    "loaded too fast once": (
        GOOD.changed(2, up_mm_per_s=50.6), "speed-limit", (2,), (2,)),
    "unloaded too fast once": (
        GOOD.changed(3, down_mm_per_s=50.6), "speed-limit", (3,), (3,)),
    "held at the top once": (
        GOOD.changed(1, dwell_s=1.6), "immediate-unloading", (1,), (1,)),
    "not released before the second": (
        GOOD.changed(1, residual_mm=2.3), "full-release", (2,), (2,)),
    "not released after the last": (
        GOOD.changed(3, residual_mm=2.3), "full-release", (3,), (3,)),
    "a long pause before the third": (
        GOOD.changed(2, pause_s=601.0), "pause-limit", (3,), (3,)),
    "71.9 hours, elastomer": (
        replace(GOOD, started=later(71.9)), "rest-after-assembly", (None,), ALL),
    "71.9 hours, rubber": (
        replace(GOOD, started=later(71.9), specimen=SPECIMEN), "rest-after-assembly", (None,), ALL),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_one_condition_broken(name: str) -> None:
    test, identity, where, governed = BROKEN[name]
    for rule in ("simple", "guard-band"):
        run = test.evaluate(decision_rule=rule)
        assert table(run) == with_invalid(identity, where, governed)
        assert run.verdict == "invalid"


def test_too_few_cycles() -> None:
    run = replace(GOOD, cycles=GOOD.cycles[:2]).evaluate()
    wanted = {
        key: verdict for key, verdict in with_invalid("cycle-count", (None,), (1, 2)).items() if key[1] != 3
    }
    assert table(run) == wanted
    assert run.verdict == "invalid"


def test_every_condition_is_in_the_matrix() -> None:
    broken = {identity for _, identity, _, _ in BROKEN.values()} | {"cycle-count", "full-stroke"}
    assert broken == set(CONDITIONS)


JUST_MET = {
    "25 degrees": GOOD.changed(2, temperature_C=(20.0, 25.0)),
    "15 degrees": GOOD.changed(2, temperature_C=(15.0, 20.0)),
    # A sample a millimetre would not show how the force falls behind the top: W_a would be 0.4 % too large.
    "0.05 m/s both ways": replace(GOOD.changed(1, 2, 3, up_mm_per_s=50.0, down_mm_per_s=50.0), rate_Hz=200.0),
    "a dwell below the criterion": GOOD.changed(1, dwell_s=0.7),
    "a residual stroke below the criterion": GOOD.changed(1, 3, residual_mm=1.7),
    "a pause of ten minutes less a second": GOOD.changed(1, pause_s=599.0),
    "72 hours": replace(GOOD, started=later(72.0)),
}


@pytest.mark.parametrize("name", JUST_MET)
def test_condition_just_met(name: str) -> None:
    assert table(JUST_MET[name].evaluate()) == GOOD_TABLE


def test_a_cycle_that_stops_short() -> None:
    """One cycle ends at 97 mm: its end window was not reached, its ratio is not the standard's."""
    run = GOOD.changed(2, top_mm=97.0).evaluate()
    wanted = expected(
        full_stroke__2="inconclusive", force_at_100mm__2="not-tested", absorbed_energy_ratio__2="inconclusive"
    )
    assert table(run) == wanted
    assert run.verdict == "inconclusive"


UNSHOWN: dict[str, tuple[MadeTest, str]] = {
    "assembly": (replace(GOOD, specimen=tuple({**BUFFER, "assembled": None}.items())), "rest-after-assembly"),
    "start": (replace(GOOD, started=None), "rest-after-assembly"),
}


@pytest.mark.parametrize("name", UNSHOWN)
def test_condition_that_the_record_cannot_show(name: str) -> None:
    test, identity = UNSHOWN[name]
    wanted: dict[Any, str] = dict(GOOD_TABLE) | {(identity, None): "inconclusive"}
    wanted |= {(r, c): "inconclusive" for r in REQUIREMENTS for c in CYCLES}
    assert table(test.evaluate()) == wanted


def test_several_conditions_and_a_failure_keep_to_their_cycles() -> None:
    """A failure outranks nothing here: the run is invalid, yet each row says what it is."""
    run = GOOD.changed(1, dwell_s=1.6).changed(3, branch=bent(usual, 60.0, 240.0)).evaluate()
    wanted = with_invalid("immediate-unloading", (1,), (1,)) | {("force-at-60mm", 3): "fail"}
    assert table(run) == wanted
    assert run.verdict == "invalid"


# ── requirements, near their limits, by both decision rules ────────────────────────────────────────────────
def low_energy(stroke_mm: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a branch within every window that stores hardly the 12.5 kJ."""
    return np.interp(stroke_mm, [0.0, 25.0, 60.0, 85.0, 102.0], [15.0, 45.0, 120.0, 200.0, 396.0])


def bump(at_mm: float, width_mm: float) -> Callable[[float], dict[str, Any]]:
    return lambda by: {"branch": bent(usual, at_mm, by, width_mm)}


def energy(by: float) -> dict[str, Any]:
    return {"branch": lambda x: (1.0 - by) * usual(x) + by * low_energy(x)}


def loss(by: float) -> dict[str, Any]:
    return {"loss": 0.56 + by}


# id, cycle that is changed, limit, side on which it is met, what is changed, two trials of the change
NEAR: dict[str, tuple[str, int, float, int, Callable[[float], dict[str, Any]], tuple[float, float]]] = {
    "preload, least": ("preload", 1, 10.0, +1, bump(0.0, 8.0), (0.0, -2.0)),
    "preload, most": ("preload", 3, 50.0, -1, bump(0.0, 25.0), (0.0, 10.0)),
    "25 mm, least": ("force-at-25mm", 2, 30.0, +1, bump(25.0, 10.0), (0.0, -20.0)),
    "25 mm, most": ("force-at-25mm", 1, 130.0, -1, bump(25.0, 7.0), (0.0, 30.0)),
    "60 mm, least": ("force-at-60mm", 3, 100.0, +1, bump(60.0, 10.0), (0.0, -40.0)),
    "60 mm, most": ("force-at-60mm", 2, 400.0, -1, bump(60.0, 10.0), (0.0, 80.0)),
    "100 mm, least": ("force-at-100mm", 1, 350.0, +1, bump(100.0, 12.0), (0.0, -90.0)),
    "100 mm, most": ("force-at-100mm", 2, 1000.0, -1, bump(102.0, 12.0), (0.0, 200.0)),
    "stored energy": ("stored-energy", 3, 12500.0, +1, energy, (0.9, 1.1)),
    "ratio of the first": ("absorbed-energy-ratio", 1, 0.50, +1, loss, (0.0, -0.05)),
    "ratio of the second": ("absorbed-energy-ratio", 2, 0.42, +1, loss, (0.0, -0.05)),
    "ratio of the third": ("absorbed-energy-ratio", 3, 0.42, +1, loss, (0.0, -0.05)),
}
MORE_ENERGY = 0.035
"""Of the way from the usual branch to the one of low energy: 2 U of the stored energy, 2 % of it."""
PLACES: dict[float, tuple[Verdict, Verdict]] = {
    +2.0: ("pass", "pass"),
    +0.4: ("pass", "conditional-pass"),
    -0.4: ("fail", "conditional-fail"),
    -2.0: ("fail", "fail"),
}
"""Distance from the limit in U, inwards positive: verdict by simple acceptance and by the guard band."""


def test_every_requirement_is_in_the_matrix() -> None:
    assert {case[0] for case in NEAR.values()} == set(REQUIREMENTS)
    limits = {(row.id, value) for row in GOOD_RUN.requirements if not row.condition
              for value in (row.lower_limit, row.upper_limit) if value is not None}  # fmt: skip
    assert {(case[0], case[2]) for case in NEAR.values()} == limits


def made(name: str, by: float, about: float) -> MadeTest:
    """Return the good test with a cycle changed; of the stored energy the others too, to a little more.

    No spring loses two fifths of its energy from one stroke to the next: that is an amplifier's gain.
    """
    _, cycle, _, _, change, _ = NEAR[name]
    test = GOOD.changed(cycle, **change(by))
    if change is not energy:
        return test
    return test.changed(*(other for other in CYCLES if other != cycle), **change(about - MORE_ENERGY))


def near(name: str) -> Callable[[float], tuple[MadeTest, Callable[[RunEvaluation], float]]]:
    """Return how to bring a test's figure to a place: by the line through two trials, mended once."""
    identity, cycle, limit, side, _, trials = NEAR[name]
    values = [measured(made(name, t, t).evaluate(draws=50), identity, cycle)[0] for t in trials]
    slope = (values[1] - values[0]) / (trials[1] - trials[0])
    by = trials[0] + (limit - values[0]) / slope
    at_limit, expanded = measured(made(name, by, by).evaluate(), identity, cycle)

    def distance(run: RunEvaluation) -> float:
        value, wide = measured(run, identity, cycle)
        return side * (value - limit) / wide

    def brought(place: float) -> tuple[MadeTest, Callable[[RunEvaluation], float]]:
        return made(name, by + (limit + side * place * expanded - at_limit) / slope, by), distance

    return brought


@pytest.mark.dose(5)
@pytest.mark.parametrize("name", NEAR)
def test_requirement_near_its_limit(name: str) -> None:
    brought = near(name)
    for place in PLACES:
        check(name, place, *brought(place))


def check(name: str, place: float, test: MadeTest, distance: Callable[[RunEvaluation], float]) -> None:
    """Assert what is said of a requirement whose figure lies at a place, by either rule."""
    identity, cycle = NEAR[name][:2]
    for rule, verdict in zip(("simple", "guard-band"), PLACES[place], strict=True):
        run = test.evaluate(decision_rule=rule)
        assert distance(run) == pytest.approx(place, abs=0.3)
        assert table(run) == dict(GOOD_TABLE) | {(identity, cycle): verdict}
        assert run.verdict == verdict
        row = next(r for r in run.requirements if (r.id, r.cycle) == (identity, cycle))
        assert row.conformance_probability is not None
        assert (row.conformance_probability > 0.5) == (place > 0)


def test_good_cycle_is_far_from_every_limit() -> None:
    assert GOOD_CYCLE.loss == 0.56
    for row in GOOD_RUN.requirements:
        if not row.condition:
            assert row.conformance_probability == pytest.approx(1.0, abs=1e-6)
