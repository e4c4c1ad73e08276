"""Files for results: whole or as they were before, and never in place of a recording."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import h5py
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.output import check_outputs, replaced_whole


def write_half(path: Path, error: Exception) -> None:
    with replaced_whole(path) as place:
        place.write_text("half")
        raise error


def test_what_was_there_is_replaced_when_all_is_written(tmp_path: Path) -> None:
    path = tmp_path / "cycles.csv"
    path.write_text("old")
    path.chmod(0o640)
    with replaced_whole(path) as place:
        place.write_text("new")
        assert (path.read_text(), place.suffix) == ("old", ".csv")
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640
    assert [item.name for item in tmp_path.iterdir()] == ["cycles.csv"]


def test_what_was_there_stays_when_writing_fails(tmp_path: Path) -> None:
    path = tmp_path / "cycles.csv"
    path.write_text("old")
    for error in (OSError(28, "No space left on device"), RuntimeError("something else")):
        with pytest.raises((BadInput, RuntimeError)) as caught:
            write_half(path, error)
        refused = isinstance(caught.value, BadInput)
        assert refused == isinstance(error, OSError)
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["cycles.csv"]


def test_a_new_file_has_the_usual_rights(tmp_path: Path) -> None:
    with replaced_whole(tmp_path / "new.json") as place:
        place.write_text("{}")
    (tmp_path / "usual").touch()
    assert (tmp_path / "new.json").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "real.json").write_text("old")
    (tmp_path / "link.json").symlink_to("real.json")
    with replaced_whole(tmp_path / "link.json") as place:
        place.write_text("new")
    assert (tmp_path / "link.json").is_symlink()
    assert (tmp_path / "real.json").read_text() == "new"


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    reader = subprocess.Popen(
        [sys.executable, "-c", "import sys; print(open(sys.argv[1]).read())", str(pipe)],
        stdout=subprocess.PIPE,
        text=True,
    )
    with replaced_whole(pipe) as place, place.open("w") as stream:
        stream.write("through")
    assert reader.communicate()[0] == "through\n"
    assert pipe.is_fifo()


@pytest.mark.parametrize("block", [0, 512, 4096])
def test_a_recording_is_no_place_for_results(tmp_path: Path, block: int) -> None:
    path = tmp_path / "run.json"
    with h5py.File(path, "w", userblock_size=block) as tree:
        tree["force"] = [1.0]
    before = path.read_bytes()
    with pytest.raises(BadInput, match="is or would be a recording"):
        write_half(path, OSError())
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["run.h5", "run.H5", "run.journal"])
def test_a_name_of_a_recording_is_no_name_of_results(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match="is or would be a recording"):
        check_outputs([tmp_path / name])


def test_places_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    same = tmp_path / "folder" / ".." / "a.csv"
    for paths, message in (
        ([tmp_path / "folder"], "is a folder"),
        ([tmp_path / "none" / "a.csv"], "no such folder"),
        ([tmp_path / "a.csv", same], "two results would be written into one file"),
    ):
        with pytest.raises(BadInput, match=message):
            check_outputs(paths)
