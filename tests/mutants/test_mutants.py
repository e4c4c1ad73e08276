"""The tool itself: which mutants it makes, and that a good test kills them and a weak one does not."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from tests.fresh_process import in_fresh_process
from tests.mutants import accepted, running, scores
from tests.mutants.accepted import Survivor, out_of_date, unexplained
from tests.mutants.generating import ROOT, Mutant, is_set_up, mutants_of, placed
from tests.mutants.in_place import InPlace
from tests.mutants.processes import Work, in_processes
from tests.mutants.running import CannotTry, Outcome, try_all
from tests.mutants.targets import MODULES, PARTS, Part

PLANTED = "tests/mutants/planted.py"
GOOD, WEAK = "tests/mutants/planted_tests/good.py", "tests/mutants/planted_tests/weak.py"
FAILING = "tests/mutants/planted_tests/failing.py"
SOURCE = (ROOT / PLANTED).read_text(encoding="utf-8")


def changed(*pairs: tuple[str, str]) -> list[Mutant]:
    """Return the planted module with each text replaced by another."""
    found = []
    for old, new in pairs:
        assert SOURCE.count(old) == 1
        line = SOURCE[: SOURCE.index(old)].count("\n") + 1
        found.append(("by hand", line, 4, SOURCE.replace(old, new)))
    return placed(PLANTED, SOURCE, found)


HAND = (
    ("number > MOST", "number >= MOST"),  # the same result
    ("number > MOST", "number < MOST"),
    ("return number + 1", "return number + 2"),
    ("notes.append(number)", "pass"),
    ("MOST = 3", "MOST = 4"),
    ("return number + 1", "while True: pass"),
)


def tried(room: Path, mutants: list[Mutant], test: str) -> list[Outcome]:
    """Return what becomes of mutants of the planted module, in a process that has run no other tests."""
    del room
    running.AND_S = 3.0
    return list(try_all(PLANTED, mutants, [test], 1))


def refusal(room: Path, tests: str) -> str:
    """Return why nothing was tried, in a process that has run no other tests."""
    del room
    try:
        list(try_all(PLANTED, changed(HAND[1]), [tests], 1))
    except CannotTry as why:
        return str(why)
    return ""


def spin() -> bytes:
    while True:
        pass


def fail() -> bytes:
    raise ValueError


def at_their_limits(room: Path) -> dict[object, tuple[bytes | None, bool]]:
    """Return what processes say that end well, fail and never end, and whether their time was over."""
    del room
    works = [Work("said", lambda: b"this", 5, 60), Work("failed", fail, 5, 60), Work("spun", spin, 0, 60)]
    return {done.tag: (done.said, done.timed_out) for done in in_processes(works, 2)}


def ends(outcomes: list[Outcome]) -> dict[str, str]:
    return {one.mutant.mutant: one.ended for one in outcomes}


@pytest.mark.slow
def test_a_good_test_kills_and_a_weak_one_lets_survive() -> None:
    """Inside functions, at import, for ever: each mutant ends as it must, under either test."""
    good = ends(in_fresh_process(tried, changed(*HAND), GOOD))
    assert good == {
        "if number >= MOST:": "survived",
        "if number < MOST:": "killed",
        "return number + 2": "killed",
        "pass": "killed",
        "MOST = 4": "killed",
        "while True: pass": "timed out",
    }
    weak = ends(in_fresh_process(tried, changed(*HAND[1:5]), WEAK))
    assert weak == {
        "if number < MOST:": "killed",
        "return number + 2": "survived",
        "pass": "survived",
        "MOST = 4": "survived",
    }


@pytest.mark.slow
def test_tests_that_fail_by_themselves_or_are_none_try_nothing(tmp_path: Path) -> None:
    for tests, why in (
        (FAILING, "without any mutant these fail"),
        (str(tmp_path / "none"), "cannot be|nothing was"),
    ):
        assert re.search(why, in_fresh_process(refusal, tests))


@pytest.mark.slow
@pytest.mark.skipif(not is_set_up(), reason="needs cosmic-ray: python -m tests.mutants --setup")
def test_the_mutants_of_a_module_are_those_of_its_lines() -> None:
    found = mutants_of(PLANTED, SOURCE)
    assert Counter(one.where for one in found) == {"": 2, "clipped": 3, "noted": 4}
    assert {one.mutant for one in found if one.where == "noted"} == {
        "pass",
        "return number - 1",
        "return number + 2",
        "return number + 0",
    }
    assert {one.operator for one in found if one.where == ""} == {"NumberReplacer"}
    assert all(one.line in SOURCE and one.first <= one.last for one in found)


@pytest.mark.long
@pytest.mark.skipif(not is_set_up(), reason="needs cosmic-ray: python -m tests.mutants --setup")
@pytest.mark.parametrize("module", scores.scores())
def test_every_mutant_is_noticed_or_explained(module: str) -> None:
    mutants = mutants_of(module, (ROOT / module).read_text(encoding="utf-8"))
    survived = [one.mutant for one in try_all(module, mutants, MODULES[module], 2) if one.ended == "survived"]
    assert unexplained(survived, accepted.accepted()) == []
    assert out_of_date([module], survived, accepted.accepted()) == []
    assert len(survived) <= max(2, 0.05 * len(mutants))


def test_what_is_never_run_is_no_mutant() -> None:
    source = (
        "class A(Protocol):\n    def b(self) -> int | None: ...\n\ndef c(a: int | str) -> None:\n    d = 1\n"
    )
    texts = [source.replace("int | None", "int & None"), source.replace("int | str", "int & str")]
    places = [
        ("X_BitOr", 2, 19, texts[0]),
        ("X_BitOr", 4, 12, texts[1]),
        ("Y", 5, 8, source.replace("= 1", "= 2")),
    ]
    broken = [("Z", 5, 8, source.replace("= 1", "= ")), ("Same", 5, 8, source.replace("d = 1", "d  = 1"))]
    (one,) = placed("m.py", source, [*places, *broken])
    assert (one.where, one.first, one.last, one.line, one.mutant) == ("c", 5, 5, "d = 1", "d = 2")


def test_a_statement_is_its_head_and_a_decorator_belongs_to_what_it_decorates() -> None:
    source = "class A:\n    @property\n    def b(self):\n        if (\n            1 < 2\n        ):\n"
    source += "            return 1\n"
    made = [
        ("L", 5, 14, source.replace("1 < 2", "1 <= 2")),
        ("D", 2, 4, source.replace("    @property\n", "")),
    ]
    decorator, comparison = placed("m.py", source, made)
    assert (comparison.where, comparison.first, comparison.last) == ("A.b", 4, 6)
    assert (decorator.where, decorator.line, decorator.mutant) == ("A.b", "@property", "")


def test_only_what_lies_within_functions_is_put_in_place() -> None:
    place = InPlace(PLANTED, SOURCE)
    inside = {mutant.mutant: place.put(mutant.source, try_only=True) for mutant in changed(*HAND)}
    assert [text for text, can in inside.items() if not can] == ["MOST = 4"]


@pytest.mark.slow
def test_processes_are_ended_at_their_limits_and_say_what_they_found() -> None:
    found = in_fresh_process(at_their_limits)
    assert found == {"said": (b"this", False), "failed": (None, False), "spun": (None, True)}


def survivor(mutant: Mutant) -> Survivor:
    return Survivor(*mutant.identity, why="because")


def test_survivors_and_explanations_must_match() -> None:
    first, second = changed(*HAND[1:3])
    assert unexplained([first, second], [survivor(first)]) == [second]
    assert out_of_date([PLANTED], [first], [survivor(first), survivor(second)]) == [survivor(second)]
    assert out_of_date(["other.py"], [], [survivor(first)]) == []


def test_every_explanation_is_of_a_target_and_says_something() -> None:
    entries = accepted.accepted()
    assert {one.module for one in entries} <= MODULES.keys()
    assert [one for one in entries if not one.why.endswith(".")] == []
    assert len({one.identity for one in entries}) == len(entries)
    gone = [one for one in entries if one.line not in (ROOT / one.module).read_text(encoding="utf-8")]
    assert gone == []


def test_every_target_and_its_tests_are_there() -> None:
    assert [
        place
        for module, tests in MODULES.items()
        for place in (module, *tests)
        if not (ROOT / place).exists()
    ] == []


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.title)
def test_of_each_part_95_percent_are_noticed_by_the_scores_that_are_kept(part: Part) -> None:
    """Of a module with few mutants two may survive; every survivor has its explanation."""
    kept = {module: scores.scores()[module] for module in part.modules if module in scores.scores()}
    numbers = {module: one["killed"] + one["timed out"] + one["survived"] for module, one in kept.items()}
    survived = {module: one["survived"] for module, one in kept.items()}
    assert sum(survived.values()) <= 0.05 * sum(numbers.values())
    assert [module for module in kept if survived[module] > max(2, 0.05 * numbers[module])] == []
    explained = Counter(one.module for one in accepted.accepted())
    assert {module: explained[module] for module in kept} == survived


def test_every_score_is_of_a_target() -> None:
    assert scores.scores().keys() <= MODULES.keys()
