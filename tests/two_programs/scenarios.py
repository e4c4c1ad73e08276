"""Meetings that no row of the matrix tells: who is killed while another waits, who tries again and again."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.terminals import in_terminal
from tests.two_programs import registers
from tests.two_programs.bench import (
    AIR_C,
    COOL_DOWN,
    HEATING,
    HOLD,
    NEARLY_HOT_C,
    NEVER_HOT,
    SINE,
    SPECIMEN_ID,
    WAITS_WHEN_HOT,
    Bench,
    bench,
)
from tests.two_programs.cells import (
    PHASE_PATIENCE_S,
    SEEN_S,
    SETTLED_S,
    LOADED_kN,
    valve_while_waiting,
    waits_to_cool,
)
from tests.two_programs.programs import Launcher, Program
from tests.two_programs.rules import COMPLETE, FAULT, STOPPED, commands_of, complaints, stated_s
from tests.two_programs.tap import Request
from tests.two_programs.witness import Look

TRY_S = 1.5
"""So long somebody without patience waits before he presses Ctrl-C and starts again [s]."""
NARROW = "following_error_max_mm = 0.5\nfollowing_error_grace_s = 0.1\n"
"""The piston's lag of 18 ms at 50 mm/s is 0.9 mm."""
GIVEN_UP_S = 60.0
IN_TIME_S = 2.0


def killed_while_another_waits(
    folder: Path, launcher: Launcher, watchdog_s: float = 2.0, *, hot: bool = True
) -> list[str]:
    """A campaign waits for cooling, a second is killed under load: waiting must not keep its motion alive.

    Args:
        folder: Made for it.
        launcher: Starts the programs.
        watchdog_s: Of the stand [s].
        hot: It waits after a temperature stop; else in a step that cools down.
    """
    with bench(folder, launcher, watchdog_s, NEARLY_HOT_C if hot else AIR_C) as stand:
        campaign = (
            stand.campaign("first", HEATING, limits=WAITS_WHEN_HOT)
            if hot
            else stand.campaign("first", HOLD.format(stroke=5.0, duration=0.1), COOL_DOWN)
        )
        waiting = stand.run(campaign)
        cools = partial(waits_to_cool, waiting)
        if stand.witness.wait_for(cools, PHASE_PATIENCE_S, lambda: waiting.alive) is None:
            return [f"the first never waited: {waiting.last_line}"]
        time.sleep(SETTLED_S)
        wrong = valve_while_waiting(stand)
        second = stand.run(stand.campaign("second", HOLD.format(stroke=30.0, duration=60.0)))
        loaded = stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: second.alive)
        if loaded is not None:
            position_mm, killed_s = loaded.values["position_mm"], second.kill()
            bound_s = stated_s(stand, position_mm)
            stand.witness.wait_for(lambda look: look.safe, bound_s)
            safe_s = stand.witness.safe_since(killed_s)
            if safe_s is None or safe_s - killed_s > bound_s:
                wrong.append(f"{bound_s:.1f} s after the kill: {stand.witness.now}")
            wrong += [
                f"the waiting one wrote: {one}"
                for one in commands_of(stand, waiting)
                if one.time_s > killed_s
            ]
        elif second.wait() != FAULT or str(waiting.pid) not in second.said:
            # A wait that keeps the lock is as good, where it says who keeps it.
            wrong.append(
                f"the second neither ran nor was told who waits: {second.status}, {second.last_line}"
            )
        waiting.send(signal.SIGINT)
        if waiting.wait() != STOPPED:
            wrong.append(f"the waiting one ended with {waiting.status}: {waiting.last_line}")
        time.sleep(SEEN_S)
        return wrong + complaints(stand)


