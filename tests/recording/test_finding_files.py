"""Where files really lie is found as the system finds it, with each folder looked up once."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bufferstand.recording.finding.files import RealPaths


@pytest.fixture
def places(tmp_path: Path) -> Path:
    """Folders and files with links to both, one that leads nowhere and two that lead to each other."""
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "x.h5").touch()
    (tmp_path / "linked").symlink_to(tmp_path / "a")
    (tmp_path / "a" / "y.h5").symlink_to(tmp_path / "linked" / "b" / "x.h5")
    (tmp_path / "a" / "gone.h5").symlink_to(tmp_path / "nowhere")
    (tmp_path / "a" / "one.h5").symlink_to(tmp_path / "a" / "two.h5")
    (tmp_path / "a" / "two.h5").symlink_to(tmp_path / "a" / "one.h5")
    return tmp_path


@pytest.mark.parametrize(
    "name",
    ["a/b/x.h5", "linked/b/x.h5", "a/y.h5", "linked/y.h5", "a/gone.h5", "a/one.h5",
     "a/b/../y.h5", "no/x.h5", "a/b/..", "."],
)  # fmt: skip
def test_it_is_what_realpath_says(places: Path, name: str) -> None:
    real = RealPaths()
    for _ in range(2):  # the second time from what is known of the folder
        assert real.of(places / name) == os.path.realpath(places / name)


def test_a_relative_name_is_of_the_folder_one_is_in(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(places / "linked")
    assert (
        RealPaths().of(Path("b/x.h5")) == RealPaths().of(Path("y.h5")) == str((places / "a/b/x.h5").resolve())
    )
