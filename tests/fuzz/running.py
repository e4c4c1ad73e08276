"""Gives inputs to a target, and tells each that ends in something else than a value or one line."""

from __future__ import annotations

import gc
import io
import logging
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType

from tests.fuzz.target import Altered, Case, Target

MOST_KB = 1_500_000
"""So much more than before is too much for an input: the process that reads it may hold a lot already."""
LONGEST_LINE = 2000
"""Characters of a message."""
WALL_RATIO = 30.0
"""Waiting for ever is a hang, too; waiting for busy cores is none."""


class Hung(BaseException):
    """An input takes too long; no reader catches this by chance."""


@dataclass(frozen=True)
class Failure:
    """An input that ended badly."""

    target: str
    seed: int
    number: int
    what: str
    content: bytes

    def __str__(self) -> str:
        """Return it with the command that repeats it."""
        again = f"python -m tests.fuzz {self.target} --seed {self.seed} --first {self.number} --inputs 1"
        return f"{self.target}: {self.what}\n  {again}"


@dataclass
class Told:
    """What is said beside the way an input ends: by destructors, threads, logs."""

    said: list[str] = field(default_factory=list)

    def take(self) -> str:
        """Return what was said since the last call."""
        said, self.said = self.said, []
        return "; ".join(said)


class _Log(logging.Handler):
    def __init__(self, told: Told) -> None:
        super().__init__(logging.ERROR)
        self._told = told

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info and record.exc_info[0] is not None:
            self._told.said.append(f"a traceback in the log: {record.exc_info[0].__name__}")


@contextmanager
def listening() -> Iterator[Told]:
    """Hear what destructors, threads and logs would show as tracebacks."""
    told = Told()
    hooks = sys.unraisablehook, threading.excepthook

    def unraisable(one: sys.UnraisableHookArgs) -> None:
        library = str(getattr(one.object, "__module__", "")).partition(".")[0]
        if library != "asammdf":  # bufferstand's own hook keeps these quiet
            told.said.append(f"a traceback of a destructor: {one.exc_value!r}")

    sys.unraisablehook = unraisable
    threading.excepthook = lambda one: told.said.append(f"a traceback of a thread: {one.exc_value!r}")
    log = _Log(told)
    logging.getLogger().addHandler(log)
    try:
        yield told
    finally:
        logging.getLogger().removeHandler(log)
        sys.unraisablehook, threading.excepthook = hooks


@contextmanager
def bounded(cpu_s: float) -> Iterator[None]:
    """Raise :class:`Hung` inside where it takes more processor time, or waits for ever."""

    def ring(number: int, frame: FrameType | None) -> None:
        del number, frame
        raise Hung

    before = {one: signal.signal(one, ring) for one in (signal.SIGPROF, signal.SIGALRM)}
    signal.setitimer(signal.ITIMER_PROF, cpu_s)
    signal.setitimer(signal.ITIMER_REAL, WALL_RATIO * cpu_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for one, handler in before.items():
            signal.signal(one, handler)


def input_of(target: Target, case: Case, seed: int, number: int) -> bytes:
    """Return an input: the same for the same target, seed and number."""
    pick = Random(f"{target.name} {seed} {number}")
    return case.mutate(pick.choice(case.corpus), pick)


def judged(target: Target, case: Case, content: bytes, told: Told) -> str:
    """Let a target read an input; return what is wrong with how it ended, empty where nothing is."""
    out = io.StringIO()
    before = _held_kB()
    wrong = ""
    try:
        with redirect_stdout(out), redirect_stderr(out), bounded(target.cpu_s):
            case.read(content)
    except target.well_ended as ended:
        wrong = _badly_said(str(ended))
    except Altered as altered:
        wrong = f"altered without a word: {altered}"
    except Hung:
        wrong = f"no end within {target.cpu_s:g} s"
    except Exception as error:  # noqa: BLE001 - what main would call a bug
        wrong = f"{type(error).__name__}: {str(error)[:200]} ({_place(error)})"
    if "Traceback" in out.getvalue():
        wrong = wrong or f"it printed a traceback: {out.getvalue()[-300:]}"
    if (took := _most_held_kB() - before) > MOST_KB:
        wrong = wrong or f"it took {took / 1e6:.1f} GB"
    return wrong or told.take()


def run(
    target: Target, case: Case, seed: int, numbers: range, seconds: float = float("inf")
) -> tuple[int, list[Failure]]:
    """Give a target many inputs; return how many it was given, and those that ended badly."""
    failures, until_s, done = [], time.monotonic() + seconds, 0
    with listening() as told, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in numbers:
            content = input_of(target, case, seed, number)
            if wrong := judged(target, case, content, told):
                failures.append(Failure(target.name, seed, number, wrong, content))
            done += 1
            if time.monotonic() > until_s:
                break
        gc.collect()  # what broken files left is destroyed here, not in another test
    return done, failures


def run_in(folder: Path, target: Target, seed: int, numbers: range) -> tuple[int, list[Failure]]:
    """Make a target ready in a folder, and run it."""
    with target.begin(folder) as case:
        return run(target, case, seed, numbers)


def _badly_said(text: str) -> str:
    """Return what is wrong with a message: it is one line, and one for each further finding."""
    first, *others = text.split("\n")
    if not first or any(not line.startswith("  ") for line in others):
        return f"its message is no line: {text[:200]!r}"
    if max(map(len, (first, *others))) > LONGEST_LINE:
        return f"its message has {len(text)} characters: {text[:200]!r}"
    return ""


def _held_kB() -> int:  # noqa: N802
    """Return the resident memory of this process, and let Linux forget what it was at most."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return _status_kB("VmRSS")


def _most_held_kB() -> int:  # noqa: N802
    """Return the most resident memory of this process since :func:`_held_kB`."""
    return _status_kB("VmHWM")


def _status_kB(name: str) -> int:  # noqa: N802
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return int(next(line for line in lines if line.startswith(f"{name}:")).split()[1])


def _place(error: Exception) -> str:
    """Return where it was raised, of bufferstand's own lines the innermost."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [one for one in frames if "site-packages" not in one.filename and "/tests/" not in one.filename]
    last = (ours or list(frames))[-1]
    return f"{'/'.join(Path(last.filename).parts[-3:])}:{last.lineno}"
