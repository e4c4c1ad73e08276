#!/usr/bin/env python3
"""Set bufferstand up in ``.venv`` beside this file and run it. Needs only Python 3.11+ with pip.

    python3 start.py demo          the main job on the simulated stand
    python3 start.py test [...]    every test (further words go to pytest); --fast: those of two minutes
    python3 start.py check         lint, types and the layering of the house
    python3 start.py run ARGS...   any other bufferstand command, e.g. run plan sample_runs/demo.toml
    python3 start.py setup         only set up, for all of these

The environment is made once and again whenever a lock file changes: for demo and run from
requirements-run.lock, for test, check and setup from requirements.lock, which adds the tools and the optional
extras. Both are hash-pinned.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path
from shlex import quote

ROOT = Path(__file__).resolve().parent
ENVIRONMENT = ROOT / ".venv"
STAMP = ENVIRONMENT / "bufferstand-stamp"
COMPILED = ENVIRONMENT / "compiled"
"""Where Python keeps what it has compiled: nothing in the tree, and each program starts in half the time."""
PYTHON = ENVIRONMENT / "bin" / "python"
OLDEST_PYTHON = (3, 11)
OLDEST_PIP = (22, 3)
LOCKS = {"run": "requirements-run.lock", "all": "requirements.lock"}
"""What is pinned for running only, and for everything: the first is a part of the second."""
TESTED = ("numpy", "scipy", "pandas", "matplotlib")
"""Packages that bring their own tests: a tenth of the environment, which nothing imports."""
CALLED = "BUFFERSTAND_CALLED"
"""Environment variable that tells the commands how to print a command that can be typed as it is shown."""
BUSY = "tests/main_job/test_busy_machine.py"
HANGS = ("-o", "faulthandler_timeout=600", "-o", "faulthandler_exit_on_timeout=true")
"""A test that takes ten minutes hangs: show where each of its threads is, and end it."""


def fingerprint() -> str:
    """Return what the environment depends on: locks, project file, interpreter and place."""
    digest = hashlib.sha256()
    for name in (*LOCKS.values(), "pyproject.toml"):
        digest.update((ROOT / name).read_bytes())
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
        return [uv, "pip", "install", "--python", str(PYTHON)]
    probe = subprocess.run(
        [sys.executable, "-m", "pip", "--version"], capture_output=True, text=True, check=False
    )
    if probe.returncode != 0:
        stop("this Python has no pip; install it (Debian, Ubuntu: apt install python3-pip) and try again")
    version = tuple(int(part) for part in probe.stdout.split()[1].split(".")[:2])
    if version < OLDEST_PIP:
        stop(f"pip {version[0]}.{version[1]} is too old, 22.3 is needed: python3 -m pip install -U pip")
    # Compiled when first imported: of all that comes down only a part ever is.
    return [sys.executable, "-m", "pip", "--python", str(PYTHON), "install", "--no-compile",
            "--progress-bar=off", "--disable-pip-version-check", "--no-warn-script-location"]  # fmt: skip


def install(command: list[str], *words: str) -> None:
    """Install, and show that it goes on: of pip each package; uv shows that itself, on standard error."""
    fetched = 0
    with subprocess.Popen([*command, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout or ():
            if line.startswith("Collecting "):
                fetched += 1
                show(f"{fetched}: {line.split()[1].partition('==')[0]}", passing=True)
            elif line.startswith("Installing collected") and fetched > 1:
                show(f"{fetched} packages fetched; putting them in place ...")
    if process.returncode != 0:
        stop("the installation failed; the lines above say why. Nothing else on this machine was changed")


def show(line: str, *, passing: bool = False) -> None:
    """Show a line of progress; on a terminal a passing one is written over, and elsewhere it is left out."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K  {line}", end="" if passing else "\n", file=sys.stderr, flush=True)
    elif not passing:
        print(f"  {line}", file=sys.stderr, flush=True)


def set_up(what: str = "all") -> None:
    """Make the environment unless it is already what the lock file says.

    ``what`` is ``run``, or ``all``: one made for running grows where all is asked.
    """
    wanted = fingerprint()
    made, _, of = STAMP.read_text().partition(" ") if PYTHON.exists() and STAMP.exists() else ("", "", "")
    if of == wanted and made in {"all", what}:
        return
    print(f"Setting up .venv from {LOCKS[what]} (once) ...", file=sys.stderr, flush=True)
    if of != wanted:
        # Without pip inside: Debian's Python has no ensurepip, and the pip outside can install into it.
        venv.EnvBuilder(with_pip=False, clear=True).create(ENVIRONMENT)
    command = installer()
    install(command, "--require-hashes", "-r", str(ROOT / LOCKS[what]))
    install(command, "--no-deps", "--no-build-isolation", "-e", str(ROOT))
    for package in TESTED:
        for folder in ENVIRONMENT.glob(f"lib/python*/site-packages/{package}/**/tests"):
            shutil.rmtree(folder, ignore_errors=True)
    STAMP.write_text(f"{what} {wanted}")


def bufferstand(*words: str) -> int:
    """Run the command; what it prints of further commands is to be typed as this one was."""
    return run("-m", "bufferstand", *words, **{CALLED: f"python3 {quote(sys.argv[0])} run"})


def run(*command: str, folder: Path | None = None, **variables: str) -> int:
    """Run Python of the environment and return its exit status; Ctrl-C is the command's to handle."""
    environment = {
        **os.environ,
        "PATH": f"{PYTHON.parent}{os.pathsep}{os.environ.get('PATH', '')}",
        "PYTHONPYCACHEPREFIX": str(COMPILED),
        **variables,
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
    set_up("run" if task in {"demo", "run"} else "all")
    if task == "demo":
        return bufferstand("demo", *rest)
    if task == "run":
        return bufferstand(*rest)
    if task == "test":
        return test(rest)
    return check() if task == "check" else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
