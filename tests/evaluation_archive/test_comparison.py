"""Two evaluations compared: which run is which, and nothing that moved is passed over."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.archive.comparison import (
    EvaluationComparison,
    compare_evaluations,
    load_evaluation,
)
from bufferstand.evaluation.document.build import SCHEMA
from bufferstand.foundation.errors import BadInput


def entry(
    name: str, content: str | None = None, path: str = "", damping: float = 0.25, cycles: int = 3
) -> dict[str, Any]:
    return {
        "run": {"id": name, "sha256": content, "path": path or f"{name}.h5"},
        "summary": {
            "cycles_used": list(range(1, cycles + 1)),
            "damping": {"value": damping, "expanded_uncertainty": 0.01},
        },
        "cycles": [
            {
                "index": index,
                "complete": True,
                "steady": True,
                "damping": damping,
                "temperature_C": {"start": 20.0, "max": 21.0},
                "expanded_uncertainty": {"damping": 0.01},
            }
            for index in range(1, cycles + 1)
        ],
        "requirements": [],
        "verdict": None,
    }


def compared(old: list[dict[str, Any]], new: list[dict[str, Any]], **options: bool) -> EvaluationComparison:
    return compare_evaluations({"runs": old}, {"runs": new}, **options)


def test_copies_are_compared_with_themselves() -> None:
    copies = [entry("X", "c", "a/x.h5", 0.2), entry("X", "c", "b/x.h5", 0.3)]
    found = compared(copies, copies[::-1])
    assert (found.compared, found.only_old, found.only_new, found.moves) == (2, (), (), ())
    moved = [entry("X", "c", "elsewhere/x.h5", 0.2), entry("X", "c", "b/x.h5", 0.3)]
    assert compared(copies, moved).moves == ()
    fewer = compared(copies, copies[:1])
    assert (fewer.compared, fewer.only_old) == (1, ("X",))


@pytest.mark.parametrize("one_first", [True, False])
def test_an_id_that_is_not_theirs_alone_pairs_nobody(one_first: bool) -> None:
    one, two = [entry("same", "1")], [entry("same", "2"), entry("same", "3")]
    found = compared(one, two) if one_first else compared(two, one)
    assert found.compared == 0
    assert len(found.only_old) + len(found.only_new) == 3


def test_an_id_that_is_left_alone_pairs() -> None:
    """Of two recordings of a name one is unchanged: the others are the same step, recorded again."""
    found = compared([entry("same", "1"), entry("same", "2")], [entry("same", "1"), entry("same", "3")])
    assert (found.compared, found.other_recordings) == (2, ("same",))


def test_cycles_that_only_one_has_are_named() -> None:
    for old, new in ((3, 2), (2, 3)):
        found = compared([entry("X", "c", cycles=old)], [entry("X", "c", cycles=new)], cycles=True)
        moves = {(move.quantity, move.cycle): (move.old, move.new) for move in found.moves}
        there = (1.0, None) if old > new else (None, 1.0)
        assert moves["complete", 3] == there
        assert moves["used", 3] == ((1.0, 0.0) if old > new else (0.0, 1.0))
        assert ("temperature_max_C", 3) in moves
        assert all(cycle == 3 for _, cycle in moves)


def test_a_change_of_the_cycles_used_is_named_without_being_asked() -> None:
    old, new = entry("X", "c"), entry("X", "c")
    new["summary"]["cycles_used"] = [1, 2]
    (move,) = compared([old], [new]).moves
    assert (move.quantity, move.cycle, move.old, move.new, move.beyond) == ("used", 3, 1.0, 0.0, None)


def test_flags_and_temperatures_of_cycles_are_compared() -> None:
    old, new = entry("X", "c"), entry("X", "c")
    new["cycles"][1]["steady"] = False
    new["cycles"][2]["temperature_C"]["max"] = 25.0
    new["cycles"][0]["expanded_uncertainty"] = None
    found = compared([old], [new], cycles=True)
    assert [(move.quantity, move.cycle, move.new) for move in found.moves] == [
        ("steady", 2, 0.0),
        ("temperature_max_C", 3, 25.0),
    ]


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"runs": 1}, "runs"),
        ({"runs": [1]}, "runs.0"),
        ({"runs": [{}]}, "runs.0.run"),
        ({"software": None}, "software"),
        ({"runs": [entry("X") | {"summary": None}]}, "runs.0.summary"),
        ({"runs": [entry("X") | {"summary": {"damping": {"value": "x"}}}]}, "runs.0.summary.damping"),
        ({"runs": [{k: v for k, v in entry("X").items() if k != "verdict"}]}, "runs.0.verdict"),
    ],
)
def test_what_is_no_evaluation_is_refused_with_its_place(
    tmp_path: Path, change: dict[str, Any], place: str
) -> None:
    path = tmp_path / "e.json"
    path.write_text(json.dumps({"schema": SCHEMA, "runs": [], **change}))
    with pytest.raises(BadInput) as caught:
        load_evaluation(path)
    assert f"{path}: {place}" in caught.value.message()
    assert "bufferstand evaluate --json FILE" in caught.value.message()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('{"schema": NaN}', "NaN is no number of JSON"),
        ("[" * 100_000, "more than 32 tables and lists within one another"),
        ("[]", "a JSON object is expected here"),
        ("{", "not valid JSON"),
    ],
)
def test_what_is_no_json_is_refused(tmp_path: Path, text: str, why: str) -> None:
    (tmp_path / "e.json").write_text(text)
    with pytest.raises(BadInput, match=why):
        load_evaluation(tmp_path / "e.json")


SHARED = {
    "basis": "certificate",
    "errors": ["force scale"],
    "sources": [
        {"error": "force scale", "instrument": "cell 7", "distribution": "rectangular", "share": 1.0}
    ],
    "contributions": {"damping": [0.004]},
    "explained": {"damping": 0.004},
}


def test_errors_that_two_recordings_share_cancel_in_their_difference() -> None:
    one, two = entry("X", "1", damping=0.25), entry("X", "2", damping=0.26)
    (apart,) = compared([one], [two]).moves
    assert apart.expanded_uncertainty == pytest.approx(0.01 * 2.0**0.5)
    (shared,) = compared([one | {"shared_errors": SHARED}], [two | {"shared_errors": SHARED}]).moves
    assert shared.expanded_uncertainty == pytest.approx(2.0 * (2.0 * (0.005**2 - 0.004**2)) ** 0.5)
    assert (apart.beyond, shared.beyond) == (False, True)
    (again,) = compared([one], [entry("X", "1", damping=0.26)]).moves
    assert again.expanded_uncertainty == 0.01


def test_shared_errors_that_are_none_are_refused_with_their_place(tmp_path: Path) -> None:
    path = tmp_path / "e.json"
    spoiled = entry("X") | {"shared_errors": SHARED | {"errors": []}}
    path.write_text(json.dumps({"schema": SCHEMA, "runs": [spoiled]}))
    with pytest.raises(BadInput) as caught:
        load_evaluation(path)
    assert "runs.0.shared_errors" in caught.value.message()
