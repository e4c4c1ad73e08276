"""TOML from strangers: nesting, length, digits, extreme numbers, names that no file can have."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.cli.commands.schema import NAMES, described
from bufferstand.evaluation.requirements import LimitSet
from bufferstand.foundation.channels import Zero
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings import (
    Numbers,
    Settings,
    load_settings,
    load_shipped_or_own,
    parse_settings,
)
from bufferstand.foundation.settings.bounds import NumericKey, numeric_keys
from bufferstand.model import ModelFile
from tests.bounds.files import Files, base_campaign, toml_text, with_key
from tests.bounds.test_matrix import RELATIVE_KEYS
from tests.hostile.attempts import Outcome, attempt, bugs

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
SETS = ROOT / "evaluation" / "requirements" / "limit_sets"
REQUIREMENT = {
    "requirement": [{"id": "a", "quantity": "damping", "kind": "static", "where": {"damping": [0.0, 1.0]}}]
}


class Box(Settings):
    """What is parsed here."""

    name: str = ""
    count: int = 0
    size: float = 0.0
    sizes: Numbers = ()


HOSTILE = {
    "arrays": ("name = " + "[" * 5000 + "]" * 5000, "within one another"),
    "inline tables": ("name = " + "{a = " * 3000 + "1" + "}" * 3000, "within one another"),
    "lists, not deep enough for Python": ("sizes = " + "[" * 40 + "]" * 40, "within one another"),
    "a dotted key": (".".join(["a"] * 20_000) + " = 1", "parts"),
    "a head": ("[" + ".".join(['"a b"'] * 20_000) + "]\nb = 1", "parts"),
    "a dotted key in a table": ("name = { " + " . ".join(["a"] * 20_000) + " = 1 }", "parts"),
    "digits": ("count = " + "9" * 5000, "digits"),
    "fewer digits": ("size = " + "9" * 4000, "64 bits"),
    "hexadecimal": ("count = 0x" + "f" * 100_000, "64 bits"),
    "in a list": (f"sizes = [1.0, {10**400}]", "sizes (entry 2): a whole number of more than 64 bits"),
    "infinite": ("size = 1e99999", "no finite number"),
    "many": ("sizes = [" + "1," * 300_000 + "]", "more than 200000 values"),
    "long": ("name = '" + "a" * 2_000_000 + "'", "longer than"),
    "a head that is no head": ("bad = 1\n[" + " " * 100_000, "not valid TOML"),
}


@pytest.mark.parametrize(("text", "said"), HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_text_gets_one_message(text: str, said: str) -> None:
    with pytest.raises(BadInput) as caught:
        parse_settings(text, Box, Path("box.toml"))
    message = str(caught.value)
    assert message.startswith("box.toml: ")
    assert said in message
    assert "\n" not in message
    assert len(message) < 400


def test_numbers_and_nesting_of_every_day_are_taken() -> None:
    text = f"name = 'a.b.c.d'\ncount = {2**63 - 1}\nsizes = [0.1, 0.2]  # 1.1.1.1.1\n"
    assert parse_settings(text, Box, Path("box.toml")).count == 2**63 - 1


def test_a_file_without_end_or_with_an_impossible_name_is_refused(tmp_path: Path) -> None:
    for path in (Path("/dev/zero"), Path("a\0b.toml"), tmp_path / ("a" * 5000)):
        with pytest.raises(BadInput):
            load_settings(path, Box)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "evaluation"])
def test_every_number_of_every_file_has_a_bound_on_either_side(name: str) -> None:
    for key in numeric_keys(described(name)):
        assert math.isfinite(key.low), key.dotted
        assert math.isfinite(key.high) or key.path in RELATIVE_KEYS, key.dotted


def test_so_has_the_zero_of_a_stand() -> None:
    assert all(math.isfinite(key.low) and math.isfinite(key.high) for key in numeric_keys(Zero))


@pytest.mark.slow
def test_texts_that_are_no_file_names_get_a_message(tmp_path: Path) -> None:
    files = Files(tmp_path)
    outcomes = []
    for text in (
        "",
        "/",
        "a\0b",
        "a" * 5000,
        "a" * 5000 + ".toml",
        "/dev/zero",
        "..",
        "\u202e",
        "~",
        "stand.toml/x",
    ):
        for key in ("stand", "specimen", "id", "operator", "note"):
            campaign = base_campaign()
            campaign["campaign"][key] = text
            outcomes.append((f"{key} = {text!r:.20}", attempt("plan", files.write(campaign=campaign))))
    assert not bugs(outcomes)


def extremes(key: NumericKey) -> Iterator[object]:
    """Values at the bounds of a key, and next to nothing."""
    for value in (key.low, key.high, 5e-324, 1e-300, 1e300):
        if math.isfinite(value):
            yield int(value) if key.integer and abs(value) < 2**63 else value


def changed(content: dict[str, Any], key: NumericKey, value: object) -> dict[str, Any]:
    """Return a document with one number set: of lists the first entry, of open tables an entry of its own."""
    if "[key]" not in key.path:
        return with_key(content, key.path, value)
    if key.path[-1] == "[key]":
        return with_key(content, key.path[:-1], {"A": value})
    return with_key(content, key.path[: key.path.index("[key]")], {"damping": [value, value]})


def limit_sets() -> Iterator[tuple[str, dict[str, Any]]]:
    """Limit sets of which one number each is extreme."""
    for key in numeric_keys(LimitSet):
        documents = [tomllib.loads(path.read_text("utf-8")) for path in sorted(SETS.glob("*.toml"))]
        content = next((one for one in documents if key.path[0] in one), documents[0] | REQUIREMENT)
        for value in extremes(key):
            yield f"{key.dotted} = {value!r}", changed(content, key, value)


def models() -> Iterator[tuple[str, dict[str, Any]]]:
    """Spring models of which one number each is extreme."""
    content = tomllib.loads((SAMPLES / "models" / "category-a-elastomer.toml").read_text("utf-8"))
    for key in numeric_keys(ModelFile):
        for value in extremes(key):
            yield f"{key.dotted} = {value!r}", changed(content, key, value)


COMMANDS: dict[str, tuple[Callable[[], Iterator[tuple[str, dict[str, Any]]]], tuple[object, ...]]] = {
    "limits": (limit_sets, ("evaluate", SAMPLES / "runs" / "001-static-5mm_s.h5", "--json", "-", "--limits")),
    "model": (
        models,
        (*("model", "simulate", "--prestress", 40, "--amplitude", 10, "--frequency", 1, "--cycles", 2),),
    ),
}


def outcomes_of(what: str, folder: Path, of: slice) -> list[tuple[str, Outcome]]:
    """Return what came of the command on each file of a kind, or of some."""
    files, command = COMMANDS[what]
    path = folder / "extreme.toml"
    found = []
    for name, content in list(files())[of]:
        path.write_text(toml_text(content), "utf-8")
        found.append((name, attempt(*command, path)))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("what", COMMANDS)
def test_a_sample_of_extreme_numbers_ends_in_no_bug(what: str, tmp_path: Path) -> None:
    found = outcomes_of(what, tmp_path, slice(3, None, 29))
    assert not bugs(found)
    assert any(one.status == 0 for _, one in found)


@pytest.mark.long
@pytest.mark.parametrize("what", COMMANDS)
def test_no_extreme_number_ends_in_a_bug(what: str, tmp_path: Path) -> None:
    found = outcomes_of(what, tmp_path, slice(None))
    assert len(found) > 80
    assert not bugs(found)


def test_a_shipped_file_of_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    """Found by fuzzing: a name of 5,000 digits ended in a traceback."""
    with pytest.raises(BadInput, match="there is no box"):
        load_shipped_or_own(
            "9" * 5000, Box, folder=tmp_path, shipped=tmp_path, what="there is no box “{name}”"
        )
