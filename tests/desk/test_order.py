"""Steps change places in a campaign's text, each with its own comments, and nothing else is touched."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.daq.desk.prepare import moved_step
from bufferstand.foundation import BadInput
from tests.desk.served import SAMPLES

CAMPAIGNS = sorted(path for path in SAMPLES.glob("*.toml") if "[campaign]" in path.read_text())
TEXT = """\
# The campaign
[campaign]
id = "a"

# cold
# and first
[[step]]
kind = "static" # slowly
cycles = 3

[limits]          # between the steps
force_max_kN = 600.0

# warm
[[step]]
kind = "hold"
note = '''
[[step]]
no heading'''
table = [
  [1],
]
[step.own]
x = 1


[[step]]
kind = "sweep"
# last word"""


def swapped(steps: list[Any], index: int, by: int) -> list[Any]:
    order = list(steps)
    order[index], order[index + by] = order[index + by], order[index]
    return order


@pytest.mark.parametrize("path", CAMPAIGNS, ids=lambda path: path.stem)
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_two_steps_change_places_there_and_back_and_no_line_is_lost(path: Path, data: st.DataObject) -> None:
    text = path.read_text()
    content = tomllib.loads(text)
    index = data.draw(st.integers(0, max(0, len(content["step"]) - 2)))
    if len(content["step"]) < 2:
        return
    new = moved_step(text, index, 1)
    assert tomllib.loads(new) == {**content, "step": swapped(content["step"], index, 1)}
    assert sorted(new.splitlines()) == sorted(text.splitlines())
    assert moved_step(new, index + 1, -1) == text
    assert moved_step(text, index + 1, -1) == new


def test_a_step_takes_the_comments_right_above_it_along_and_other_tables_stay() -> None:
    text = TEXT.replace("[[step]]\nno heading", "no heading").replace("table = [\n  [1],\n]\n", "")
    new = moved_step(text, 0, 1)
    first, _, rest = new.partition("[limits]          # between the steps\n")
    assert '# warm\n[[step]]\nkind = "hold"' in first
    assert "[step.own]\nx = 1\n" in first
    assert '# cold\n# and first\n[[step]]\nkind = "static" # slowly\ncycles = 3\n' in rest
    last = moved_step(text, 2, -1)
    assert [step["kind"] for step in tomllib.loads(last)["step"]] == ["static", "sweep", "hold"]
    assert "# last word\n" in last
    assert last.endswith("x = 1\n")


@pytest.mark.parametrize(
    ("text", "index", "by"),
    [
        (TEXT, 0, 1),  # what looks like a heading inside of a text
        (TEXT.replace("[[step]]\nno", "no"), 0, -1),
        (TEXT.replace("[[step]]\nno", "no"), 2, 1),
        (TEXT.replace("[[step]]\nno", "no"), -1, 1),
        (TEXT.replace("[[step]]\nno", "no"), 0, 2),
        (TEXT.replace("[[step]]\nno", "no"), 0, 0),
        ("step = [{kind = 'hold'}, {kind = 'static'}]\n", 0, 1),
        ("step = 3\n", 0, 1),
        ("[a", 0, 1),
    ],
)
def test_what_cannot_be_told_apart_or_is_not_there_is_refused(text: str, index: int, by: int) -> None:
    with pytest.raises(BadInput):
        moved_step(text, index, by)
