"""The program's own JSON is bounded, typed and told by place when it is read back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import (
    MistypedError,
    NotJson,
    json_content,
    json_lines,
    json_object,
    of_type,
    typed_json,
    write_text,
)

FILE = Path("campaign.json")


@dataclass(frozen=True)
class Step:
    name: str
    cycles: int
    forces_kN: tuple[float, ...] = ()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "not valid JSON"),
        (b'{"a": "\xff"}', "not UTF-8 text"),
        ('{"a": NaN}', "NaN is no number of JSON"),
        ('{"a": -Infinity}', "-Infinity is no number of JSON"),
        ("[" * 40 + "]" * 40, "more than 32 tables and lists within one another"),
        ("[" * 100_000, "more than 32 tables and lists within one another"),
        ('{"a": ' + "9" * 5000 + "}", "digits"),
    ],
)
def test_what_no_document_of_ours_is_gets_one_reason(text: str | bytes, why: str) -> None:
    with pytest.raises(NotJson, match=why):
        json_content(text)


def test_a_document_has_so_many_values_and_no_more() -> None:
    text = json.dumps({"a": [1.0] * 20})
    assert json_content(text, most_values=30) == {"a": [1.0] * 20}
    with pytest.raises(NotJson):
        json_content(text, most_values=10)


def test_an_object_is_wanted_and_the_file_named() -> None:
    assert json_object('{"a": 1}', FILE) == {"a": 1}
    with pytest.raises(BadInput, match=r"campaign\.json: line 3: a JSON object is expected here; restore it"):
        json_object("[1]", FILE, place="line 3", remedy="restore it")
    with pytest.raises(BadInput, match=r"campaign\.json: not valid JSON: .*; restore it"):
        json_object("x", FILE, remedy="restore it")


def test_lines_are_numbered_and_one_that_was_cut_off_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "as-run.jsonl"
    assert list(json_lines(path)) == []
    path.write_bytes(b'{"a": 1}\n{"a": 2}\n\xff\n{"a": ')
    assert list(json_lines(path)) == [(1, {"a": 1}), (2, {"a": 2})]
    with pytest.raises(BadInput, match="cannot be read"):
        list(json_lines(tmp_path))


def test_a_document_becomes_what_its_annotations_say() -> None:
    text = '{"name": "slow", "cycles": 3, "forces_kN": [1, 2.5]}'
    assert typed_json(Step, text, FILE) == Step("slow", 3, (1.0, 2.5))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('{"name": "slow"}', "cycles: "),
        ('{"name": "slow", "cycles": "3"}', 'cycles = "3": it should be a valid integer'),
        ('{"name": "slow", "cycles": 3, "forces_kN": [1, "' + "x" * 100 + '"]}', "…"),
        ('{"name": "slow", "cycles": 3, "forces_kN": [1e300]}', "forces_kN"),
    ],
)
def test_a_value_of_another_type_is_told_by_its_key(text: str, why: str) -> None:
    with pytest.raises(BadInput) as caught:
        typed_json(Step, text, FILE, remedy="restore it")
    assert why in str(caught.value)
    assert str(caught.value).startswith("campaign.json: ")
    assert str(caught.value).endswith("; restore it")


def test_numbers_may_be_bounded_otherwise() -> None:
    assert of_type(Step, {"name": "a", "cycles": 1, "forces_kN": [5.0]}, largest=10.0).forces_kN == (5.0,)
    with pytest.raises(MistypedError):
        of_type(Step, {"name": "a", "cycles": 1, "forces_kN": [50.0]}, largest=10.0)


def test_a_text_is_written_with_its_folder_or_it_is_said(tmp_path: Path) -> None:
    write_text(tmp_path / "a" / "b.txt", "x\ny\n")
    assert (tmp_path / "a" / "b.txt").read_bytes() == b"x\ny\n"
    with pytest.raises(BadInput, match=r"cannot be written: .*; choose another place"):
        write_text(tmp_path / "a" / "b.txt" / "c.txt", "x")
