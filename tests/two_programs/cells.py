"""One cell of the matrix: a first program is brought into a phase, a second one comes, both are seen off."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from tests.two_programs import registers
from tests.two_programs.bench import (
    AIR_C,
    COOL_DOWN,
    HEATING,
    HOLD,
    NEARLY_HOT_C,
    SINE,
    SPECIMEN_ID,
    STAND_ID,
    TIMEOUT_S,
    WAITS_WHEN_HOT,
    Bench,
    bench,
)
from tests.two_programs.programs import ROOT, Launcher, Program
from tests.two_programs.rules import COMPLETE, FAULT, STOPPED, commands_of, complaints, look_at, stated_s
from tests.two_programs.witness import Look, ZERO_FORCE_kN

LOADED_kN = 50.0
TOUCHED_kN = 5.0
PHASE_PATIENCE_S = 90.0
SETTLED_S = 1.5
"""So long after its last motion a campaign that waits has done what it does about its valve."""
SEEN_S = 0.2
"""The witness looks some times more."""
WAITS = ("cool-down", "heat wait")
MOVERS = ("run", "resume", "zero", "jog")
SUITE = "tests/contract/controller"


@dataclass(frozen=True)
class Cell:
    """Who meets whom, when."""

    first: str
    phase: str
    second: str
    watchdog_s: float = 2.0
    kill_after_s: float | None = None
    """The first is killed in that phase, and the second comes so long after it [s]; None: the first lives."""

    def __str__(self) -> str:
        when = (
            self.phase
            if self.kill_after_s is None
            else f"killed in {self.phase} {self.kill_after_s:g} s before"
        )
        return f"{self.first}, {when}, watchdog {self.watchdog_s:g} s: {self.second}"


@dataclass
class Row:
    """What became of it."""

    cell: Cell
    met: str = ""
    """What the witness saw when the second one asked its first."""
    came_s: float | None = None
    """From the kill, or the begin of the phase, to that [s]."""
    safe_s: float | None = None
    """From the kill, or the last program's end, to no force and valve off [s]; 0: before it."""
    stated_s: float | None = None
    writes: int = 0
    """Commands of the second that the controller took."""
    first_status: int | None = None
    second_status: int | None = None
    first_line: str = ""
    second_line: str = ""
    wrong: list[str] = field(default_factory=list)


def run_cell(cell: Cell, folder: Path, launcher: Launcher) -> Row:
    """Have two programs meet; return the row."""
    row = Row(cell)
    temperature_C = NEARLY_HOT_C if cell.phase == "heat wait" else AIR_C
    with bench(folder, launcher, cell.watchdog_s, temperature_C) as stand:
        second = Second(stand, cell)
        first, began_s = _bring_into(stand, cell, second)
        if began_s is None:
            row.wrong.append(f"the first never came into {cell.phase}: {first.status}, {first.last_line}")
            return row
        if cell.phase in WAITS:
            row.wrong += valve_while_waiting(stand)
        if cell.kill_after_s is not None:
            at_kill = stand.witness.now
            began_s = first.kill()
            first.wait()
            time.sleep(cell.kill_after_s)
        if second.program is None:
            second.start()
        assert second.program is not None
        _see_off(stand, cell, second.program)
        if cell.kill_after_s is None:
            _end(stand, cell, first)
        else:
            bound = stated_s(stand, at_kill.values["position_mm"], _watchdog_of(cell))
            stand.witness.wait_for(lambda look: look.safe, bound)
            row.stated_s = bound
        _fill(row, stand, first, second.program, began_s)
        if cell.kill_after_s is not None:
            row.wrong += _after_kill(stand, row, second.program, began_s)
        row.wrong += complaints(stand) + _statuses(stand, cell, first, second.program)
    return row


class Second:
    """The second program, with the files that it needs laid out beforehand."""

    def __init__(self, stand: Bench, cell: Cell) -> None:
        self._stand, self._name = stand, cell.second
        self._mine = stand.campaign("second", HOLD.format(stroke=25.0, duration=0.5))
        self._first = stand.folder / "first.toml"
        self.program: Program | None = None

    def start(self) -> None:
        self.program = start(self._stand, self._name, self._first if self._name == "resume" else self._mine)