def refused_then_resumed(folder: Path, launcher: Launcher) -> list[str]:
    """A second run is refused under load and told by whom; the first is killed; a resume waits its turn."""
    with bench(folder, launcher) as stand:
        # Until the first is killed and its resume stopped, however long the others take to come.
        campaign = stand.campaign("first", HOLD.format(stroke=30.0, duration=600.0))
        first = stand.run(campaign)
        stand.witness.wait_for(lambda look: look.force_kN > LOADED_kN / 2, PHASE_PATIENCE_S)
        second = stand.run(stand.campaign("second", HOLD.format(stroke=25.0, duration=0.5)))
        wrong = [] if second.wait() == FAULT else [f"the second: {second.status}, {second.last_line}"]
        if str(first.pid) not in second.said:
            wrong.append(f"the second was not told the first's process: {second.last_line}")
        at_kill = stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: first.alive)
        if at_kill is None:
            return [*wrong, f"the first did not hold to the kill: {first.last_line}"]
        killed_s = first.kill()
        resume = stand.resume(campaign)
        stand.witness.wait_for(lambda look: look.safe, PHASE_PATIENCE_S)
        if stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: resume.alive) is None:
            wrong.append(f"resume never held: {resume.last_line}")
        resume.send(signal.SIGINT)
        if resume.wait() != STOPPED:
            wrong.append(f"resume ended with {resume.status}: {resume.last_line}")
        safe_s, bound_s = stand.witness.safe_since(killed_s), stated_s(stand, at_kill.values["position_mm"])
        if safe_s is None or safe_s - killed_s > bound_s:
            wrong.append(f"not safe within {bound_s:.1f} s after the kill")
        early = [one for one in commands_of(stand, resume) if safe_s is None or one.time_s < safe_s]
        wrong += [f"resume wrote before the controller had ended it: {one}" for one in early[:1]]
        time.sleep(SEEN_S)
        return wrong + complaints(stand)


def resumed_after_a_kill(
    folder: Path, launcher: Launcher, watchdog_s: float, try_s: float | None
) -> tuple[float | None, list[str]]:
    """Return how long after a kill under load a resume is let in [s], and what went wrong.

    Args:
        folder: Made for it.
        launcher: Starts the programs.
        watchdog_s: Of the stand [s].
        try_s: Each try is ended by Ctrl-C after this, and made again [s]; None: one start that waits.
    """
    with bench(folder, launcher, watchdog_s) as stand:
        campaign = stand.campaign("first", HOLD.format(stroke=30.0, duration=2.0))
        first = stand.run(campaign)
        loaded = stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: first.alive)
        if loaded is None:
            return None, [f"the first never held: {first.last_line}"]
        killed_s = first.kill()
        first.wait()
        while True:
            resume = stand.resume(campaign)
            let_in = _let_in(stand, resume, try_s)
            if let_in is not None or try_s is None or time.monotonic() > killed_s + GIVEN_UP_S:
                break
            resume.send(signal.SIGINT)
            resume.wait()
        status = resume.wait()
        wrong = [] if status == COMPLETE else [f"resume ended with {status}: {resume.last_line}"]
        for one in stand.programs[1:-1]:
            wrong += [f"a try that was not let in wrote: {request}" for request in commands_of(stand, one)]
        bound_s = stated_s(stand, loaded.values["position_mm"])
        stand.witness.wait_for(lambda look: look.safe, bound_s)
        safe_s = stand.witness.safe_since(killed_s)
        if safe_s is None or safe_s - killed_s > bound_s:
            wrong.append(f"not safe within {bound_s:.1f} s after the kill")
        time.sleep(SEEN_S)
        return None if let_in is None else let_in.time_s - killed_s, wrong + complaints(stand)


def retried_and_waiting(folder: Path, launcher: Launcher, watchdog_s: float = 2.0) -> list[str]:
    """A user who tries again and again gets in as soon as one who waits."""
    waited_s, wrong = resumed_after_a_kill(folder / "waits", launcher, watchdog_s, None)
    retried_s, more = resumed_after_a_kill(folder / "tries", launcher, watchdog_s, TRY_S)
    wrong += more
    if waited_s is None or retried_s is None or retried_s > waited_s + TRY_S + IN_TIME_S:
        wrong.append(f"who waits is let in after {waited_s} s, who tries again after {retried_s} s")
    return wrong


