"""An independent program finds what is agreed: the values do not lean on our own evaluation."""

from __future__ import annotations

import re
from pathlib import Path

from bufferstand.evaluation.validation.evaluate_sets import judge_results
from bufferstand.evaluation.validation.standard_sets import shipped_sets
from examples.validation.plain_scipy import results

PAGE = Path(__file__).parents[2] / "docs" / "validation.md"


def test_a_plain_script_finds_what_the_page_says() -> None:
    sets = shipped_sets()
    found = results(sets[0].folder.parents[1])
    judged = [result for one in sets if (result := judge_results(one, found)) is not None]
    compared = sum(len(result.checks) for result in judged)
    good = compared - sum(len(result.missed) for result in judged)
    stated = re.search(r"plain script.*\| (\d+) of (\d+) \|", PAGE.read_text(encoding="utf-8"))
    assert stated is not None
    assert (good, compared) == (int(stated[1]), int(stated[2]))
    assert len(judged) == 36
    # What it misses is coarse sampling and the force at sharp turns, and nothing else.
    assert {result.standard.id.partition("/")[0] for result in judged if result.missed} == {
        "closed-form",
        "noisy",
    }


def test_the_page_states_how_much_is_agreed() -> None:
    sets = shipped_sets()
    text = PAGE.read_text(encoding="utf-8")
    assert (
        f"{len(sets)} standard data sets with {sum(len(one.truth.agreed) for one in sets)} agreed values"
        in text
    )
