"""Which files a user means: files, folders, patterns, lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.evaluation.archive.run_files import find_runs
from bufferstand.foundation.errors import BadInput


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("a/1.h5", "a/2.h5", "a/b/3.h5", "a/note.txt", "a/4.h5.tmp"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("sources", "names"),
    [
        (["a"], ["1", "2", "3"]),
        (["a/**/*.h5"], ["1", "2", "3"]),
        (["a/**"], ["1", "2", "3"]),
        (["a/*.h5"], ["1", "2"]),
        (["a/b/3.h5", "a"], ["3", "1", "2"]),
        (["a/2.h5", "a/../a/2.h5"], ["2"]),
        (["a/[13].h5"], ["1"]),
    ],
)
def test_what_is_named(folder: Path, sources: list[str], names: list[str]) -> None:
    assert [path.stem for path in find_runs(sources)] == names
    absolute = [str(folder / source) for source in sources]
    assert [path.stem for path in find_runs(absolute)] == names


def test_lists(folder: Path) -> None:
    (folder / "list.txt").write_text("# the good ones\na/2.h5\n\n a/b \ngone.h5\n", encoding="utf-8")
    for found in (find_runs(["@list.txt"]), find_runs([], [Path("list.txt")])):
        # What is gone stays in the list: it is for the evaluation to say so, once, among the others.
        assert [path.name for path in found] == ["2.h5", "3.h5", "gone.h5"]


def test_lines_of_a_list_are_no_patterns(folder: Path) -> None:
    (folder / "list.txt").write_bytes("\ufeffa/1.h5\r\na/gone[1].h5\na/*.h5\n".encode())
    assert [path.name for path in find_runs(["@list.txt"])] == ["1.h5", "gone[1].h5", "*.h5"]


def test_what_exists_is_no_pattern_and_no_list(folder: Path) -> None:
    (folder / "@x.h5").touch()
    (folder / "a" / "[1].h5").touch()
    assert [path.name for path in find_runs(["@x.h5", "a/[1].h5"])] == ["@x.h5", "[1].h5"]


@pytest.mark.parametrize(
    ("sources", "said"),
    [
        (["b"], "b: no such file or folder"),
        (["a/*.hdf"], "a/*.hdf: the pattern matches no run file"),
        (["@none.txt"], "none.txt: no such file"),
        (["@empty.txt"], "empty.txt: the list names no run"),
        (["@bad.txt"], "bad.txt: line 2: z: no run files (*.h5) in this folder or below it"),
        (["@print0.txt"], "print0.txt: line 1: holds NUL characters; write a path a line"),
        (["@long.txt"], "long.txt: line 2: xxxxxxxx"),
        (["x" * 5000], "xxxxxxxx"),
        (["*" * 5000], "********"),
        (["@" + "x" * 5000], "@xxxxxxx"),
        ([""], "PATH: the path is empty; write . for the current folder"),
        (["@"], "@: the name of the list is missing; write @FILE"),
        ([], "PATH: no run is named"),
    ],
)
def test_what_cannot_be_meant(folder: Path, sources: list[str], said: str) -> None:
    (folder / "empty.txt").write_text("\n# nothing\n")
    (folder / "z").mkdir()
    (folder / "bad.txt").write_text("a/1.h5\nz\n")
    (folder / "print0.txt").write_text("a/1.h5\0a/2.h5\0")
    (folder / "long.txt").write_text(f"a/1.h5\n{'x' * 5000}\n")
    with pytest.raises(BadInput) as refusal:
        find_runs(sources)
    assert str(refusal.value).startswith(said)
    assert len(str(refusal.value)) < 400
