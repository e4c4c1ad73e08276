"""Starts programs that are warm: ``python -m tests.two_programs.launcher``.

It loads what the commands need once, and forks for each of them: processes of their own as from a shell, that
do not spend two seconds on loading, so that the second program comes when it is meant to. Each line of its
standard input is a JSON list: file for its output, module, words. It answers ``began PID`` and later
``ended PID STATUS``. When its standard input ends, so do its children.
"""

from __future__ import annotations

import importlib
import json
import os
import pkgutil
import runpy
import select
import signal
import sys
import warnings

ROOMS = ("cli", "daq", "drivers", "protocols", "recording", "model", "foundation")
LOOK_S = 0.02


def main() -> None:
    # The rooms are walked, not named one by one: what they hold inside is none of this test's business.
    for room in ROOMS:
        package = importlib.import_module(f"bufferstand.{room}")
        found = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        for module in (module.name for module in found):
            if not module.endswith("__main__"):
                importlib.import_module(module)
    importlib.import_module("pytest")
    job = _serve()
    if job is not None:
        _become(*job)


def _serve() -> tuple[str, list[str]] | None:
    """Fork for each line; return, in the child, what it is to be, and None in the end."""
    alive: set[int] = set()
    rest = b""
    print("ready", flush=True)
    while True:
        if select.select([0], [], [], LOOK_S)[0]:
            came = os.read(0, 65536)
            if not came:
                break
            *lines, rest = (rest + came).split(b"\n")
            for line in lines:
                log, module, words = json.loads(line)
                pid = os.fork()
                if pid == 0:
                    _redirect(log)
                    return module, words
                alive.add(pid)
                print("began", pid, flush=True)
        _reap(alive)
    for pid in alive:
        os.kill(pid, signal.SIGKILL)
    return None


def _reap(alive: set[int]) -> None:
    for pid in list(alive):
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            alive.discard(pid)
            print("ended", pid, os.waitstatus_to_exitcode(status), flush=True)


def _redirect(log: str) -> None:
    """Leave the launcher's terminal, input and output; a child of a child must not hold them open either."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDONLY)
    said = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    for handle, place in ((nothing, 0), (said, 1), (said, 2)):
        os.dup2(handle, place)
    os.close(nothing)
    os.close(said)


def _become(module: str, words: list[str]) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = [module, *words]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
