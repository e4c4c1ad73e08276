"""The matrix of who meets whom in which phase, and the stands side by side that fill it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.two_programs.cells import MOVERS, Cell, Row, run_cell
from tests.two_programs.programs import Launcher, patiently

PHASES = ("together", "first look", "enable", "ramp", "sine", "hold", "release", "cool-down", "heat wait")
SECONDS = ("run", "resume", "zero", "jog", "check", "read")
KILLED_BEFORE_S = (0.0, 0.3, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 11.0, 12.0)
OTHERS = {"zero": "touch", "jog": "jog", "check": "reading", "read": "reading", "run --simulate": "simulated"}
SIDE_BY_SIDE = 4


def cells() -> list[Cell]:
    """Return all of them."""
    return [*_living(), *_of_other_firsts(), *_killed()]


def _living() -> list[Cell]:
    # A folder that is in use is refused before anything is asked: two phases of that will do.
    found = [
        Cell("run", phase, second)
        for phase in PHASES
        for second in SECONDS
        if second != "resume" or phase in ("hold", "cool-down")
    ]
    found += [Cell("run", phase, "run --simulate") for phase in ("hold", "cool-down")]
    found += [Cell("run", phase, "suite") for phase in ("hold", "cool-down")]
    found += [Cell("resume", phase, second) for phase in ("hold", "cool-down") for second in SECONDS]
    return found


def _of_other_firsts() -> list[Cell]:
    found = [
        Cell(first, phase, second)
        for first, phase in OTHERS.items()
        for second in SECONDS
        if second != "resume"
    ]
    found += [Cell("suite", "suite", second) for second in ("run", "zero", "check")]
    return found


def _killed() -> list[Cell]:
    found = [
        Cell("run", "hold", second, watchdog_s, after_s)
        for second in SECONDS
        for watchdog_s in (2.0, 10.0)
        for after_s in KILLED_BEFORE_S
        if second in MOVERS or after_s in (0.0, 1.0, 3.0, 8.0)
    ]
    phases = ("first look", "enable", "ramp", "sine", "release", "cool-down")
    found += [Cell("run", phase, second, 2.0, 0.3) for phase in phases for second in ("run", "resume")]
    found += [Cell(first, phase, "run", 2.0, 0.3) for first, phase in (("zero", "touch"), ("jog", "jog"))]
    found += [Cell("run", phase, "suite", 2.0, 0.3) for phase in ("hold",)]
    return found


def fill(
    wanted: Sequence[Cell],
    folder: Path,
    side_by_side: int = SIDE_BY_SIDE,
    told: Callable[[Row], None] = lambda _: None,
) -> list[Row]:
    """Run cells, several stands at a time; ``told`` hears of each row as it comes."""
    launcher = Launcher()
    try:
        with ThreadPoolExecutor(side_by_side) as pool:

            def one(number: int) -> Row:
                row = _row(wanted[number], folder / f"{number:03}", launcher)
                told(row)
                return row

            return list(pool.map(one, range(len(wanted))))
    finally:
        launcher.close()


def _row(cell: Cell, folder: Path, launcher: Launcher) -> Row:
    try:
        return patiently(lambda tried: run_cell(cell, tried, launcher), folder, lambda row: not row.wrong)
    except AssertionError as error:  # a hang of one cell is a row like any other
        return Row(cell, wrong=[str(error)])
