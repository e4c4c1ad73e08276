"""Commands that are printed can be typed as printed, however the program was installed."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from bufferstand.foundation import how_to_add, program
from bufferstand.foundation.how_called import CALLED

SCRIPT = Path(sys.executable).parent / "bufferstand"


@pytest.fixture(autouse=True)
def nobody_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(CALLED, raising=False)


def test_a_launcher_says_how_it_was_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CALLED, "python3 start.py run")
    assert program() == "python3 start.py run"


def test_the_command_itself_where_the_shell_finds_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(SCRIPT.parent))
    assert program() == "bufferstand"


def test_another_command_of_that_name_is_not_taken_for_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    other = tmp_path / "bufferstand"
    other.write_text("#!/bin/sh\nexit 1\n")
    other.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert program() == shlex.quote(str(SCRIPT))


@pytest.mark.parametrize("folder", ["bin", "a b"])
def test_what_is_printed_is_found_by_the_shell(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folder: str
) -> None:
    """Also from a path with a space, and shown from the present folder where it lies below it."""
    (tmp_path / folder).mkdir()
    python, script = tmp_path / folder / "python", tmp_path / folder / "bufferstand"
    script.write_text('#!/bin/sh\necho "called $1"\n')
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    monkeypatch.setenv("PATH", "")
    monkeypatch.chdir(tmp_path)
    assert program() == shlex.quote(f"{folder}/bufferstand")
    done = subprocess.run(
        ["/bin/sh", "-c", f"{program()} runs"], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout == "called runs\n"


def test_without_the_script_this_python_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert program() == f"{tmp_path}/python -m bufferstand"


def test_an_extra_is_added_as_the_environment_was_made(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path / ".venv"))
    assert how_to_add("xarray") == f"{shlex.quote(sys.executable)} -m pip install 'bufferstand[xarray]'"
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bufferstand-stamp").write_text("run")
    monkeypatch.chdir(tmp_path)
    assert how_to_add("xarray") == "python3 start.py setup"
