"""Which runs a limit set judges, by which rules, and what is said where something had to be assumed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.evaluation.facts import FirstContact, RunFacts
from bufferstand.evaluation.requirements import judgement
from bufferstand.evaluation.requirements.judgement import (
    assumptions,
    has_limits_of_its_own,
    is_judged,
    judge,
    judge_with_contact,
    why_not_judged,
)
from bufferstand.evaluation.requirements.limit_set import shipped_limit_set
from tests.evaluation.made_to_order import MadeTest


def limits(*, covers: str = "", asks: str = "", not_for: str = "") -> Any:
    """Return a limit set that covers one kind and asks of one kind."""
    return SimpleNamespace(
        id="a set",
        covers=lambda kind: kind == covers,
        asks_of=lambda kind: kind == asks,
        why_not_for=lambda specimen: not_for,  # noqa: ARG005
    )


def facts(run: str = "static", step: object = "static", **specimen: Any) -> RunFacts:
    return RunFacts("r", run, step={"kind": step}, specimen=specimen)  # type: ignore[arg-type]


def test_a_run_that_a_set_covers_or_asks_of_is_judged() -> None:
    assert why_not_judged(facts(), limits(covers="static")) == ""
    assert why_not_judged(facts(), limits(asks="static")) == ""
    assert why_not_judged(facts(), limits(covers="impact")) == "limit set a set has nothing on static runs"
    assert why_not_judged(facts(), limits(covers="static", not_for="too long")) == "too long"


def test_of_a_harmonic_run_nothing_is_missing_where_nothing_is_asked() -> None:
    assert why_not_judged(facts("harmonic", "warm-up"), limits(not_for="too long")) == ""
    assert why_not_judged(facts("harmonic"), limits(asks="harmonic", not_for="too long")) == "too long"
    assert why_not_judged(facts("harmonic"), limits(asks="harmonic")) == ""
    assert why_not_judged(facts("static"), limits()) == "limit set a set has nothing on static runs"


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("warm-up", "whose cycles only prepare the specimen"),
        ("conditioning", "whose cycles only prepare the specimen"),
        ("force-cycles", "which turns at forces and not at the strokes of a test"),
    ],
)
def test_of_a_step_that_is_no_test_nothing_is_required(kind: str, why: str) -> None:
    run, both = facts(step=kind), limits(covers="static", asks="static")
    assert why_not_judged(run, both) == f"the run is a {kind} step of its campaign, {why}"
    assert not is_judged(run, both)
    assert not has_limits_of_its_own(run, both)


def test_a_step_whose_kind_is_no_text_is_one_of_a_test() -> None:
    assert is_judged(facts(step=["warm-up"]), limits(covers="static"))


def test_each_question_is_of_kind_step_and_specimen_together() -> None:
    assert is_judged(facts(), limits(covers="static"))
    assert not is_judged(facts(), limits(asks="static"))
    assert not is_judged(facts(), limits(covers="static", not_for="too long"))
    assert has_limits_of_its_own(facts(), limits(asks="static"))
    assert not has_limits_of_its_own(facts(), limits(covers="static"))
    assert not has_limits_of_its_own(facts(), limits(asks="static", not_for="too long"))


def case(kind: str, *set_fields: str) -> Any:
    return SimpleNamespace(facts=facts(kind), limits=SimpleNamespace(model_fields_set=set(set_fields)))


@pytest.fixture(autouse=True)
def judges(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each kind of judgement only says its name."""
    for name in ("impact", "proof", "static", "maintenance"):
        monkeypatch.setattr(judgement, f"judge_{name}", lambda case, name=name: [name])  # noqa: ARG005


def test_each_kind_of_run_has_its_judges() -> None:
    assert judge(case("impact", "force")) == ["impact"]
    assert judge(case("proof", "force")) == ["proof"]
    for one in ("conditions", "force", "energy"):
        assert judge(case("static", one, "maintenance")) == ["static", "maintenance"]
    assert judge(case("static", "maintenance", "applies")) == ["maintenance"]


def contact(stroke_mm: float | None, *, beyond: bool) -> FirstContact:
    return FirstContact(stroke_mm, 0.1, 0.0, 0.0, 0.2, beyond, "jump", "")


def test_a_run_is_read_from_first_contact_too_only_where_its_zero_is_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    judged: list[Any] = []
    monkeypatch.setattr(judgement, "judge", lambda case: judged.append(case) or [len(judged)])
    monkeypatch.setattr(judgement, "beside", lambda rows, others: [*rows, "beside", *others])
    monkeypatch.setattr(judgement, "replace", lambda case, **changes: {**case, **changes})
    plain: Any = {}
    for found in (None, contact(None, beyond=True), contact(0.0, beyond=False)):
        judged.clear()
        assert judge_with_contact(plain, found) == [1]
        assert judged == [{"contact": found}]
    judged.clear()
    off = contact(0.4, beyond=True)
    assert judge_with_contact(plain, off) == [1, "beside", 2]
    assert judged == [{"contact": off}, {"contact": off, "zero_mm": 0.4}]


def applying(stroke_mm: Any, *systems: str) -> Any:
    applies = SimpleNamespace(stroke_mm=stroke_mm, specimen="buffer", elastic_systems=systems)
    return SimpleNamespace(applies=applies)


KNOWN = {"kind": "buffer", "max_stroke_mm": 105.0, "elastic_system": "ring-spring"}


def test_nothing_is_assumed_of_a_specimen_on_record() -> None:
    assert assumptions(facts(**KNOWN), applying(105.0, "ring-spring")) == []
    assert assumptions(facts(kind_of_test="x", **KNOWN), applying("fill-in")) == []


def test_what_is_assumed_of_a_specimen_is_said() -> None:
    without = {key: value for key, value in KNOWN.items() if key != "max_stroke_mm"}
    assert assumptions(facts(**without), applying(105.0)) == [
        "the specimen's max_stroke_mm is not on record: judged as a buffer of 105 mm"
    ]
    assert assumptions(facts(**without), applying("fill-in")) == []
    assert assumptions(facts(), applying(105.0)) == [
        "the specimen's kind and max_stroke_mm is not on record: judged as a buffer of 105 mm"
    ]
    assert assumptions(facts(), applying("fill-in", "ring-spring", "rubber")) == [
        "the specimen's kind is not on record: judged as a buffer",
        "the specimen's elastic_system is not on record: judged as ring-spring, rubber",
    ]


def test_the_shipped_set_judges_a_static_test_of_its_buffer() -> None:
    run = RunFacts("r", "static", specimen=dict(MadeTest().specimen))
    assert is_judged(run, shipped_limit_set())
    assert why_not_judged(run, shipped_limit_set()) == ""