def start(stand: Bench, name: str, campaign: Path) -> Program:
    """Start a command by its name in the matrix; the campaign is for those that have one."""
    if name == "run":
        return stand.run(campaign)
    if name == "resume":
        return stand.resume(campaign)
    words: dict[str, tuple[str | Path, ...]] = {
        "run --simulate": ("run", campaign, "--out", stand.out(campaign), "--simulate"),
        "check": ("check", stand.stand, "--watch", "2"),
        "read": ("stand", "read", stand.stand, "--for", "3"),
        "zero": ("stand", "zero", stand.stand, "--specimen", SPECIMEN_ID, "--yes-move", STAND_ID),
        "jog": ("stand", "jog", stand.stand, "--by", "1", "--for", "3", "--yes-move", STAND_ID),
    }
    if name in words:
        return stand.start(name, *words[name])
    assert name == "suite"
    more = ("-q", "-x", "-p", "no:cacheprovider", "--rootdir", ROOT)
    hardware = (ROOT / SUITE, "--hardware", stand.stand, "--yes-move", STAND_ID)
    return stand.start(name, *more, *hardware, module="pytest")


def _first_campaign(stand: Bench, cell: Cell) -> Path:
    # The suite takes some seconds until it asks the controller.
    hold = HOLD.format(stroke=30.0, duration=30.0 if cell.second == "suite" else 3.0)
    if cell.phase == "heat wait":
        return stand.campaign("first", HEATING, limits=WAITS_WHEN_HOT)
    steps = {
        "cool-down": (HOLD.format(stroke=5.0, duration=0.1), COOL_DOWN),
        "sine": (SINE.format(cycles=5),),
    }
    # Slow where the second one is to come amid a ramp or a release.
    speed_mm_per_s = 10.0 if cell.phase in ("ramp", "release") else 20.0
    return stand.campaign("first", *steps.get(cell.phase, (hold,)), speed_mm_per_s=speed_mm_per_s)


def _bring_into(stand: Bench, cell: Cell, second: Second) -> tuple[Program, float | None]:
    """Start the first one; return it and when the phase began; None where it never did."""
    campaign = _first_campaign(stand, cell)
    if cell.first == "resume":
        _stop_at_once(stand, campaign)
    first = start(stand, cell.first, campaign)
    if cell.phase == "together":
        second.start()
        return first, time.monotonic()
    shown: dict[str, Callable[[Look], bool]] = {
        "first look": lambda _: stand.tap.first(first.pid) is not None,
        "enable": lambda _: (
            stand.tap.first(first.pid, lambda one: one.value("control_word") is not None) is not None
        ),
        "ramp": lambda look: look.state == registers.RAMPING and look.force_kN > LOADED_kN / 2,
        "sine": lambda look: look.state == registers.WAVEFORM and look.force_kN > LOADED_kN,
        "hold": lambda look: look.state == registers.HOLDING and look.force_kN > LOADED_kN,
        "release": lambda look: look.state == registers.RELEASING and look.force_kN > LOADED_kN / 2,
        "cool-down": lambda look: waits_to_cool(first, look),
        "heat wait": lambda look: waits_to_cool(first, look),
        "touch": lambda look: look.valve_on and look.force_kN > 0.3,
        "jog": lambda look: look.valve_on and look.force_kN > TOUCHED_kN,
        "reading": lambda _: len(stand.tap.by(first.pid)) > 60,
        "simulated": lambda _: time.monotonic() > first.started_s + 4.0,
        "suite": lambda look: look.valve_on and look.force_kN > TOUCHED_kN,
    }
    seen = stand.witness.wait_for(shown[cell.phase], PHASE_PATIENCE_S, lambda: first.alive)
    if cell.phase in WAITS:
        time.sleep(SETTLED_S)
    return first, None if seen is None else time.monotonic()


def _stop_at_once(stand: Bench, campaign: Path) -> None:
    """Have a campaign stopped under its first load, so that there is something to resume."""
    begun = stand.run(campaign)
    stand.witness.wait_for(lambda look: look.force_kN > LOADED_kN / 2, PHASE_PATIENCE_S, lambda: begun.alive)
    begun.send(signal.SIGINT)
    begun.wait()


def waits_to_cool(program: Program, look: Look) -> bool:
    """Say whether a campaign waits for its specimen to cool: it says so, and the force is gone."""
    says = any(words in program.said for words in ("cool down to", "waiting at zero force"))
    return says and abs(look.force_kN) < ZERO_FORCE_kN


def valve_while_waiting(stand: Bench) -> list[str]:
    """Return what is wrong where a campaign that waits has left its valve on."""
    now = stand.witness.now
    return [f"the first waits with its valve on: {now}"] if now.valve_on else []


def _waits_again(cell: Cell) -> bool:
    """Say whether the second goes on with a campaign that waits: somebody has to stop it, too."""
    return cell.kill_after_s is not None and cell.phase in WAITS and cell.second == "resume"


