"""Two programs at one stand, real processes and wires, watched by a client that shares no code with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from tests.two_programs import scenarios
from tests.two_programs.cells import Cell, run_cell
from tests.two_programs.programs import Launcher, patiently

Meeting = Callable[[Path, Launcher], list[str]]


def cell(chosen: Cell) -> Meeting:
    """Return the meeting of a cell of the matrix."""
    return lambda folder, launcher: run_cell(chosen, folder, launcher).wrong


ALWAYS: dict[str, Meeting] = {
    "refused under load, then resumed after a kill": scenarios.refused_then_resumed,
    "a second run while the first cools down": partial(scenarios.killed_while_another_waits, hot=False),
    "stopped by its guard, force left": partial(scenarios.ended_under_load, why="following error"),
}
SELDOM: dict[str, Meeting] = {
    "killed while another waits": scenarios.killed_while_another_waits,
    "killed while another waits, watchdog 10 s": partial(
        scenarios.killed_while_another_waits, watchdog_s=10.0
    ),
    "resume right after a kill, watchdog 10 s": cell(Cell("run", "hold", "resume", 10.0, 0.3)),
    "resume tried again and again": scenarios.retried_and_waiting,
    "resume tried again and again, watchdog 10 s": partial(scenarios.retried_and_waiting, watchdog_s=10.0),
    "zero while a campaign waits to cool": cell(Cell("run", "cool-down", "zero")),
    "a rehearsal gone on with": scenarios.simulated_then_resumed,
    "asleep while another runs": scenarios.asleep_while_another_runs,
    "five at once": scenarios.crowd,
    "asked for consent while another runs": scenarios.asked_while_another_runs,
    "a real campaign gone on with as a rehearsal": scenarios.real_then_simulated,
    "stopped by the operator, force left": partial(scenarios.ended_under_load, why="operator"),
}


def _met(meeting: Meeting, launcher: Launcher, folder: Path) -> list[str]:
    return meeting(folder, launcher)


def _nothing(wrong: list[str]) -> bool:
    return not wrong


@pytest.fixture(scope="module")
def met(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Future[list[str]]]]:
    """Begin the meetings that were asked for side by side: most of their time is waiting for watchdogs."""
    here = [item for item in request.session.items if item.path == Path(__file__)]
    asked = {item.callspec.params["name"] for item in here if isinstance(item, pytest.Function)}
    known = {**ALWAYS, **(SELDOM if request.config.getoption("--long") else {})}
    wanted = {name: meeting for name, meeting in known.items() if name in asked}
    launcher, folder = Launcher(), tmp_path_factory.mktemp("meetings")
    with ThreadPoolExecutor(4) as pool:
        yield {
            name: pool.submit(patiently, partial(_met, meeting, launcher), folder / str(number), _nothing)
            for number, (name, meeting) in enumerate(wanted.items())
        }
    launcher.close()


@pytest.mark.parametrize("name", ALWAYS)
def test_nothing_is_touched_that_is_not_ours(met: dict[str, Future[list[str]]], name: str) -> None:
    assert not "\n".join(met[name].result())


@pytest.mark.long
@pytest.mark.parametrize("name", SELDOM)
def test_so_it_is_with_longer_watchdogs_and_less_patience(
    met: dict[str, Future[list[str]]], name: str
) -> None:
    assert not "\n".join(met[name].result())
