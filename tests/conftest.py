"""Options and settings of the whole test suite."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Any

# Before numpy is loaded: its threads wait for each other by spinning, and take the cores from what is tested.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# As in a shell in which the environment is active: programs then print further commands as ``bufferstand …``.
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
os.environ.pop("BUFFERSTAND_CALLED", None)

import matplotlib as mpl
import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

from tests.doses import beyond_their_doses
from tests.sharing import scope
from tests.slow import SLOW

mpl.use("Agg")

# In the background, or by nohup, they are ignored; the programs under test are to be ended by them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

for profile, examples in (("bufferstand", 25), ("long", 50)):
    settings.register_profile(
        profile,
        derandomize=True,
        deadline=None,  # no test depends on wall-clock speed
        max_examples=examples,
        suppress_health_check=[HealthCheck.too_slow],
    )
settings.load_profile("bufferstand")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="also run the long studies")
    parser.addoption("--fast", action="store_true", help="run what is not marked slow")
    parser.addoption("--slow", action="store_true", help="run what --fast leaves out")
    parser.addoption(
        "--hardware", metavar="STAND.toml", help="run the contracts on this real stand, and no other test"
    )
    parser.addoption("--yes-move", metavar="STAND", help="its id: confirm every motion of it beforehand")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--long"):
        settings.load_profile("long")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not even import files that are slow as wholes: that alone takes half of the fast lane's time."""
    place = collection_path.relative_to(ROOT).as_posix()
    if collection_path.is_dir():
        place += "/"
    return True if config.getoption("--fast") and place in SLOW else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker(pytest.mark.slow)
    if config.getoption("--fast") or config.getoption("--slow"):
        slow = [item for item in items if item.get_closest_marker("slow")]
        fast = [item for item in items if not item.get_closest_marker("slow")]
        items[:], others = (fast, slow) if config.getoption("--fast") else (slow, fast)
        config.hook.pytest_deselected(items=others)
    if config.getoption(
        "--hardware"
    ):  # its operator is to be asked at once, not after minutes of simulations
        others = [item for item in items if not item.get_closest_marker("hardware")]
        items[:] = [item for item in items if item.get_closest_marker("hardware")]
        config.hook.pytest_deselected(items=others)
    for item in beyond_their_doses(items):
        item.add_marker(pytest.mark.long)
    for mark, option in (("long", "--long"), ("hardware", "--hardware")):
        if not config.getoption(option):
            skip = pytest.mark.skip(reason=f"needs {option}")
            for item in items:
                if item.get_closest_marker(mark):
                    item.add_marker(skip)


ROOT = Path(__file__).resolve().parents[1]


class _TestByTest(LoadScopeScheduling):  # type: ignore[misc] - xdist states no types
    """Hand out test by test, but together those that share a fixture of their file."""

    def _split_scope(self, nodeid: str) -> str:
        return scope(nodeid)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> _TestByTest:
    """Put the scheduler above in the place of xdist's, whose groups pytest 9.1 no longer sees."""
    return _TestByTest(config, log)
