#!/usr/bin/env python3
"""Set bufferstand up in ``.venv`` beside this file and run it. Needs only Python 3.11+ with pip.

    python3 start.py demo          the main job on the simulated stand
    python3 start.py test [...]    every test (further words go to pytest); --fast: those of two minutes
    python3 start.py check         lint, types and the layering of the house
    python3 start.py run ARGS...   any other bufferstand command, e.g. run plan sample_runs/demo.toml
    python3 start.py setup         only set up

The environment is made once from the hash-pinned requirements.lock and again whenever that file changes.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent
ENVIRONMENT = ROOT / ".venv"
STAMP = ENVIRONMENT / "bufferstand-stamp"
COMPILED = ENVIRONMENT / "compiled"
"""Where Python keeps what it has compiled: nothing in the tree, and each program starts in half the time."""
PYTHON = ENVIRONMENT / "bin" / "python"
OLDEST_PYTHON = (3, 11)
OLDEST_PIP = (22, 3)
BUSY = "tests/main_job/test_busy_machine.py"
HANGS = ("-o", "faulthandler_timeout=600", "-o", "faulthandler_exit_on_timeout=true")
"""A test that takes ten minutes hangs: show where each of its threads is, and end it."""


def fingerprint() -> str:
    """Return what the environment depends on: lock, project file, interpreter and place."""
    digest = hashlib.sha256()
    for part in (ROOT / "requirements.lock", ROOT / "pyproject.toml"):
        digest.update(part.read_bytes())
    digest.update(f"{sys.version_info[:3]} {ROOT}".encode())
    return digest.hexdigest()


def stop(message: str) -> None:
    """Say in one line why nothing can be set up, and end with exit status 2."""
    print(f"start.py: {message}", file=sys.stderr)
    raise SystemExit(2)


def installer() -> list[str]:
    """Return the command that installs into the environment: uv where there is one, else pip from outside."""
    uv = shutil.which("uv")
    if uv:
        return [uv, "pip", "install", "--quiet", "--python", str(PYTHON)]
    probe = subprocess.run(
        [sys.executable, "-m", "pip", "--version"], capture_output=True, text=True, check=False
    )
    if probe.returncode != 0:
        stop("this Python has no pip; install it (Debian, Ubuntu: apt install python3-pip) and try again")
    version = tuple(int(part) for part in probe.stdout.split()[1].split(".")[:2])
    if version < OLDEST_PIP:
        stop(f"pip {version[0]}.{version[1]} is too old, 22.3 is needed: python3 -m pip install -U pip")
    # Compiled when first imported: of all that comes down only a part ever is.
    return [sys.executable, "-m", "pip", "--python", str(PYTHON), "install", "--quiet", "--no-compile",
            "--disable-pip-version-check", "--no-warn-script-location"]  # fmt: skip


def set_up() -> None:
    """Make the environment unless it is already what the lock file says."""
    wanted = fingerprint()
    if PYTHON.exists() and STAMP.exists() and STAMP.read_text() == wanted:
        return
    print("Setting up .venv from requirements.lock (once; a minute or so) ...", file=sys.stderr, flush=True)
    # Without pip inside: Debian's Python has no ensurepip, and the pip outside can install into it.
    venv.EnvBuilder(with_pip=False, clear=True).create(ENVIRONMENT)
    install = installer()
    for step in (
        ["--require-hashes", "-r", str(ROOT / "requirements.lock")],
        ["--no-deps", "--no-build-isolation", "-e", str(ROOT)],
    ):
        if subprocess.run([*install, *step], cwd=ROOT, check=False).returncode != 0:
            stop("the installation failed; the lines above say why. Nothing else on this machine was changed")
    STAMP.write_text(wanted)


def run(*command: str, folder: Path | None = None) -> int:
    """Run Python of the environment and return its exit status; Ctrl-C is the command's to handle."""
    environment = {
        **os.environ,
        "PATH": f"{PYTHON.parent}{os.pathsep}{os.environ.get('PATH', '')}",
        "PYTHONPYCACHEPREFIX": str(COMPILED),
    }
    # Containers set it to keep their trees clean; here every program would compile the whole house anew.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    # -P: nothing in the folder where the user stands can shadow the project's packages
    process = subprocess.Popen([str(PYTHON), "-P", *command], cwd=folder, env=environment)
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            continue  # the terminal has sent it to the command too, which ends the stand safely first


def check() -> int:
    """Run lint, format, types and layering; return the first status that is not 0."""
    lint_imports = "from importlinter.cli import lint_imports_command as lint; lint()"
    for title, command in (
        ("ruff check", ("-m", "ruff", "check", ".")),
        ("ruff format --check", ("-m", "ruff", "format", "--check", ".")),
        ("mypy", ("-m", "mypy")),
        ("layering (import-linter)", ("-c", lint_imports)),
    ):
        print(f"== {title}", flush=True)
        status = run(*command, folder=ROOT)
        if status != 0:
            return status
    return 0


def test(arguments: list[str]) -> int:
    """Run every test, the fast, the slow or the told ones; return the first status that is not 0.

    One more at a time than there are processors, since those on real wires wait more than they reckon; a file
    of the main job (its tests share a campaign) on one worker; then, alone, those that keep it busy.
    """
    lanes = {"--fast", "--slow", "--long"}
    if any(argument not in lanes and not argument.startswith("--cov") for argument in arguments):
        return run("-m", "pytest", *arguments, folder=ROOT)
    workers = str(min(4, os.cpu_count() or 1) + 1)
    timed = [*arguments, "--durations=25"]  # a suite grows slow test by test: show which
    if "--long" not in arguments:
        timed += HANGS
    # Behind a worker that died and was replaced, a run that hands out by groups never ends.
    parts = [["-n", workers, "--max-worker-restart=0", f"--ignore={BUSY}"]]
    if "--fast" not in arguments:
        parts.append([BUSY])
    status = 0
    for part in parts:
        status = status or run("-m", "pytest", *timed, *part, folder=ROOT)
    return status


def main(arguments: list[str]) -> int:
    """Do what the first word says; return the exit status."""
    if sys.version_info < OLDEST_PYTHON:
        stop(f"Python 3.11 or newer is needed, this is {sys.version.split()[0]}")
    task, rest = (arguments[0], arguments[1:]) if arguments else ("", [])
    if task not in {"demo", "test", "check", "run", "setup"}:
        print(__doc__)
        return 0 if task in {"", "-h", "--help"} else 2
    set_up()
    if task == "demo":
        return run("-m", "bufferstand", "demo", *rest)
    if task == "test":
        return test(rest)
    if task == "check":
        return check()
    if task == "run":
        return run("-m", "bufferstand", *rest)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