def _see_off(stand: Bench, cell: Cell, second: Program) -> None:
    if _waits_again(cell):
        cools = partial(waits_to_cool, second)
        stand.witness.wait_for(cools, PHASE_PATIENCE_S, lambda: second.alive)
        second.send(signal.SIGINT)
    second.wait()


def _end(stand: Bench, cell: Cell, first: Program) -> None:
    """See the first one to its own end; one that waits is stopped as by Ctrl-C."""
    if cell.phase in WAITS or cell.first == "suite":
        time.sleep(1.0)
        first.send(signal.SIGINT)
    first.wait()
    time.sleep(SEEN_S)
    stand.witness.wait_for(lambda look: look.safe, 3.0)


def _watchdog_of(cell: Cell) -> float:
    """By hand the watchdog is 1 s, or twice the time of a reply if that is more (docs/how-to/zero.md)."""
    return (
        min(cell.watchdog_s, max(1.0, 2.0 * TIMEOUT_S)) if cell.first in ("zero", "jog") else cell.watchdog_s
    )


def _fill(row: Row, stand: Bench, first: Program, second: Program, began_s: float) -> None:
    asked = stand.tap.first(second.pid)
    if asked is not None:
        row.met, row.came_s = str(look_at(stand, asked.time_s)), asked.time_s - began_s
    row.writes = len(commands_of(stand, second))
    row.first_status, row.second_status = first.status, second.status
    row.first_line, row.second_line = first.last_line, second.last_line
    if row.cell.kill_after_s is not None:
        safe_s = stand.witness.safe_since(began_s)
        row.safe_s = None if safe_s is None else safe_s - began_s
    else:
        ended = max(one.ended_s or 0.0 for one in (first, second))
        unsafe = [look.time_s for look in stand.witness.looks() if not look.safe]
        row.safe_s = max(0.0, unsafe[-1] - ended if unsafe else 0.0) if stand.witness.now.safe else None


def _after_kill(stand: Bench, row: Row, second: Program, kill_s: float) -> list[str]:
    """What a kill leaves ends by the controller alone, in its time, and nobody writes before."""
    assert row.stated_s is not None
    if row.safe_s is None or row.safe_s > row.stated_s:
        return [f"after the kill not safe within {row.stated_s:.1f} s: {row.safe_s}"]
    early = [one for one in commands_of(stand, second) if one.time_s < kill_s + row.safe_s]
    return [f"{second.label} wrote before the controller had ended it: {early[0]}"] if early else []


def _statuses(stand: Bench, cell: Cell, first: Program, second: Program) -> list[str]:
    """Hold both exit statuses against what the meeting allows."""
    wrong = []
    allowed = _allowed(cell)
    if second.status not in allowed:
        wrong.append(f"the second ended with {second.status}, not one of {allowed}: {second.last_line}")
    if cell.kill_after_s is not None:
        return wrong
    race = cell.phase in ("together", "first look", "enable") and cell.second in MOVERS
    fine = {STOPPED} if cell.phase in WAITS else {COMPLETE}
    if cell.first == "suite":
        fine = {2}  # pytest's own for Ctrl-C
    if race and second.status == COMPLETE:
        fine = {COMPLETE, FAULT}
    if race and first.status == FAULT and second.status == FAULT:
        wrong.append("both were refused")
    if first.status not in fine:
        wrong.append(f"the first ended with {first.status}, not one of {fine}: {first.last_line}")
    refused = second.status == FAULT and cell.second in MOVERS and not race and cell.first in MOVERS
    if refused and str(first.pid) not in second.said:
        wrong.append(f"the second was not told the first's process: {second.last_line}")
    if cell.second == "run --simulate" and stand.tap.by(second.pid):
        wrong.append("a simulated campaign asked the real controller")
    return wrong


def _allowed(cell: Cell) -> set[int]:
    lives = cell.kill_after_s is None
    if cell.second == "suite":  # pytest's own: 1, some test failed
        return {1} if lives else {0, 1}
    if cell.second not in MOVERS:
        # `check` has a finding where the controller's fault is latched; `read` has nothing to find.
        return {COMPLETE} if lives or cell.second == "run --simulate" else {COMPLETE, FAULT}
    if cell.second == "resume":  # a folder that is in use is bad input
        return {2, FAULT} if lives else {STOPPED if _waits_again(cell) else COMPLETE}
    if cell.first not in (*MOVERS, "suite"):
        return {COMPLETE}
    may_be_first = not lives or cell.phase in ("together", "first look", "enable", *WAITS)
    return {COMPLETE, FAULT} if may_be_first else {FAULT}
