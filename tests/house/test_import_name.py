"""One import name: files and packages of others that are called as our rooms cannot be met."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.house.test_house import ROOT, committed_files

ROOMS = sorted(path.name for path in (ROOT / "bufferstand").iterdir() if path.is_dir() and path.is_symlink())
USE = """
import sys
import bufferstand as bs
from bufferstand.cli.main import main

import {rooms} # the user's own

runs = sys.argv[1]
print(bs.__file__)
print(len(bs.runs(runs)), len(bs.cycles(bs.evaluate(runs, draws=0))))
print(len(bs.plan_campaign(sys.argv[2]).steps))
sys.argv = ["bufferstand", "runs", runs]
try:
    main()
except SystemExit as end:
    print("status", end.code)
assert [room.MINE for room in ({rooms})] == ["mine"] * {count}
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the wheel of the tree, unpacked as an installer would."""
    folder = tmp_path_factory.mktemp("wheel")
    build = (
        "import sys; from hatchling.builders.wheel import WheelBuilder; "
        "next(WheelBuilder(sys.argv[1]).build(directory=sys.argv[2], versions=['standard']))"
    )
    subprocess.run(
        [sys.executable, "-P", "-c", build, str(ROOT), str(folder)],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    (made,) = folder.glob("*.whl")
    with zipfile.ZipFile(made) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_brings_one_package(wheel: Path) -> None:
    assert {path.name for path in wheel.iterdir() if not path.name.endswith(".dist-info")} == {"bufferstand"}
    packed = {
        path.relative_to(wheel / "bufferstand").as_posix()
        for path in (wheel / "bufferstand").rglob("*")
        if path.is_file() and not {"docs", "sample_runs"} & set(path.parts)
    }
    shipped = {
        path.relative_to(ROOT).as_posix()
        for path in committed_files()
        if path.relative_to(ROOT).parts[0] in ROOMS
    }
    assert shipped == packed - {"__init__.py", "__main__.py", "py.typed"}
    assert "py.typed" in packed
    assert (wheel / "bufferstand" / "cli" / "docs" / "index.md").is_file()


def test_from_the_wheel_files_of_the_users_own_lie_beside_the_script(wheel: Path, tmp_path: Path) -> None:
    """``evaluation.py``, ``model.py``, ``cli.py`` … beside a script, and a second wheel with folders so
    named."""
    here, second = tmp_path / "here", tmp_path / "second"
    here.mkdir()
    for room in ROOMS:
        (here / f"{room}.py").write_text("MINE = 'mine'\n")
        (second / room).mkdir(parents=True)
        (second / room / "__init__.py").write_text("MINE = 'mine'\n")
    _use(here, [wheel, second], wheel)
    _use(tmp_path / "second", [second, wheel], wheel)


def test_in_the_checkout_too(tmp_path: Path) -> None:
    for room in ROOMS:
        (tmp_path / f"{room}.py").write_text("MINE = 'mine'\n")
    _use(tmp_path, [ROOT], ROOT)


def _use(folder: Path, path: list[Path], comes_from: Path) -> None:
    script = folder / "script.py"
    script.write_text(USE.format(rooms=", ".join(ROOMS), count=len(ROOMS)))
    samples = ROOT / "sample_runs"
    done = subprocess.run(
        [sys.executable, str(script), str(samples / "runs"), str(samples / "demo.toml")],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == str(comes_from / "bufferstand" / "__init__.py")
    found, cycles = map(int, lines[1].split())
    assert found == len(list((samples / "runs").glob("*.h5")))
    assert cycles > 50
    assert int(lines[2]) > 5
    assert lines[-1] == "status 0"
