"""Run tests of a session that is collected already, in a process that ends afterwards."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import Phase, settings


class NoShrinking:
    """A plugin: what hypothesis finds is enough, the smallest example of it is not looked for."""

    @staticmethod
    def pytest_sessionstart() -> None:
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile("mutants", settings.get_profile("bufferstand"), phases=phases)
        settings.load_profile("mutants")


def use_folder(config: pytest.Config) -> None:
    """Have temporary folders of tests made in this process's own."""
    factory: Any = config._tmp_path_factory  # type: ignore[attr-defined]
    factory._basetemp = Path(os.environ["TMPDIR"]) / "tests"
    factory._basetemp.mkdir()


def first_failed(items: Sequence[pytest.Item], limits_s: Mapping[str, float]) -> str:
    """Run tests in turn until one fails; return its name, empty where all passed.

    Parameters
    ----------
    limits_s : mapping of str to float
        Processor time that each may take, by its name [s]: one that takes more ends this process by SIGPROF.
    """
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    for item, after in zip(items, [*items[1:], None], strict=True):
        signal.setitimer(signal.ITIMER_PROF, limits_s[item.nodeid])
        if any(report.failed for report in runtestprotocol(item, nextitem=after, log=False)):
            return item.nodeid
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    return ""


def what_each_runs(items: Sequence[pytest.Item], file: str) -> bytes:
    """Run tests; return which lines of a file each runs, how long it takes and how it ends, as JSON."""
    lines: set[int] = set()

    def local(frame: FrameType, event: str, argument: object) -> Any:
        lines.add(frame.f_lineno)
        return local

    def called(frame: FrameType, event: str, argument: object) -> Any:
        if frame.f_code.co_filename != file:
            return None
        lines.add(frame.f_lineno)
        return local

    found = {}
    for item, after in zip(items, [*items[1:], None], strict=True):
        lines.clear()
        began_s = time.process_time(), time.monotonic()
        threading.settrace(called)
        sys.settrace(called)
        try:
            reports = runtestprotocol(item, nextitem=after, log=False)
        finally:
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type] - undoes it
        ended = (
            "failed"
            if any(report.failed for report in reports)
            else "skipped"
            if any(report.skipped for report in reports)
            else "passed"
        )
        found[item.nodeid] = {
            "lines": sorted(lines),
            "cpu_s": time.process_time() - began_s[0],
            "wall_s": time.monotonic() - began_s[1],
            "ended": ended,
        }
    return json.dumps(found).encode()
