"""What must be true of every meeting of two programs, judged by what tap and witness saw alone."""

from __future__ import annotations

from tests.two_programs.bench import Bench
from tests.two_programs.programs import Program
from tests.two_programs.tap import Request
from tests.two_programs.witness import Look

FORGOTTEN_S = 10.0
"""So long after the last heartbeat the controller keeps a writer (docs/drivers.md)."""
RELEASE_MM_PER_S = 20.0
"""How fast the simulated controller takes the force away by itself (docs/simulated-stand.md)."""
MARGIN_S = 2.0
"""For the looks of the device at its watchdog (each counts for 0.25 s at most) and a busy computer."""
AT_ONCE_S = 0.5
"""Between a request at the tap and its effect, on a busy computer."""
COMPLETE, STOPPED, FAULT = 0, 3, 4


def complaints(bench: Bench) -> list[str]:
    """Return what went wrong, whoever met whom."""
    found = [f"the witness failed: {bench.witness.failure}"] if bench.witness.failure else []
    found += written_without_lock(bench) + past_the_tap(bench)
    found += [f"valve off under load: {look}" for look in bench.witness.cut_off(0.0)]
    for program in bench.programs:
        found += _ending(bench, program)
    if not bench.witness.now.safe:
        found.append(f"at the end the stand is not safe: {bench.witness.now}")
    return found


def written_without_lock(bench: Bench) -> list[str]:
    """Return each request that commands the stand of a process that does not hold the writer's lock.

    A feed counts, too: it keeps a motion alive. Writing the own number asks for the lock: no command.
    The contract suite tries what a controller does without the lock: no harm while nobody has it.
    """
    found: dict[tuple[int | None, str], str] = {}
    holder: int | None = None
    until_s = 0.0
    for request in sorted(bench.tap.requests[:], key=lambda one: one.time_s):
        if not request.commands or request.refused is not None:
            continue
        if request.time_s > until_s:
            holder = None
        number = request.value("writer")
        if number == 0 and holder not in (None, request.pid):
            found[request.pid, "0"] = (
                f"{bench.name(request.pid)} gave the lock of {bench.name(holder)} back: {request}"
            )
        if number is not None:
            holder = request.pid if number else None
        elif request.pid != holder and not (holder is None and bench.name(request.pid).endswith("suite")):
            whose = "nobody" if holder is None else bench.name(holder)
            names = " ".join(sorted(request.commands))
            found.setdefault(
                (request.pid, names),
                f"{bench.name(request.pid)} wrote while {whose} held the lock: {request}",
            )
        if holder == request.pid:
            until_s = request.time_s + FORGOTTEN_S
    return list(found.values())


def past_the_tap(bench: Bench) -> list[str]:
    """Return what the witness saw change and the tap saw nobody write: then the tap proves nothing."""
    requests = bench.tap.requests[:]
    return [
        f"{name} changed between {before_s:.3f} and {after_s:.3f} s, and nobody wrote it"
        for name, before_s, after_s in bench.witness.changed()
        if not any(
            name in one.names and before_s - AT_ONCE_S < one.time_s < after_s + AT_ONCE_S for one in requests
        )
    ]


def _ending(bench: Bench, program: Program) -> list[str]:
    found = []
    if "Traceback" in program.said:
        found.append(f"{bench.name(program.pid)} ends in a traceback: {program.last_line}")
    if program.ended_s is None or program.status == -9:
        return found
    wrote = commands_of(bench, program)
    if program.status in (2, FAULT) and wrote and program.label != "suite":  # pytest's 2 is a Ctrl-C
        found.append(f"{bench.name(program.pid)} was refused ({program.status}) and has written: {wrote[0]}")
    seen = look_at(bench, program.ended_s)
    if (
        program.status in (COMPLETE, STOPPED)
        and wrote
        and seen is not None
        and not seen.safe
        and holds(bench, program)
    ):
        found.append(
            f"{bench.name(program.pid)} ended with {program.status}, and the stand is not safe: {seen}"
        )
    # Who has sent nothing may say so of another's stand (docs/guards-and-safe-stop.md).
    words = () if "not this program's to stop" in program.said and not wrote else ("NOT SAFE", "NOT SEEN")
    unsafe = [word for word in words if word in program.said]
    return found + [f"{bench.name(program.pid)} says {word}: {program.last_line}" for word in unsafe]


def commands_of(bench: Bench, program: Program) -> list[Request]:
    """Return what a program wrote that commands the stand and that the controller took."""
    return [one for one in bench.tap.by(program.pid) if one.commands and one.refused is None]


def holds(bench: Bench, program: Program) -> bool:
    """Say whether nobody took the lock after a program: what the stand does at its end is its own doing."""
    assert program.ended_s is not None
    mine = [one.time_s for one in commands_of(bench, program)]
    return not any(
        one.pid != program.pid and one.commands and mine[-1] < one.time_s < program.ended_s
        for one in bench.tap.requests[:]
    )


def look_at(bench: Bench, time_s: float) -> Look | None:
    """Return the first look from an instant on, or the last before it."""
    looks = bench.witness.looks(time_s)
    return looks[0] if looks else bench.witness.now


def stated_s(bench: Bench, position_mm: float, watchdog_s: float | None = None) -> float:
    """Return within which time after a kill force and valve must be gone [s]."""
    watchdog = bench.watchdog_s if watchdog_s is None else watchdog_s
    return watchdog + max(position_mm, 0.0) / RELEASE_MM_PER_S + MARGIN_S