def ended_under_load(folder: Path, launcher: Launcher, why: str) -> list[str]:
    """A stop whose hold and release are refused leaves force behind: whatever it was for, its status is 4.

    Args:
        folder: Made for it.
        launcher: Starts the programs.
        why: ``operator`` (Ctrl-C) or ``following error`` (a guard that the piston's lag of 18 ms trips).
    """
    with bench(folder, launcher) as stand:
        limits = NEVER_HOT if why == "operator" else NEVER_HOT + NARROW
        campaign = stand.campaign(
            "first", HOLD.format(stroke=30.0, duration=5.0), speed_mm_per_s=50.0, limits=limits
        )
        stand.tap.refuses = _is_stop
        first = stand.run(campaign)
        if why == "operator":
            stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: first.alive)
            first.send(signal.SIGINT)
        status = first.wait()
        at_end = (
            stand.witness.wait_for(lambda look: look.time_s >= (first.ended_s or 0.0), 5.0)
            or stand.witness.now
        )
        wrong = [] if why in first.said else [f"it was not the {why} that ended it: {first.last_line}"]
        wrong += [] if not at_end.safe else [f"force was gone all the same: {at_end}"]
        if status != FAULT:
            wrong.append(
                f"exit status {status}, and the stand is not safe: {at_end}; it says: {first.last_line}"
            )
        if "NOT SAFE" not in first.said and "NOT SEEN" not in first.said:
            wrong.append(f"it does not say that the stand is not safe: {first.last_line}")
        return wrong


def asleep_while_another_runs(folder: Path, launcher: Launcher) -> list[str]:
    """A program sleeps under load (SIGSTOP, as by Ctrl-Z) until the stand is another's, and wakes up."""
    with bench(folder, launcher) as stand:
        first = stand.run(stand.campaign("first", HOLD.format(stroke=30.0, duration=60.0)))
        held = stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: first.alive)
        if held is None:
            return [f"the first never held: {first.last_line}"]
        asleep_s = time.monotonic()
        first.send(signal.SIGSTOP)
        forgotten = stand.witness.wait_for(lambda look: look.safe and look.values["writer"] == 0, GIVEN_UP_S)
        safe_s, bound_s = stand.witness.safe_since(asleep_s), stated_s(stand, held.values["position_mm"])
        if forgotten is None or safe_s is None or safe_s - asleep_s > bound_s:
            return [f"not safe within {bound_s:.1f} s, or not given up: {stand.witness.now}"]
        second = stand.run(stand.campaign("second", HOLD.format(stroke=35.0, duration=4.0)))
        stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: second.alive)
        awake_s = time.monotonic()
        first.send(signal.SIGCONT)
        wrong = [] if first.wait() == FAULT else [f"the first ended with {first.status}: {first.last_line}"]
        if second.wait() != COMPLETE:
            wrong.append(f"the second ended with {second.status}: {second.last_line}")
        late = [one for one in commands_of(stand, first) if one.time_s > awake_s]
        time.sleep(SEEN_S)
        # The first has written before it fell asleep, and may say of the other's stand that it is not safe.
        others = [one for one in complaints(stand) if "was refused" not in one and "NOT SAFE" not in one]
        return wrong + [f"the first wrote: {one}" for one in late] + others


def crowd(folder: Path, launcher: Launcher, many: int = 5) -> list[str]:
    """So many campaigns start at once: one has the stand, the others have written nothing."""
    with bench(folder, launcher) as stand:
        names = [f"campaign-{number}" for number in range(many)]
        wanted = [stand.campaign(name, HOLD.format(stroke=30.0, duration=2.0)) for name in names]
        programs = [stand.run(campaign) for campaign in wanted]
        statuses = sorted(program.wait() for program in programs)
        time.sleep(SEEN_S)
        lines = [f"{program.status}: {program.last_line}" for program in programs]
        wrong = [] if statuses == [COMPLETE] + [FAULT] * (many - 1) else lines
        return wrong + complaints(stand)


def simulated_then_resumed(folder: Path, launcher: Launcher) -> list[str]:
    """A rehearsal is stopped and gone on with by a plain resume: the real stand must not hear of it."""
    with bench(folder, launcher) as stand:
        campaign = stand.campaign("first", HOLD.format(stroke=30.0, duration=3.0))
        rehearsal = stand.start("rehearsal", "run", campaign, "--out", stand.out(campaign), "--simulate")
        _wait_until(lambda: "step 1 of 1" in rehearsal.said, rehearsal)
        time.sleep(2.0)
        rehearsal.send(signal.SIGINT)
        wrong = (
            []
            if rehearsal.wait() == STOPPED
            else [f"the rehearsal: {rehearsal.status}, {rehearsal.last_line}"]
        )
        resume = stand.resume(campaign)
        status = resume.wait()
        wrong += [f"resume asked the real stand: {one}" for one in stand.tap.by(resume.pid)[:1]]
        if status not in (COMPLETE, 2):
            wrong.append(f"resume ended with {status}: {resume.last_line}")
        return wrong + complaints(stand)


