"""How often the twin is wrong, and what it finds: python -m tests.model.twin.study [RUNS] [FAULTS] [HOURS]

Three parts: quiet cycles of specimens that differ from their model as its fit allows; the alarm's rule alone
over thousands of hours; faults put into the specimen.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from bufferstand.model.twin import FAULT_KINDS, LIMIT, Twin, TwinAlarm, dead_zone, increments, stepped
from tests.model.twin.specimens import (
    FAULTS,
    HELD_OUT,
    drawn_spring,
    drawn_step,
    known_model,
    measured_step,
)

FASTEST_Hz = 2.5
STEP_S = 300.0
"""What lasts is another in each step of so long."""


@dataclass(frozen=True, eq=False)
class Quiet:
    """Cycles without a fault: how many, the time that they took, alarms, and the largest of each kind.

    ``largest`` is in standard uncertainties of what lasts, shape (6,); ``rms`` likewise.
    """

    cycles: int
    hours: float
    alarms: int
    largest: np.ndarray
    rms: np.ndarray
    outside: float


def quiet(runs: int, seed: int = 1) -> Quiet:
    """Judge quiet runs, each of a specimen of its own."""
    random = np.random.default_rng(seed)
    alarms, seconds, shares, outside = 0, 0.0, [], []
    for _ in range(runs):
        twin = Twin(known_model())
        found = twin.take(measured_step(random, drawn_step(random), drawn_spring(random)))
        alarms += len(found.alarms)
        seconds += sum(one.cycle.period_s for one in found.judged)
        shares += [one.alone / one.alone_u for one in found.judged]
        outside += [one.share_outside for one in found.judged]
    table = np.array(shares)
    return Quiet(
        len(table),
        seconds / 3600.0,
        alarms,
        np.abs(table).max(axis=0),
        np.sqrt(np.mean(table**2, axis=0)),
        float(np.mean(outside)),
    )


def rule_alone(hours: float, seed: int = 2, lanes: int = 4000) -> tuple[int, float, float]:
    """Let the rule run over figures as the twin states their uncertainties: alarms, hours, cycles.

    Every step has a lasting error of each kind drawn anew, every cycle its noise: a quarter of the lasting
    uncertainty, the least that the rule counts, at the fastest frequency.
    """
    random = np.random.default_rng(seed)
    dead, kinds = dead_zone(HELD_OUT), len(FAULT_KINDS)
    cycles = round(STEP_S * FASTEST_Hz)
    steps = max(1, round(hours * 3600.0 / STEP_S / lanes))
    sums, alarms = np.zeros((2, lanes, kinds)), 0
    one = np.ones((lanes, kinds))
    for _ in range(steps):
        lasting = random.standard_t(HELD_OUT, (lanes, kinds))
        for _ in range(cycles):
            alone = lasting + 0.25 * random.standard_normal((lanes, kinds))
            sums = stepped(sums, increments(alone, 0.0 * one, one, dead))
            hit = np.any(sums >= LIMIT, axis=(0, 2))
            alarms += int(np.count_nonzero(hit))
            sums[:, hit] = 0.0
    return alarms, steps * lanes * STEP_S / 3600.0, float(steps * lanes * cycles)


@dataclass(frozen=True)
class Found:
    """What came of one kind of fault: runs, those with an alarm behind the onset, before it, named right."""

    name: str
    size: float
    runs: int
    found: int
    early: int
    first: int
    among: int
    cycles: float
    change: float


def faults(name: str, runs: int, seed: int = 3, onset: int = 10) -> Found:
    """Put a fault into runs from a cycle on."""
    random = np.random.default_rng(seed)
    size, early, alarms = FAULTS[name], 0, []
    for _ in range(runs):
        step = drawn_step(random)
        drive = measured_step(random, step, drawn_spring(random), (name, size), onset)
        found = Twin(known_model()).take(drive).alarms
        early += sum(one.cycle <= onset - 1 for one in found)
        late = [one for one in found if one.cycle > onset - 1]
        alarms += late[:1]
    first = [one for one in alarms if one.moved[0].kind.name == name]
    return Found(
        name,
        size,
        runs,
        len(alarms),
        early,
        len(first),
        sum(_among(one, name) for one in alarms),
        float(np.mean([one.cycle - onset for one in alarms])) if alarms else float("nan"),
        float(np.median([_change(one, name) for one in first])) if first else float("nan"),
    )


def _among(alarm: TwinAlarm, name: str) -> bool:
    return any(one.kind.name == name for one in alarm.moved)


def _change(alarm: TwinAlarm, name: str) -> float:
    return next(one.change for one in alarm.moved if one.kind.name == name)


def main(runs: int, fault_runs: int, hours: int) -> None:
    """Print all three parts."""
    calm = quiet(runs)
    print(f"quiet: {calm.cycles} cycles of {runs} specimens, {calm.hours:.2f} h: {calm.alarms} alarms")
    print(f"  nodes outside the band: {100.0 * calm.outside:.1f} %; dead zone {dead_zone(HELD_OUT):.2f}")
    for kind, largest, rms in zip(FAULT_KINDS, calm.largest, calm.rms, strict=True):
        print(f"  {kind.name:15} largest {largest:.2f}, rms {rms:.2f} standard uncertainties")
    alarms, told, cycles = rule_alone(hours)
    rate = 1000.0 * alarms / told
    print(f"rule alone: {told:.0f} h, {cycles:.3g} cycles: {alarms} alarms, {rate:.3f} in 1000 h")
    for name in FAULTS:
        one = faults(name, fault_runs)
        print(
            f"{name:15} {one.size:+g}: found {one.found} of {one.runs} ({one.early} too early), named first "
            f"{one.first}, among those named {one.among}; {one.cycles:.1f} cycles after the onset; "
            f"median {one.change:+.3g}"
        )


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*(given + [100, 20, 3000][len(given) :]))
