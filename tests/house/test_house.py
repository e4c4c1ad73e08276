"""The house itself: what is committed names no machine and no registry, and imports point down."""

from __future__ import annotations

import re
import subprocess
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from bufferstand.recording.runfile.file import read_metadata

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".py", ".md", ".toml", ".lock", ".txt", ".html", ".typ", ".css", ".json", ".yml", ""}


def committed_files() -> list[Path]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout", allow_module_level=True)
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def entries_of(lock: str) -> list[str]:
    """Return the packages of a lock file, each with its pin and hashes."""
    return re.split(r"\n(?=\S)", (ROOT / lock).read_text().strip())


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-run.lock"])
def test_lock_is_pinned_by_hash_and_names_no_address(lock: str) -> None:
    entries = entries_of(lock)
    assert len(entries) > 40
    for entry in entries:
        assert "://" not in entry
        assert "==" in entry, entry
        assert "--hash=sha256:" in entry, entry


def test_what_is_pinned_for_running_is_a_part_of_the_whole() -> None:
    assert set(entries_of("requirements-run.lock")) < set(entries_of("requirements.lock"))


def test_what_is_pinned_for_running_is_what_running_needs() -> None:
    """What the project needs, what that needs, and what makes an editable installation."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    asked = [*project["project"]["dependencies"], *project["dependency-groups"]["build"]]
    needed: set[str] = set()
    while asked:
        one = Requirement(asked.pop())
        name = canonicalize_name(one.name)
        if name in needed or (one.marker is not None and not one.marker.evaluate({"extra": ""})):
            continue
        needed.add(name)
        asked += requires(name) or []
    assert {entry.partition("==")[0] for entry in entries_of("requirements-run.lock")} == needed


def test_no_committed_text_names_a_machines_path_or_a_registry() -> None:
    # put together here, so that this file does not contain what it looks for
    forbidden = re.compile(
        "|".join(["/" + "work/", "/" + "root/", "files" + r"\.pythonhosted", "pypi" + r"\.org"])
    )
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in committed_files()
        if path.suffix in TEXT
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if forbidden.search(line)
    ]
    assert found == []


def test_sample_runs_stay_small() -> None:
    total = sum(path.stat().st_size for path in (ROOT / "sample_runs").rglob("*") if path.is_file())
    assert total < 5_000_000


def test_every_room_is_in_the_package_and_in_the_layers() -> None:
    project = (ROOT / "pyproject.toml").read_text()
    rooms = {path.name for path in (ROOT / "bufferstand").iterdir() if path.is_symlink()}
    assert rooms == {"cli", "daq", "drivers", "evaluation", "foundation", "model", "protocols", "recording"}
    layers = project.partition("layers = [")[2].partition("]")[0]
    for room in rooms:
        assert (ROOT / "bufferstand" / room).readlink() == Path("..") / room
        assert f"bufferstand.{room}" in layers, f"{room}: import-linter"
        assert f'"{room}".msg' in project, f"{room}: the bare name is forbidden (ruff)"


def test_sample_runs_name_no_folder_of_the_machine_they_were_made_on() -> None:
    for path in (ROOT / "sample_runs" / "runs").glob("*.h5"):
        text = str(read_metadata(path))
        assert not re.search(r"/(tmp|home|root|work|Users)/", text), path.name