def real_then_simulated(folder: Path, launcher: Launcher) -> list[str]:
    """A campaign that began on a real stand is not gone on with on a simulated one."""
    with bench(folder, launcher) as stand:
        # A controller without the word of a simulated one counts as real (docs/drivers.md).
        stand.tap.refuses = lambda request: request.read_from == registers.SIMULATED
        campaign = stand.campaign("first", SINE.format(cycles=5))
        first = stand.run(campaign)
        stand.witness.wait_for(_waves, PHASE_PATIENCE_S, lambda: first.alive)
        first.send(signal.SIGINT)
        wrong = [] if first.wait() == STOPPED else [f"the first: {first.status}, {first.last_line}"]
        words = ("resume", stand.out(campaign), "--simulate", "--yes-move", SPECIMEN_ID)
        resume = stand.start("resume simulated", *words)
        if resume.wait() != 2:
            wrong.append(f"resume --simulate ended with {resume.status}: {resume.last_line}")
        wrong += [f"resume --simulate asked the real stand: {one}" for one in stand.tap.by(resume.pid)[:1]]
        return wrong + complaints(stand)


def asked_while_another_runs(folder: Path, launcher: Launcher) -> list[str]:
    """A first run waits for its operator's consent; a second one runs; then the operator consents."""
    with bench(folder, launcher) as stand:
        mine = stand.campaign("first", HOLD.format(stroke=10.0, duration=1.0))
        with in_terminal("run", mine, "--out", stand.out(mine)) as terminal:
            terminal.wait_for("type the id of the specimen")
            second = stand.run(stand.campaign("second", HOLD.format(stroke=30.0, duration=10.0)))
            stand.witness.wait_for(_held, PHASE_PATIENCE_S, lambda: second.alive)
            terminal.press(f"{SPECIMEN_ID}\n")
            status = terminal.end()
            said = terminal.text
        wrong = [] if status == FAULT else [f"the first ended with {status}: {said[-300:]}"]
        if str(second.pid) not in said:
            wrong.append(f"the first was not told who runs: {said[-300:]}")
        if second.wait() != COMPLETE:
            wrong.append(f"the second ended with {second.status}: {second.last_line}")
        others = [one for one in stand.tap.requests[:] if one.commands and one.pid != second.pid]
        time.sleep(SEEN_S)
        return wrong + [f"the first wrote: {one}" for one in others] + complaints(stand)


def _held(look: Look) -> bool:
    return look.state == registers.HOLDING and look.force_kN > LOADED_kN


def _waves(look: Look) -> bool:
    return look.state == registers.WAVEFORM and look.force_kN > LOADED_kN


def _let_in(stand: Bench, program: Program, within_s: float | None) -> Request | None:
    """Wait for a program's first control word that the controller took; None where none comes in time."""
    end_s = time.monotonic() + (GIVEN_UP_S if within_s is None else within_s)

    def switches_on(request: Request) -> bool:
        return request.refused is None and request.value("control_word") is not None

    while program.alive and time.monotonic() < end_s:
        if (found := stand.tap.first(program.pid, switches_on)) is not None:
            return found
        time.sleep(0.02)
    return stand.tap.first(program.pid, switches_on)


def _is_stop(request: Request) -> bool:
    """Say whether it arms a hold under load or a release: the controller does not do so any more."""
    return request.value("command_code") == 5 or (
        request.value("command_code") == 1 and request.value("execute") != 1
    )


def _wait_until(what: Callable[[], bool], program: Program) -> None:
    end_s = time.monotonic() + PHASE_PATIENCE_S
    while program.alive and not what() and time.monotonic() < end_s:
        time.sleep(0.05)
