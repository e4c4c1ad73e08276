"""Every benchmark of the folder works, states goals and sizes in one form, and stands in one table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pytest

import benchmarks.__main__ as command
from benchmarks.common import Benchmark, NotHere, load, names

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_each_ends_with_small_sizes_and_yields_its_ratios(name: str) -> None:
    """How fast it was is not asked."""
    benchmark = load(name)
    try:
        ratios = benchmark.ratios(smoke=True)
    except NotHere as lacking:
        pytest.skip(str(lacking))
    assert list(ratios) == list(benchmark.goals)
    assert all(math.isfinite(ratio) for ratio in ratios.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_each_states_goals_and_two_sizes_of_the_same_kind(name: str) -> None:
    benchmark = load(name)
    assert benchmark.goals
    assert all(goal >= 0.0 and " / " in compared for compared, goal in benchmark.goals.items())
    assert benchmark.full.func is benchmark.smoke.func
    assert benchmark.full.keywords.keys() == benchmark.smoke.keywords.keys()
    assert benchmark.full.keywords != benchmark.smoke.keywords


def test_no_file_of_the_folder_is_left_out() -> None:
    files = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    assert set(names()) == files - {"__init__", "__main__"}
    assert {"acquisition", "archive", "evaluation", "reaction"} <= set(names())


def test_a_file_without_a_benchmark_is_named(tmp_path: Path) -> None:
    (tmp_path / "fresh.py").touch()
    (tmp_path / "common").mkdir()
    (tmp_path / "common/__init__.py").touch()
    assert names(tmp_path) == ["fresh"]
    with pytest.raises(TypeError, match=r"benchmarks/common\.py states no BENCHMARK"):
        load("common")


def made(ratios: Sequence[float] | Exception) -> Benchmark:
    def measure(folder: Path, *, size: int) -> Sequence[float]:
        assert folder.is_dir()
        if isinstance(ratios, Exception):
            raise ratios
        return [ratio / size for ratio in ratios]

    goals = {"ours / theirs": 2.0, "second / first": 0.5}
    return Benchmark(goals, full=partial(measure, size=1), smoke=partial(measure, size=10))


def table(capsys: pytest.CaptureFixture[str]) -> list[list[str]]:
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines][2:]


@pytest.fixture
def catalogue(monkeypatch: pytest.MonkeyPatch) -> dict[str, Benchmark]:
    found: dict[str, Benchmark] = {}
    monkeypatch.setattr(command, "names", lambda: list(found))
    monkeypatch.setattr(command, "load", found.__getitem__)
    return found


def test_the_table_says_which_goals_are_met(
    catalogue: dict[str, Benchmark], capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue |= {"one": made([2.0, 0.51]), "two": made([1.0, 0.1])}
    assert command.main([]) == 1
    assert table(capsys) == [
        ["one", "ours / theirs", "2.000", "≤ 2", "yes"],
        ["one", "second / first", "0.510", "≤ 0.5", "NO"],
        ["two", "ours / theirs", "1.000", "≤ 2", "yes"],
        ["two", "second / first", "0.100", "≤ 0.5", "yes"],
    ]
    assert command.main(["two"]) == 0
    assert [cells[0] for cells in table(capsys)] == ["two", "two"]


def test_small_sizes_are_not_judged(
    catalogue: dict[str, Benchmark], capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue["one"] = made([200.0, 51.0])
    assert command.main(["--smoke"]) == 0
    assert [cells[2:] for cells in table(capsys)] == [
        ["20.000", "≤ 2", "not judged"],
        ["5.100", "≤ 0.5", "not judged"],
    ]


def test_one_that_fails_does_not_hide_the_others(
    catalogue: dict[str, Benchmark], capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue |= {
        "broken": made(ZeroDivisionError("by nothing")),
        "short": made([1.0]),
        "lacking": made(NotHere("needs a C compiler (cc)")),
        "sound": made([1.0, 0.1]),
    }
    assert command.main([]) == 1
    assert [(cells[0], cells[-1]) for cells in table(capsys)] == [
        ("broken", "FAILED"),
        ("short", "FAILED"),
        ("lacking", "not measured"),
        ("sound", "yes"),
        ("sound", "yes"),
    ]
    assert command.main(["lacking"]) == 0
    assert table(capsys)[0][1] == "needs a C compiler (cc)"


def test_an_unknown_name_is_refused(
    catalogue: dict[str, Benchmark], capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue["one"] = made([1.0, 1.0])
    with pytest.raises(SystemExit, match="2"):
        command.main(["other"])
    assert "there is no benchmark other; there are one" in capsys.readouterr().err
