"""The shipped sets: what their maker writes, readable, and refused with place and reason where damaged."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.validation.standard_sets import RECORD, TRUTH, load_sets, shipped_sets
from bufferstand.foundation.errors import BadInput
from tests.validation.making.every import every_set
from tests.validation.making.standard_set import StandardSet

MADE = {made.identity: made for made in every_set()}


def numbers(data: bytes) -> np.ndarray:
    text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8")
    rows = text.replace(",", ".").replace(";", ",").splitlines() if ";" in text else text.splitlines()
    return np.array([[float(cell or "nan") for cell in row.split(",")] for row in rows[1:]])


def test_what_is_shipped_is_what_the_maker_makes() -> None:
    assert {one.id for one in shipped_sets()} == set(MADE)
    assert len(MADE) >= 40


@pytest.mark.dose(20)
@pytest.mark.parametrize("made", MADE.values(), ids=list(MADE))
def test_a_set_is_as_its_closed_forms_say(made: StandardSet) -> None:
    folder = next(one.folder for one in shipped_sets() if one.id == made.identity)
    # Another machine's sine may differ in the last bit, and so, rarely, in the last digit written.
    assert numbers((folder / RECORD).read_bytes()) == pytest.approx(
        numbers(made.record()), abs=2.1e-2 if made.identity.endswith("comma") else 2.1e-4, nan_ok=True
    )
    shipped, now = json.loads((folder / TRUTH).read_text(encoding="utf-8")), made.truth()
    assert [a["source"] for a in shipped["agreed"]] == [a["source"] for a in now["agreed"]]
    for ours, theirs in zip(now["agreed"], shipped["agreed"], strict=True):
        expected = ours["value"]
        assert theirs["value"] == (
            expected if isinstance(expected, str) else pytest.approx(expected, rel=1e-9)
        )


def test_the_sets_are_small() -> None:
    folder = shipped_sets()[0].folder.parents[1]
    assert sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) < 3_000_000


@pytest.fixture
def one(tmp_path: Path) -> Path:
    source = next(one.folder for one in shipped_sets() if one.id == "closed-form/elastic")
    shutil.copytree(source, tmp_path / "sets" / "elastic")
    return tmp_path / "sets"


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"schema": "bufferstand/validation-set/9"}, "schema"),
        ({"agreed": [{"of": {"in": "nowhere"}}]}, "agreed.0"),
        ({"surprise": 1}, "surprise"),
        ({"kind": 3}, "kind"),
    ],
)
def test_a_truth_file_that_breaks_the_schema_is_refused_with_its_place(
    one: Path, change: dict[str, Any], place: str
) -> None:
    path = one / "elastic" / TRUTH
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | change), encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load_sets(one)
    assert place in str(refused.value)
    assert "truth.json" in str(refused.value)


def test_what_is_no_set_is_refused(one: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match="holds no standard data set"):
        load_sets(tmp_path / "empty")
    (one / "elastic" / TRUTH).write_text("{", encoding="utf-8")
    with pytest.raises(BadInput, match=r"truth\.json"):
        load_sets(one)


def test_a_set_without_its_record_is_refused(one: Path) -> None:
    (one / "elastic" / RECORD).unlink()
    with pytest.raises(BadInput, match=r"no record\.csv"):
        load_sets(one)
