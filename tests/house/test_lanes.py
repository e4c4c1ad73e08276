"""The fast lane touches every room, and what it runs of each is held by a floor."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from pathlib import Path

from tests.coverage_floors import FLOORS, by_room, fallen
from tests.doses import beyond
from tests.sharing import scope
from tests.slow import SLOW

ROOT = Path(__file__).resolve().parents[2]
ROOMS = sorted(path.name for path in (ROOT / "bufferstand").iterdir() if path.is_symlink())


def fast_tests(file: Path) -> int:
    """Return how many functions of a file are tests of the fast lane; one of many cases counts once."""
    if file.relative_to(ROOT).as_posix().startswith(SLOW):
        return 0
    tree = ast.parse(file.read_text(encoding="utf-8"))
    if any(isinstance(node, ast.Assign) and "pytestmark" in ast.unparse(node) for node in tree.body):
        return 0
    return sum(
        isinstance(node, ast.FunctionDef)
        and node.name.startswith("test_")
        and not any(
            "mark.slow" in ast.unparse(mark) or "mark.long" in ast.unparse(mark)
            for mark in node.decorator_list
        )
        for node in ast.walk(tree)
    )


def test_the_fast_lane_touches_every_room() -> None:
    counted: Counter[str] = Counter()
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        counted[file.relative_to(ROOT).parts[1].partition("_")[0]] += fast_tests(file)
    assert {room: counted[room] for room in ROOMS if counted[room] < 40} == {}


def test_what_is_listed_as_slow_is_there() -> None:
    assert list(SLOW) == sorted(set(SLOW))
    assert [place for place in SLOW if not (ROOT / place).exists()] == []


def test_of_a_dose_the_ends_and_the_middle_run() -> None:
    cases = [f"case {number}" for number in range(9)]
    assert beyond(cases, 3) == [case for case in cases if case not in {"case 0", "case 4", "case 8"}]
    assert beyond(cases, 1) == cases[1:]
    assert beyond(cases[:2], 4) == []
    assert all(len(beyond(cases, size)) == 9 - size for size in range(1, 10))


def test_every_room_has_a_floor() -> None:
    floors = tomllib.loads(FLOORS.read_text(encoding="utf-8"))["percent"]
    assert sorted(floors) == ROOMS
    assert all(isinstance(floor, int) for floor in floors.values())


def test_a_room_that_falls_is_named() -> None:
    def lines(ran: int) -> dict[str, dict[str, int]]:
        return {"summary": {"num_statements": 100, "covered_lines": ran}}

    shares = by_room(
        {"files": {"daq/a.py": lines(90), "daq/guards/b.py": lines(70), "model/c.py": lines(50)}}
    )
    assert shares == {"daq": 80.0, "model": 50.0}
    assert fallen(shares, {"daq": 80, "model": 50}) == []
    assert fallen(shares, {"daq": 81, "model": 50, "cli": 1}) == [
        "daq: 80.0 % of its lines run in the fast lane, the floor is 81 %",
        "cli: 0.0 % of its lines run in the fast lane, the floor is 1 %",
    ]
    assert fallen(shares, {"daq": 80}) == ["model: no floor in coverage_floors.toml"]


def test_tests_that_share_a_fixture_of_their_file_go_to_one_worker() -> None:
    """One that has cases is made once for each of them."""
    whole, cases = "tests/desk/test_results.py", "tests/contract/stand/test_stand.py"
    assert {scope(f"{whole}::{test}") for test in ("test_one", "test_other[a-b]")} == {whole}
    assert scope(f"{cases}::test_one[in process]") == scope(f"{cases}::test_other[in process-3]")
    assert scope(f"{cases}::test_one[in process]") != scope(f"{cases}::test_one[TCP, GSV]")
    alone = "tests/house/test_lanes.py::test_every_room_has_a_floor"
    assert scope(alone) == alone
