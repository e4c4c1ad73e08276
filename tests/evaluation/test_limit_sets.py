"""Limit sets: identity, open limits that are never passed, and every reading of an unclear source."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.requirements.decision import decide
from bufferstand.evaluation.requirements.limit_set import (
    FOLDER,
    LimitSet,
    find_limit_set,
    load_limit_set,
    shipped_limit_set,
    shipped_names,
)
from bufferstand.evaluation.requirements.readings import LimitSetReadings
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.errors import BadInput
from tests.evaluation.made_to_order import GOOD_CYCLE, MadeTest, bent, ids, table, usual
from tests.evaluation.signals import BUFFER, Floats, StaticTest, later
from tests.evaluation.test_impact import impact

SHIPPED = shipped_limit_set()
GOOD = MadeTest()


def read_as(**readings: Any) -> LimitSet:
    """Return the shipped set with other readings."""
    return SHIPPED.model_copy(update={"readings": LimitSetReadings(**readings)})


def values(run: RunEvaluation, identity: str) -> list[float | None]:
    return [row.measured for row in run.requirements if row.id == identity]


# ── identity ───────────────────────────────────────────────────────────────────────────────────────────────
@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_set_states_what_it_is(name: str) -> None:
    limits = find_limit_set(name)
    assert limits.id == name
    identity = limits.identity()
    for key in ("id", "standard", "source", "date"):
        assert identity[key]
    assert identity["clause"] is None, "no text of a standard was at hand"
    assert len(identity["sha256"]) == 64


def test_three_sets_are_shipped_with_hashes_of_their_own() -> None:
    assert shipped_names() == ["en15551-105mm", "en15566-draw-gear", "ring-spring-maintenance"]
    assert len({find_limit_set(name).sha256 for name in shipped_names()}) == 3


def test_hash_is_of_the_content_not_of_the_layout(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    text = (FOLDER / "en15551-105mm.toml").read_text(encoding="utf-8")
    own.write_text(text + "\n# a remark\n", encoding="utf-8")
    assert load_limit_set(own).sha256 == SHIPPED.sha256
    own.write_text(text.replace('force_cycles = "all"', 'force_cycles = "first"'), encoding="utf-8")
    assert load_limit_set(own).sha256 != SHIPPED.sha256


def test_a_set_without_readings_reads_as_the_shipped_one(tmp_path: Path) -> None:
    text = (FOLDER / "en15551-105mm.toml").read_text(encoding="utf-8")
    start, end = text.index("[readings]"), text.index("[conditions]")
    (tmp_path / "own.toml").write_text(text[:start] + text[end:], encoding="utf-8")
    assert load_limit_set(tmp_path / "own.toml").sha256 == SHIPPED.sha256


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"no such limit set.*en15551-105mm, en15566-draw-gear"):
        find_limit_set("en15551-110mm")
    own = tmp_path / "own.toml"
    text = (FOLDER / "en15551-105mm.toml").read_text(encoding="utf-8")
    for old, new, message in (
        ("ratio_later_min = 0.42\n", "", "line .*energy.ratio_later_min: this key is missing"),
        ('preload = "extrapolated"', 'preload = "guessed"', "readings.preload"),
        ('id = "force-at-25mm"', 'id = "preload"', "given twice"),
        (
            "pause_max_s = 600.0",
            'pause_max_s = "about ten minutes"',
            r"line \d+: conditions.pause_max_s: “about .*; write a number .*, “fill-in” or “none”",
        ),
        (
            "temperature_min_C = 15.0",
            "temperature_min_C = 35.0",
            "the lower limit 35 is above the upper one 25",
        ),
        (
            "lower_kN = 30.0",
            "lower_kN = 300.0",
            "force-at-25mm: the lower limit 300 is above the upper one 130",
        ),
        (
            "date = 2026-01-15",
            'date = "last year"',
            r"line \d+: date: not a date \(got “last year”\); write it as 2026-03-05",
        ),
    ):
        assert old in text
        own.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(BadInput, match=message):
            load_limit_set(own)


def test_clause_is_the_section_s_else_the_set_s_and_the_source_too() -> None:
    own = SHIPPED.model_copy(
        update={"clause": "6", "energy": SHIPPED.energy.model_copy(update={"clause": "6.3"})}
    )
    assert own.reference(own.energy) == ("6.3", SHIPPED.energy.source)
    assert own.reference(own.force[0])[0] == "6"
    assert SHIPPED.reference(SHIPPED.force[0])[0] is None
    assert SHIPPED.reference() == (None, SHIPPED.source)
    assert "the number is this set's own" in SHIPPED.reference(SHIPPED.conditions, "full-release")[1]
    assert SHIPPED.reference(SHIPPED.conditions, "speed-limit")[1] == SHIPPED.conditions.source


def test_a_source_of_no_condition_is_refused(tmp_path: Path) -> None:
    text = (FOLDER / "en15551-105mm.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.replace("full-release =", "full-relief ="), encoding="utf-8")
    with pytest.raises(BadInput, match=r"conditions\.sources: no condition “full-relief”; one of"):
        load_limit_set(tmp_path / "own.toml")


# ── limits that are not filled in ──────────────────────────────────────────────────────────────────────────
HOOK = tuple(({**BUFFER, "kind": "draw-gear", "max_stroke_mm": None, "category": None}).items())
DRAW_GEAR = find_limit_set("en15566-draw-gear")


def test_draw_gear_with_open_limits_passes_nothing() -> None:
    run = replace(GOOD, specimen=HOOK).evaluate(DRAW_GEAR)
    assert set(ids(run, condition=False)) == {
        "preload",
        "end-force",
        "stored-energy",
        "absorbed-energy-ratio",
    }
    assert {row.verdict for row in run.requirements} == {"inconclusive", "not-tested"}
    assert run.verdict == "inconclusive"
    for row in run.requirements:
        assert (row.lower_limit, row.upper_limit, row.conformance_probability) == (None, None, None)
        assert "EN 15566" in row.why
        assert row.standard == "EN 15566"
    assert all(value is not None for value in values(run, "absorbed-energy-ratio"))
    assert run.limit_set is not None
    assert "energy.ratio_first_min" in run.limit_set["unfilled"]


def test_no_number_of_the_draw_gear_set_is_ours() -> None:
    """Every limit is open, but that the preload is read at stroke 0."""
    content = DRAW_GEAR.model_dump(mode="json")
    ours = ("block_slope_ratio", "reading_interval_max_s")
    conditions = {key: value for key, value in content["conditions"].items() if key not in ours}
    numbers = [
        value
        for part in (content["applies"], conditions, content["energy"], *content["force"])
        for value in part.values() if isinstance(value, int | float)
    ]  # fmt: skip
    assert numbers == [0.0]


def test_draw_gear_filled_in_by_the_laboratory(tmp_path: Path) -> None:
    text = (FOLDER / "en15566-draw-gear.toml").read_text(encoding="utf-8")
    for key, value in {
        "stroke_mm": "100.0", "stroke_tolerance_mm": "0.0",
        "temperature_min_C": "15.0", "temperature_max_C": "25.0",
        "speed_max_mm_per_s": "50.0", "cycles": "3", "pause_max_s": '"none"', "rest_min_h": '"none"',
        "dwell_max_s": "1.0", "residual_stroke_max_mm": "2.0", "lower_kN": "10.0", "upper_kN": "900.0",
        "stored_min_J": "10000.0", "force_cap_kN": '"none"',
        "ratio_first_min": "0.4", "ratio_later_min": "0.4",
    }.items():  # fmt: skip
        text = text.replace(f'{key} = "fill-in"', f"{key} = {value}")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    own = load_limit_set(tmp_path / "own.toml")
    assert own.unfilled == ()
    run = replace(GOOD, specimen=HOOK).evaluate(own)
    assert {row.verdict for row in run.requirements} == {"pass"}
    assert {"pause-limit", "rest-after-assembly"}.isdisjoint(ids(run, condition=True))
    weak = replace(GOOD, specimen=HOOK).changed(1, 2, 3, loss=0.35).evaluate(own)
    assert {key for key, verdict in table(weak).items() if verdict != "pass"} == {
        ("absorbed-energy-ratio", cycle) for cycle in (1, 2, 3)
    }


CONDITION_KEYS = {
    "temperature_max_C": "temperature-range", "speed_max_mm_per_s": "speed-limit", "cycles": "cycle-count",
    "pause_max_s": "pause-limit", "rest_min_h": "rest-after-assembly", "dwell_max_s": "immediate-unloading",
    "residual_stroke_max_mm": "full-release",
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("key", CONDITION_KEYS)
def test_one_open_condition(key: str) -> None:
    """An open limit makes its condition inconclusive, and what it governs; ``none`` takes it out."""

    def changed(value: str) -> RunEvaluation:
        conditions = SHIPPED.conditions.model_copy(update={key: value})
        return GOOD.evaluate(SHIPPED.model_copy(update={"conditions": conditions}))

    run, identity = changed("fill-in"), CONDITION_KEYS[key]
    assert {row.id for row in run.requirements if row.condition and row.verdict != "pass"} == {identity}
    assert {row.verdict for row in run.requirements if row.id == identity} == {"inconclusive"}
    assert run.verdict == "inconclusive"
    without = changed("none")
    gone = set(ids(GOOD.evaluate(), condition=True)) - set(ids(without, condition=True))
    assert gone == ({identity} if key != "temperature_max_C" else set())
    assert without.verdict == "pass"


def test_open_side_of_a_window() -> None:
    """What breaks the known side fails all the same; what keeps it is inconclusive."""
    window = SHIPPED.force[2].model_copy(update={"upper_kN": "fill-in"})
    limits = SHIPPED.model_copy(update={"force": (window,)})
    assert set(table(GOOD.evaluate(limits)).items()) >= {(("force-at-60mm", 2), "inconclusive")}
    soft = GOOD.changed(2, branch=bent(usual, 60.0, -110.0)).evaluate(limits)
    assert table(soft)["force-at-60mm", 2] == "fail"
    assert table(soft)["force-at-60mm", 1] == "inconclusive"


@pytest.mark.slow
def test_kinds_that_a_set_has_nothing_on() -> None:
    run = impact(category="A", limits=DRAW_GEAR)
    assert run.requirements == ()
    assert run.verdict is None
    assert any("has nothing on impact runs" in text for text in run.warnings)


# ── readings ───────────────────────────────────────────────────────────────────────────────────────────────
@pytest.mark.slow
def test_defaults_are_those_of_the_shipped_file() -> None:
    assert SHIPPED.readings == LimitSetReadings()
    assert SHIPPED.identity()["readings"]["comparator"] == "at-least"


@pytest.mark.slow
@pytest.mark.parametrize(("reading", "cycles"), [("all", [1, 2, 3]), ("first", [1]), ("last", [3])])
def test_which_cycles_the_windows_bind(reading: str, cycles: list[int]) -> None:
    run = GOOD.evaluate(read_as(force_cycles=reading))
    for identity in ("preload", "force-at-25mm", "force-at-60mm", "force-at-100mm"):
        assert [row.cycle for row in run.requirements if row.id == identity] == cycles
    assert [row.cycle for row in run.requirements if row.id == "stored-energy"] == [1, 2, 3]


@pytest.mark.slow
def test_preload_reading() -> None:
    test = replace(GOOD, rate_Hz=250.0)
    line, near = test.evaluate(), test.evaluate(read_as(preload="at-0.5mm"))
    assert values(line, "preload")[0] == pytest.approx(20.0, abs=0.1)
    assert values(near, "preload")[0] == pytest.approx(21.0, abs=0.1)
    given = test.evaluate(read_as(preload="at-0.5mm"), preload_reading="extrapolated")
    assert given.requirements == line.requirements


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hours", "verdict"), [(71.5, "pass"), (72.5, "pass"), (74.5, "fail"), (69.5, "fail")]
)
def test_rest_of_exactly_so_long(hours: float, verdict: str) -> None:
    limits = read_as(rest="exactly")
    test = replace(GOOD, started=later(hours))
    assert table(test.evaluate(limits))["rest-after-assembly", None] == "inconclusive"
    conditions = SHIPPED.conditions.model_copy(update={"rest_tolerance_h": 2.0})
    assert (
        table(test.evaluate(limits.model_copy(update={"conditions": conditions})))[
            "rest-after-assembly", None
        ]
        == verdict
    )


@pytest.mark.slow
def test_comparator() -> None:
    assert decide(0.42, 0.01, 0.42, None, "simple")[0] == "pass"
    assert decide(0.42, 0.01, 0.42, None, "simple", beyond=True)[0] == "fail"
    assert decide(0.42, 0.01, 0.42, None, "guard-band", beyond=True)[0] == "conditional-fail"
    printed = GOOD.evaluate(read_as(comparator="as-printed"))
    ratios = [row.requirement for row in printed.requirements if row.id == "absorbed-energy-ratio"]
    assert ["at least 0.5" in ratios[0], "more than 0.42" in ratios[1], "more than 0.42" in ratios[2]] == [
        True
    ] * 3
    assert SHIPPED.impact.printed_greater == ("C",)
    for category, verdict in (("A", "pass"), ("C", "fail")):
        stored = impact(category=category).requirements[0].measured
        update = {"stored_min_J": {category: stored}}
        exact = SHIPPED.model_copy(update={"impact": SHIPPED.impact.model_copy(update=update)})
        assert impact(category=category, limits=exact).requirements[0].verdict == "pass"
        as_printed = exact.model_copy(update={"readings": LimitSetReadings(comparator="as-printed")})
        assert impact(category=category, limits=as_printed).requirements[0].verdict == verdict


def stiff(stroke: Floats) -> Floats:
    return np.asarray(usual(stroke) * 1.9)


@pytest.mark.slow
def test_absorbed_energy_of_the_whole_cycle() -> None:
    """The force reaches 1000 kN before the end: the loop beyond the cut counts, or not."""
    test = GOOD.changed(1, 2, 3, branch=stiff)
    same, whole = test.evaluate(), test.evaluate(read_as(absorbed_energy="whole-cycle"))
    stored = values(same, "stored-energy")[0]
    area = same.cycles[0].quantities.absorbed_energy_J
    assert stored is not None
    assert area is not None
    assert values(whole, "stored-energy")[0] == stored
    assert values(whole, "absorbed-energy-ratio")[0] == pytest.approx(area / stored, rel=1e-9)
    assert (values(same, "absorbed-energy-ratio")[0] or 1.0) < area / stored


@pytest.mark.slow
def test_first_or_last_crossing_of_the_cap() -> None:
    """A branch that dips under the cap again is cut at 83 mm or at 98 mm."""
    dip = bent(bent(usual, 84.0, 700.0, 5.0), 102.0, 600.0, 5.0)
    test = GOOD.changed(1, 2, 3, branch=dip)
    first, last = (
        next(
            r
            for r in test.evaluate(read_as(force_cap_crossing=which)).requirements
            if r.id == "stored-energy"
        )
        for which in ("first", "last")
    )
    assert "counted to 8" in first.why
    assert "counted to 9" in last.why or "counted to 10" in last.why
    assert first.measured is not None
    assert last.measured is not None
    assert last.measured > first.measured + 5000.0


@pytest.mark.slow
def test_static_cycle_to_the_proof_load() -> None:
    run = GOOD.evaluate(read_as(static_extent="proof-load"))
    row = next(r for r in run.requirements if r.id == "full-stroke")
    assert (row.verdict, row.lower_limit, row.unit) == ("inconclusive", 2500.0, "kN")
    assert run.verdict == "inconclusive"
    hard = GOOD.changed(1, 2, 3, branch=lambda x: usual(x) + 2000.0 * (x / 102.0) ** 20).evaluate(
        read_as(static_extent="proof-load")
    )
    assert not hard.findings
    assert {r.verdict for r in hard.requirements if r.id == "full-stroke"} == {"pass"}


def blocked(stroke: Floats) -> Floats:
    """Return a branch that meets a stop at 99 mm, of 60 kN/mm."""
    return np.asarray(usual(stroke) + 60.0 * np.maximum(stroke - 99.0, 0.0))


@pytest.mark.slow
def test_block_contact_is_flagged_or_leaves_the_window_open() -> None:
    test = GOOD.changed(2, branch=blocked)
    flagged = test.evaluate()
    rows = {(r.id, r.cycle): r for r in flagged.requirements}
    assert "block contact" in rows["force-at-100mm", 2].why
    assert "block contact from 9" in rows["full-stroke", 2].why
    assert rows["force-at-100mm", 2].verdict == "pass"
    assert all("block contact" not in r.why for r in flagged.requirements if r.cycle != 2)
    wanted = dict(table(GOOD.evaluate())) | {("force-at-100mm", 2): "inconclusive"}
    assert table(test.evaluate(read_as(block_contact="inconclusive"))) == wanted
    blunt = SHIPPED.conditions.model_copy(update={"block_slope_ratio": 20.0})
    assert all(
        "block contact" not in r.why
        for r in test.evaluate(SHIPPED.model_copy(update={"conditions": blunt})).requirements
    )


@pytest.mark.slow
def test_a_copy_of_a_shipped_file_is_a_set_of_its_own(tmp_path: Path) -> None:
    shutil.copy(FOLDER / "en15551-105mm.toml", tmp_path / "own.toml")
    assert find_limit_set(str(tmp_path / "own.toml")).id == "en15551-105mm"
    assert GOOD_CYCLE.top_mm == 102.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["conditioning", "warm-up", "force-cycles"])
def test_steps_that_are_no_test_are_not_judged(kind: str) -> None:
    """The very strokes of a static test: what the step is for decides, whatever its cycles would show."""
    test = StaticTest()
    judged = evaluate_run(test.record(), test.facts(), Options(draws=20))
    assert judged.requirements
    step = {"name": f"{kind}: static, 3 × at 5 mm/s", "kind": kind}
    run = evaluate_run(test.record(), replace(test.facts(), step=step), Options(draws=20))
    assert (run.requirements, run.verdict, run.limit_set) == ((), None, None)
    (why,) = [text for text in run.warnings if "judged" in text]
    assert why.startswith(f"nothing is judged: the run is a {kind} step of its campaign, wh")
    assert run.summary.values == judged.summary.values
    static = replace(test.facts(), step={"name": "static", "kind": "static"})
    assert evaluate_run(test.record(), static, Options(draws=20)).requirements == judged.requirements
