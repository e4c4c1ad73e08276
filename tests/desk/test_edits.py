"""One value is changed in a file's text, and nothing else: comments, order and what is not known stay."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.daq.desk.prepare import add_step, changed, groups_of, value_of, without_step
from bufferstand.daq.desk.prepare.edits import NEW_STEPS
from bufferstand.daq.desk.prepare.fields import step_kinds, words_of
from bufferstand.foundation import BadInput
from tests.cli.processes import bufferstand
from tests.desk.served import SAMPLES, laboratory

CAMPAIGNS = sorted(path for path in SAMPLES.glob("*.toml") if "[campaign]" in path.read_text())
VALUES = st.one_of(
    st.booleans(),
    st.integers(-(10**6), 10**6),
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.text(st.characters(exclude_categories=["Cs", "Cc", "Cf"]), max_size=20),
    st.lists(st.floats(-1e3, 1e3), max_size=4),
    st.none(),
)


def comments(text: str) -> list[str]:
    """Return the lines that are comments."""
    return [line.strip() for line in text.splitlines() if line.strip().startswith("#")]


def places(text: str) -> list[tuple[str | int, ...]]:
    """Return the place of every field of the form."""
    return [field.path for group in groups_of(tomllib.loads(text)) for field in group.fields]


@pytest.mark.parametrize("path", CAMPAIGNS, ids=lambda path: path.stem)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_a_change_is_there_and_nothing_else_is_changed(path: Path, data: st.DataObject) -> None:
    text = path.read_text()
    place = data.draw(st.sampled_from(places(text)))
    value: Any = data.draw(VALUES)
    new = changed(text, place, value)
    wanted = tomllib.loads(text)
    table = wanted
    for part in place[:-1]:
        table = table.setdefault(part, {}) if isinstance(part, str) else table[part]  # type: ignore[index, assignment]
    if value is None:
        table.pop(place[-1], None)  # type: ignore[arg-type]
        wanted = {key: one for key, one in wanted.items() if one or key in tomllib.loads(text)}
    else:
        table[place[-1]] = value  # type: ignore[index]
    assert tomllib.loads(new) == wanted
    assert comments(new) == comments(text)
    lines = set(text.splitlines())
    fresh = [line for line in new.splitlines() if line not in lines]
    assert len(fresh) <= 1 + new.count("\n") - text.count("\n") if value is not None else not fresh


def test_a_comment_behind_a_value_stays_and_a_new_key_stands_with_its_table() -> None:
    text = "[limits]\nforce_max_kN = 600.0   # the load cell's\n\n# What follows\n[zero]\ntouch = true\n"
    assert changed(text, ("limits", "force_max_kN"), 500.0) == text.replace("600.0", "500.0")
    new = changed(text, ("limits", "stroke_max_mm"), 90.0)
    assert new == text.replace("cell's\n", "cell's\nstroke_max_mm = 90.0\n")
    assert changed(new, ("limits", "stroke_max_mm"), None) == text
    assert changed(text, ("motion", "ramp_speed_mm_per_s"), None) == text


def test_what_the_form_does_not_know_stays() -> None:
    text = '[campaign]\nid = "a"\nstand = "s"\nspecimen = "p"\nmine = 1 # own\n\n[others]\nx = [1, 2]\n'
    new = changed(text, ("campaign", "title"), "b")
    assert "mine = 1 # own" in new
    assert "[others]\nx = [1, 2]" in new
    assert groups_of(tomllib.loads(new))[0].unknown == ("mine",)


@pytest.mark.parametrize("path", CAMPAIGNS, ids=lambda path: path.stem)
def test_steps_are_added_at_the_end_and_taken_out_with_other_comments_kept(path: Path) -> None:
    text = path.read_text()
    steps = tomllib.loads(text)["step"]
    for index in range(len(steps)):
        new = without_step(text, index)
        assert tomllib.loads(new).get("step", []) == steps[:index] + steps[index + 1 :]
        assert {key: one for key, one in tomllib.loads(new).items() if key != "step"} == {
            key: one for key, one in tomllib.loads(text).items() if key != "step"
        }
        assert set(comments(text)) - set(comments(new)) <= set(comments_within(text, index))
    added = add_step(text, "static")
    assert without_step(added, len(steps)).rstrip("\n") == text.rstrip("\n")
    for wrong in (-1, len(steps)):
        with pytest.raises(BadInput, match="no such step"):
            without_step(text, wrong)


def comments_within(text: str, index: int) -> list[str]:
    """Return the comments between the heading and the last value of a step."""
    part = text.split("[[step]]")[index + 1]
    lines = part.splitlines()
    last = max(at for at, line in enumerate(lines) if line.strip() and not line.strip().startswith("#"))
    return comments("\n".join(lines[:last]))


@pytest.mark.parametrize("kind", NEW_STEPS)
def test_each_new_step_can_be_planned(tmp_path: Path, kind: str) -> None:
    assert kind in step_kinds()
    demo = laboratory(tmp_path) / "demo.toml"
    text = demo.read_text()
    demo.write_text(add_step(text[: text.index("# First, while")], kind))
    done = bufferstand("plan", demo)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("text", ["[limits", 'a = "', "[step]\nx = 1\n", "step = 3\n"])
def test_a_text_that_cannot_be_changed_is_refused_in_words(text: str) -> None:
    with pytest.raises(BadInput):
        changed(text, ("step", 0, "cycles"), 3)


@pytest.mark.parametrize(
    ("kind", "said", "value"),
    [
        ("number", "12,5", 12.5),
        ("number", " 7 ", 7.0),
        ("number", "1e-3", 0.001),
        ("integer", "5", 5),
        ("numbers", "20", 20),
        ("numbers", "20, 40.5", [20, 40.5]),
        ("numbers", "[20]", [20]),
        ("list", "20", [20]),
        ("list", "20; 25", [20, 25]),
        ("boolean", "true", True),
        ("text", " a b ", "a b"),
        ("number", "", None),
    ],
)
def test_what_is_typed_becomes_a_value(kind: Any, said: str, value: Any) -> None:
    found = value_of(kind, said)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("kind", "said"),
    [("number", "fast"), ("number", "nan"), ("integer", "1.5"), ("boolean", "yes"), ("list", "a")],
)
def test_what_is_no_value_is_refused(kind: Any, said: str) -> None:
    with pytest.raises(BadInput):
        value_of(kind, said)


def test_the_form_shows_everything_that_the_schema_has() -> None:
    groups = groups_of(tomllib.loads((SAMPLES / "demo.toml").read_text()))
    fields = {field.path: field for group in groups for field in group.fields}
    assert fields["limits", "force_max_kN"].value == "600"
    assert fields["limits", "force_max_kN"].kind == "number"
    assert fields["limits", "on_temperature_stop"].choices == ("stop", "wait-and-continue", "skip")
    assert fields["step", 1, "prestress_mm"].value == "20"
    assert fields["step", 0, "start_temperature_C"].kind == "list"
    assert fields["limits", "stroke_max_mm"].value == ""
    assert words_of("speed_max_mm_per_s") == ("speed max", "mm/s")
    assert groups_of({}), "an empty file has a form, too"
    assert groups_of({"campaign": 3, "step": [1, {"kind": "nonsense", "x": 1}]})
