"""The start script: what it says when it cannot, and that a second run sets nothing up again."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from bufferstand.foundation.how_called import CALLED

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def start() -> ModuleType:
    spec = importlib.util.spec_from_file_location("start", ROOT / "start.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def call(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / "start.py"), *words], capture_output=True, text=True, check=False
    )


def test_without_a_word_it_explains_itself() -> None:
    done = call()
    assert done.returncode == 0
    assert "python3 start.py demo" in done.stdout
    assert "python3 start.py test" in done.stdout


def test_unknown_word_is_bad_usage() -> None:
    assert call("dmeo").returncode == 2


def test_it_needs_only_the_standard_library() -> None:
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(ROOT / "start.py")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_changed_lock_asks_for_a_new_environment(
    start: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (*start.LOCKS.values(), "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    monkeypatch.setattr(start, "ROOT", tmp_path)
    before = start.fingerprint()
    assert start.fingerprint() == before
    with (tmp_path / "requirements.lock").open("a") as lock:
        lock.write("# changed\n")
    assert start.fingerprint() != before


@pytest.mark.parametrize(("made", "asked"), [("all", "all"), ("all", "run"), ("run", "run")])
def test_set_up_environment_is_left_alone(
    start: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: str, asked: str
) -> None:
    monkeypatch.setattr(start, "PYTHON", Path(sys.executable))
    monkeypatch.setattr(start, "STAMP", tmp_path / "stamp")
    monkeypatch.setattr(start, "installer", lambda: pytest.fail("it would install again"))
    (tmp_path / "stamp").write_text(f"{made} {start.fingerprint()}")
    start.set_up(asked)


def test_one_made_for_running_grows_and_is_not_made_anew(
    start: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed: list[tuple[str, ...]] = []
    monkeypatch.setattr(start, "installer", lambda: ["pip"])
    monkeypatch.setattr(start, "PYTHON", Path(sys.executable))
    monkeypatch.setattr(start, "ENVIRONMENT", tmp_path)
    monkeypatch.setattr(start, "STAMP", tmp_path / "stamp")
    monkeypatch.setattr(start, "install", lambda _, *words: installed.append(words))
    monkeypatch.setattr(start.venv, "EnvBuilder", lambda **_: pytest.fail("it would be made anew"))
    (tmp_path / "stamp").write_text(f"run {start.fingerprint()}")
    start.set_up("all")
    assert [words[-1] for words in installed] == [str(ROOT / "requirements.lock"), str(ROOT)]
    assert (tmp_path / "stamp").read_text() == f"all {start.fingerprint()}"


@pytest.mark.parametrize(
    ("task", "asked"), [("demo", "run"), ("run", "run"), ("test", "all"), ("setup", "all")]
)
def test_running_needs_the_small_environment_only(
    start: ModuleType, monkeypatch: pytest.MonkeyPatch, task: str, asked: str
) -> None:
    needed: list[str] = []
    monkeypatch.setattr(start, "set_up", needed.append)
    monkeypatch.setattr(start, "run", lambda *_, **__: 0)
    assert start.main([task]) == 0
    assert needed == [asked]


def test_what_runs_is_told_how_it_was_called(start: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, str] = {}

    def run(*command: str, **variables: str) -> int:
        told.update(variables)
        return len(command)

    monkeypatch.setattr(start, "run", run)
    monkeypatch.setattr(start.sys, "argv", ["a b/start.py", "demo"])
    assert start.bufferstand("demo") == 3
    assert told == {CALLED: "python3 'a b/start.py' run"}


@pytest.mark.parametrize("status", [0, 1])
def test_what_pip_fetches_is_shown_and_a_failure_told(
    start: ModuleType, capsys: pytest.CaptureFixture[str], status: int
) -> None:
    said = "Collecting click==8 (from x)\\nCollecting numpy==2\\nInstalling collected packages: click"
    pip = [sys.executable, "-c", f"print('{said}'); raise SystemExit({status})"]
    if status:
        with pytest.raises(SystemExit):
            start.install(pip, "-r", "some.lock")
    else:
        start.install(pip, "-r", "some.lock")
    shown = capsys.readouterr().err
    assert "2 packages fetched; putting them in place" in shown
    assert ("the installation failed" in shown) is bool(status)


def test_what_is_compiled_is_kept_in_the_environment_and_not_in_the_tree(
    start: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(start, "PYTHON", Path(sys.executable))
    monkeypatch.setattr(start, "COMPILED", tmp_path / "compiled")
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    (tmp_path / "tree").mkdir()
    (tmp_path / "tree" / "some_room.py").write_text("")
    code = f"import sys; sys.path.insert(0, {str(tmp_path / 'tree')!r}); import some_room"
    assert start.run("-c", code) == 0
    assert [path.name for path in (tmp_path / "tree").iterdir()] == ["some_room.py"]
    assert len(list((tmp_path / "compiled").rglob("some_room.*.pyc"))) == 1


@pytest.mark.parametrize(
    ("answer", "status", "words"),
    [("", 1, "has no pip"), ("pip 21.0.1 from somewhere", 0, "too old")],
)
def test_missing_or_old_pip_is_said_in_one_line(
    start: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    answer: str,
    status: int,
    words: str,
) -> None:
    monkeypatch.setattr(start.shutil, "which", lambda _: None)
    monkeypatch.setattr(
        start.subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], status, stdout=answer)
    )
    with pytest.raises(SystemExit) as caught:
        start.installer()
    assert caught.value.code == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


@pytest.mark.long
def test_clean_clone_in_a_path_with_a_space_sets_up_and_answers(tmp_path: Path) -> None:
    clone = tmp_path / "a b" / "bufferstand"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
    done = subprocess.run(
        [sys.executable, str(clone / "start.py"), "run", "--version"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("bufferstand, version")


@pytest.mark.parametrize(
    ("words", "parts"),
    [([], 2), (["--fast"], 1), (["--slow", "--cov"], 2), (["--long"], 2), (["tests/model", "-k", "heat"], 1)],
)
def test_lanes(start: ModuleType, monkeypatch: pytest.MonkeyPatch, words: list[str], parts: int) -> None:
    ran: list[tuple[str, ...]] = []

    def run(*command: str, folder: Path) -> int:
        ran.append(command)
        return 0

    monkeypatch.setattr(start, "run", run)
    assert start.test(words) == 0
    assert len(ran) == parts
    assert all(word in command for word in words for command in ran)
    side_by_side = ["-n" in command for command in ran]
    assert side_by_side == ([False] if "-k" in words else [True, False][:parts])
