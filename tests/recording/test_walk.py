"""Files below folders and by patterns: all of them, or a refusal that says where nobody may look."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding.files import files_below, is_there, matching
from bufferstand.recording.finding.run_facts import list_runs, run_files, unsealed
from tests.recording.unprivileged import unprivileged

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs" / "runs"
SEARCHES: list[Callable[[], object]] = [
    lambda: run_files([Path()]),
    lambda: unsealed([Path()]),
    lambda: matching("**/*.h5"),
    lambda: matching("*/*.h5"),
    lambda: matching("secret/*.h5"),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("1.h5", "secret/2.h5", "open/b/3.h5", "open/.hidden/4.h5", "open/.5.h5", "open/6.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    tmp_path.chmod(0o755)
    return tmp_path


@pytest.mark.parametrize("mode", [0o700, 0o744], ids=["not listed", "not searched"])
@pytest.mark.parametrize("search", SEARCHES, ids=["folder", "journals", "at any depth", "one down", "named"])
def test_a_folder_that_must_not_be_looked_into_is_refused(
    folder: Path, search: Callable[[], object], mode: int
) -> None:
    (folder / "secret").chmod(mode)
    with unprivileged(), pytest.raises(BadInput) as refusal:
        search()
    assert str(refusal.value).startswith("secret")
    assert "cannot be looked into: Permission denied; ask for the right" in str(refusal.value)


def test_a_file_in_such_a_folder_is_refused(folder: Path) -> None:
    (folder / "secret").chmod(0o700)
    with unprivileged(), pytest.raises(BadInput, match=r"secret/2\.h5: cannot be looked into"):
        run_files([Path("secret/2.h5")])


def test_a_file_that_must_not_be_read_is_listed_with_its_problem(folder: Path) -> None:
    (folder / "7.h5").write_bytes(next(SAMPLES.glob("*.h5")).read_bytes())
    for name in ("1.h5", "7.h5"):
        (folder / name).chmod(0o600)
    with unprivileged():
        problems = {run.path.name: run.problem for run in list_runs(Path())}
    assert problems["1.h5"] == problems["7.h5"] == "cannot be read: permission denied"
    assert len(problems) == 6


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("**/*.h5", ["1", "3", "2"]),
        ("**", ["1.h5", "open", "open/6.txt", "open/b", "open/b/3.h5", "secret", "secret/2.h5"]),
        ("open/**/*.h5", ["3"]),
        ("open/.*.h5", [".5"]),
        ("open/../*/[12].h5", ["2"]),
        ("o?en/*/*", ["3"]),
        ("**/**/b/**/*.h5", ["3"]),
        ("*/nothing/*.h5", []),
        ("1.h5/*.h5", []),
        ("none/*.h5", []),
    ],
)
def test_patterns(folder: Path, pattern: str, names: list[str]) -> None:
    found = matching(pattern)
    assert [str(path) if pattern == "**" else path.stem for path in found] == names
    assert matching(f"{folder}/{pattern}") == [folder / path for path in found]


def test_links_that_lead_upwards_end(folder: Path) -> None:
    for number in range(12):  # some 12 to the power of 40 paths, if each is followed
        (folder / "open" / f"up{number}").symlink_to("..")
    (folder / "open" / "self").symlink_to("self")
    (folder / "open" / "gone.h5").symlink_to("nowhere")
    assert [str(path) for path in matching("open/**/*.h5") if path.is_file()] == [
        "open/b/3.h5", "open/up0/1.h5", "open/up0/secret/2.h5"
    ]  # fmt: skip
    assert [str(path) for path in files_below(Path("open"), ".h5")] == [
        "open/.5.h5", "open/.hidden/4.h5", "open/b/3.h5"
    ]  # fmt: skip
    with pytest.raises(BadInput, match="Too many levels of symbolic links; check the path"):
        is_there(Path("open/self"))


@pytest.mark.parametrize("name", ["x" * 5000, "x/" * 4000, "a\0b"])
def test_what_is_no_path_is_refused(folder: Path, name: str) -> None:
    with pytest.raises(BadInput) as refusal:
        is_there(Path(name))
    assert len(str(refusal.value)) < 300


def test_what_is_below_a_file_is_not_there(folder: Path) -> None:
    assert not is_there(folder / "1.h5" / "below")
    assert files_below(folder / "1.h5", ".h5") == []
